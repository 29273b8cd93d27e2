"""Missions: the language, the compiler, the runner and the command line."""
