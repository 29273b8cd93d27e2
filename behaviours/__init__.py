"""Built-in behaviours, and the base class of behaviours (`treepilot.Behaviour`).

Loose here are `base` (the base class), `catalogue`, `testing`, `timer` and `scaffold`.
The built-in behaviours are in packages by subject, one in each file. Packages whose names begin
with an underscore hold what several of them share; the catalogue does not search them.
"""
