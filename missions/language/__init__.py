"""The mission language: from a YAML file to a checked model, with every finding in one go.

`reading.read_mission` is the way in; `model.Mission` is what comes out and what
`missions.trees.compiler` turns into a tree. Nothing here needs a robot or a simulator.
"""
