"""Static analysis of a checked mission: data flow, outcomes, value intervals."""
