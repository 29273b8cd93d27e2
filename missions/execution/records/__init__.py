"""What runs leave on disk besides their logs: run folders, pictures, kept values."""
