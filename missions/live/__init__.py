"""A mission that runs, from outside: its file saved anew, and orders from a terminal."""
