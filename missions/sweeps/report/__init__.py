"""The HTML page about a sweep, or two: rates by factor, distributions, failures, places, tests."""
