"""`treepilot falsify`: searches settings and faults that break a mission, and shrinks them."""
