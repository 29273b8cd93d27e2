"""Built-in behaviours, and the base class of behaviours (`treepilot.Behaviour`).

Loose here are `base` (the base class), `kind` (what missions know of a class), `catalogue`, `timer`
and `scaffold`; `testing` is the test kit.
The built-in behaviours are in packages by subject, one in each file. Packages whose names begin
with an underscore hold what several of them share; the catalogue does not search them.
"""
