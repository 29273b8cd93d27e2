"""Build the parts of a prepared mission and connect them to an engine."""

from __future__ import annotations

from missions.execution.build.engine import Engine, build, run_info
from missions.execution.build.events import announce_tree, tree_emitter

__all__ = ["Engine", "announce_tree", "build", "run_info", "tree_emitter"]
