"""ROS nodes of a parameter file: their names, namespaces and parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from stack.documents import Finding, Node
from stack.errors import InputError

CODE = "E116"
ANY = ("*", "**")
"""Parts of a node's name that stand for any name, or any number of them."""

SERVERS = {
    "behavior_server": ("behavior_server", "recoveries_server"),
    **{name: (name,) for name in (
        "controller_server", "planner_server", "smoother_server", "local_costmap",
        "global_costmap", "velocity_smoother", "collision_monitor",
    )},
}  # fmt: skip
"""Servers that are imported, with their names in all versions of Nav2."""

_NAMES = {name for names in SERVERS.values() for name in names}


@dataclass(frozen=True, slots=True)
class RosNode:
    """The parameters of one node: `/robot1/controller_server`.

    Attributes:
        namespace: without wildcards; empty at the root.
        name: `**` for every node of the namespace.
        everywhere: whether a wildcard stands for any namespace.
        parameters: a mapping; keys with dots are nested mappings.
    """

    namespace: str
    name: str
    everywhere: bool
    parameters: Node

    @property
    def path(self) -> str:
        """Name for messages: `controller_server`, `/**`."""
        return f"/{self.name}" if self.name in ANY else self.name


def nodes_of_robot(top: Node, namespace: str | None = None) -> list[RosNode]:
    """Return the nodes of one robot, in the order of the file; nodes of no robot are its own.

    Args:
        top: of the file.
        namespace: of the robot; None if there is only one.

    Raises:
        InputError: not a parameter file, several robots of which none is chosen, or no such robot.
    """
    nodes = list(_nodes(top, ()))
    if not nodes:
        sentence = "not a Nav2 parameter file: no node has `ros__parameters`"
        hint = "parameters of ROS 1 (move_base) are not read"
        raise InputError([Finding(top.mark, CODE, sentence, hint)])
    robots = dict.fromkeys(
        node.namespace for node in nodes if node.name in _NAMES and not node.everywhere
    )
    others = [robot for robot in robots if robot != _chosen(list(robots), namespace, top)]
    return [node for node in nodes if node.everywhere or node.namespace not in others]


def _chosen(robots: Sequence[str], namespace: str | None, top: Node) -> str:
    wanted = None if namespace is None else "/".join(_parts(namespace))
    if wanted is not None and (wanted in robots or not robots):
        return wanted
    if wanted is None and len(robots) < 2:
        return next(iter(robots), "")
    listed = ", ".join(f"/{robot}" for robot in robots)
    if wanted is None:
        sentence = f"the file has parameters of {len(robots)} robots: {listed}"
        hint = f"choose one: `nav2_params: {{file: FILE, namespace: /{robots[0]}}}`, or --namespace"
    else:
        sentence = f"the file has no robot with the namespace /{wanted}"
        hint = f"it has {listed}"
    raise InputError([Finding(top.mark, CODE, sentence, hint)])


def parameters_of(server: str, nodes: Sequence[RosNode]) -> tuple[str, Node] | None:
    """Return the name and the parameters of a server: those for every node, then its own."""
    own = [node for node in nodes if node.name in SERVERS[server]]
    shared = [node for node in nodes if node.name in ANY]
    merged: Node | None = None
    for node in (*shared, *own):
        merged = _merged(merged, node.parameters)
    return None if merged is None else ((own or shared)[-1].path, merged)


def _nodes(top: Node, above: tuple[str, ...]) -> Iterator[RosNode]:
    for key, value in top.entries:
        path = (*above, *_parts(str(key.value)))
        inner = value.get("ros__parameters")
        if inner is not None and inner.is_mapping and path:
            yield _node(path, inner)
        else:
            yield from _nodes(value, path)


def _node(path: tuple[str, ...], parameters: Node) -> RosNode:
    *around, name = path
    if around and around[-1] == name and name.endswith("costmap"):
        around.pop()  # a costmap is a node in a namespace of its own name
    namespace = "/".join(part for part in around if part not in ANY)
    everywhere = any(part in ANY for part in around) or (name in ANY and not around)
    return RosNode(namespace, name, everywhere, nested(parameters))


def _parts(name: str) -> list[str]:
    return [part for part in name.split("/") if part]


def nested(node: Node) -> Node:
    """Return a mapping in which `a.b: 1` is written `a: {b: 1}`, as ROS reads it."""
    found: Mapping[str, tuple[Node, Node]] = {}
    for key, value in node.entries:
        head, *rest = str(key.value).split(".")
        inner = nested(value) if value.is_mapping else value
        for part in reversed(rest):
            inner = replace(inner, value=[(replace(key, value=part), inner)], kind="mapping")
        known = found.get(head)
        found = {**found, head: (replace(key, value=head), _merged(known and known[1], inner))}
    return replace(node, value=list(found.values())) if node.is_mapping else node


def _merged(first: Node | None, then: Node) -> Node:
    """Return two values of one key as one: mappings are combined, else the second one counts."""
    if first is None or not (first.is_mapping and then.is_mapping):
        return then
    values = {key.value: (key, value) for key, value in first.entries}
    for key, value in then.entries:
        known = values.get(key.value)
        values[key.value] = key, _merged(known and known[1], value)
    return replace(then, value=list(values.values()))
