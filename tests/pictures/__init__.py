"""The pictures of README and docs, made by `python -m tests.pictures` from real runs."""
