"""Simulated people: along loops, by social forces, and recorded ones."""

from stack.sim.people.crowd import People
from stack.sim.people.loops import Robots, Walker

__all__ = ["People", "Robots", "Walker"]
