"""`treepilot sweep`: runs of a mission over seeds and factors, and what they show.

factors, design (what varies, in which runs) · sweep, sweep_file, checking (all of a sweep, and
whether it can run) · worker (one run, as a function) · row, table (its figures, on disk) · runner,
progress (many runs) · figures, statistics, claims (what they prove) · report/
"""
