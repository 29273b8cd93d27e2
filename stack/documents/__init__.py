"""Reader of YAML files with positions: missions, worlds, robots and maps.

Every finding has file, line and column. A reader collects all findings before it raises.

Codes: E001..E019 files, YAML and texts · E1xx missions · E2xx worlds · E3xx robots · E4xx maps and
components.
"""

from stack.documents.file_kinds import require_kind
from stack.documents.findings import Finding, Findings, Mark
from stack.documents.reader import (
    Section,
    is_one_line,
    read_document,
    read_file,
    read_ros_parameters,
    read_text,
    value_of,
)
from stack.documents.yaml_nodes import MAX_DEPTH, MAX_NODES, Node, as_yaml, iter_scalars

__all__ = [
    "MAX_DEPTH", "MAX_NODES", "Finding", "Findings", "Mark", "Node", "Section",
    "as_yaml", "is_one_line", "iter_scalars", "read_document", "read_file", "read_ros_parameters",
    "read_text",
    "require_kind", "value_of",
]  # fmt: skip
