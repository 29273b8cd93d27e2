"""The mission language: reads a YAML file into a checked model and reports all findings at once.

`reading.mission.read_mission` is the entry point. It returns a `model.Mission`, which
`missions.trees.compiler` compiles into a tree. No robot or simulator is needed.
"""
