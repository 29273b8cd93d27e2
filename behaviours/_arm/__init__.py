"""What behaviours of arms share: poses in mission files, picking step by step."""
