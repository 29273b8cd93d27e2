"""Who may import whom. The tables are the architecture (docs/architecture.md draws them).

Every package of stack and missions has a row; a new one needs a row before its first import.
Imports count wherever they stand in a file: at the top, inside functions, for type checkers only.
"""

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from stack import optional_packages
from stack.optional_packages import Package

ROOT = Path(__file__).parents[1]
TOP = ("treepilot", "missions", "behaviours", "stack", "tui", "robots")

FOUNDATION = {
    "stack.types", "stack.errors", "stack.parameters", "stack.documents", "stack.streams",
    "stack.columns",
    "stack.geometry", "stack.drivetrain", "stack.frames", "stack.lifecycle", "stack.schedule",
    "stack.compilation", "stack.kernel_cache", "stack.patience", "stack.child_process",
    "stack.worker_thread", "stack.optional_packages", "stack.plugins", "stack.clock",
    "stack.networks",
}  # fmt: skip
"""What any package of stack, and the robots, may use."""

BEHAVIOUR_API = {"stack.types", "stack.robot", "stack.errors", "stack.parameters"}
"""All of the stack that a built-in behaviour sees."""

MAY_IMPORT = {
    "treepilot": {"missions", "behaviours", "robots", "stack"},
    "behaviours": {"stack.drivetrain.needs", *BEHAVIOUR_API},
    "tui": {
        "stack.types", "stack.telemetry", "stack.errors", "stack.parameters", "stack.documents",
    },
    "robots": {"stack.body", "stack.fast_loop", "stack.mavlink", "stack.sim", *FOUNDATION},
    "stack.types": set(),
    "stack.errors": {"stack.types"},
    "stack.parameters": {"stack.types", "stack.errors"},
    "stack.lifecycle": set(),
    "stack.schedule": set(),
    "stack.compilation": set(),
    "stack.kernel_cache": set(),
    "stack.patience": set(),
    "stack.child_process": {"stack.errors", "stack.patience"},
    "stack.worker_thread": {"stack.errors", "stack.patience"},
    "stack.optional_packages": {"stack.errors"},
    "stack.plugins": {"stack.errors", "stack.parameters"},
    "stack.clock": set(),
    "stack.columns": set(),
    "stack.streams": set(),
    "stack.documents": {"stack.types", "stack.errors", "stack.parameters"},
    "stack.networks": {"stack.errors", "stack.child_process", "stack.documents.files"},
    "stack.geometry": {"stack.types", "stack.kernel_cache"},
    "stack.frames": {
        "stack.types", "stack.errors", "stack.kernel_cache", "stack.compilation",
    },
    "stack.drivetrain": {"stack.types", "stack.errors", "stack.parameters", "stack.kernel_cache"},
    "stack.fast_loop": {  # a process of its own: the brain's packages stay out of it
        "stack.types", "stack.errors", "stack.parameters", "stack.plugins", "stack.drivetrain",
        "stack.kernel_cache",
    },
    "stack.robot": {"stack.types"},
    "stack.body": {"stack.types", "stack.drivetrain"},
    "stack.component_bases": {
        "stack.types", "stack.errors", "stack.drivetrain", "stack.frames", "stack.geometry",
        "stack.lifecycle", "stack.compilation", "stack.optional_packages",
    },
    "stack.components": {
        "stack.types", "stack.errors", "stack.parameters", "stack.frames", "stack.geometry",
        "stack.component_bases", "stack.compilation", "stack.drivetrain", "stack.plugins",
    },
    "stack.mavlink": {"stack.errors", "stack.optional_packages"},
    "stack.telemetry": {
        "stack.types", "stack.errors", "stack.parameters", "stack.documents.files",
        "stack.optional_packages", "stack.schedule", "stack.mavlink", "stack.columns",
    },
    "stack.mapping": {"stack.components", "stack.localisation", *FOUNDATION},
    "stack.localisation": {"stack.components", *FOUNDATION},
    "stack.perception": FOUNDATION,
    "stack.safety": FOUNDATION,
    "stack.planning": {"stack.components", *FOUNDATION},
    "stack.manipulation": FOUNDATION,
    "stack.costmap": {"stack.components", "stack.mapping", *FOUNDATION},
    "stack.control": {"stack.components", "stack.costmap", "stack.safety", *FOUNDATION},
    "stack.sim": {"stack.body", "stack.mapping", "stack.mavlink.origin", *FOUNDATION},
    "stack.navigation": {
        "stack.body", "stack.robot", "stack.components", "stack.control", "stack.costmap",
        "stack.localisation", "stack.manipulation", "stack.mapping", "stack.perception",
        "stack.planning", "stack.safety", *FOUNDATION,
    },
    "stack.runtime": {
        "stack.body", "stack.robot", "stack.components", "stack.costmap", "stack.localisation",
        "stack.navigation", "stack.perception", "stack.safety", "stack.telemetry", *FOUNDATION,
    },
    "missions.run_options": {"stack.telemetry"},
    "missions.map_picture": {"stack.errors", "stack.types"},
    "missions.language": {  # the file of a node kind holds its node of the tree
        "missions.trees", "behaviours", "stack.documents", "stack.drivetrain.needs",
        "stack.sim.faults.planned", "stack.telemetry", *BEHAVIOUR_API,
    },
    "missions.trees": {
        "missions.language", "behaviours", "stack.documents", "stack.telemetry", *BEHAVIOUR_API,
    },
    "missions.nav2": {
        "missions.language", "stack.components", "stack.costmap", "stack.navigation",
        "stack.safety", *FOUNDATION,
    },
    "missions.commissioning": {"robots", "stack"},
    "missions.execution": {
        "missions.run_options", "missions.commissioning", "missions.language", "missions.trees",
        "missions.nav2", "behaviours", "robots", "tui", "stack",
    },
    "missions.inspection": {
        "missions.execution", "missions.language", "missions.map_picture", "missions.trees",
        "behaviours", "robots", "stack",
    },
    "missions.testing": {
        "missions.execution", "missions.language", "missions.trees", "behaviours", "robots",
        "stack",
    },
    "missions.bench": {"missions.execution", "missions.map_picture", "stack"},
    "missions.tuning": {"missions.execution", "missions.inspection", "missions.sweeps", "stack"},
    "missions.learning": {
        "missions.execution", "missions.language", "missions.map_picture", "robots", "stack",
    },
    "missions.sweeps": {
        "missions.execution", "missions.inspection", "missions.bench", "robots", "stack",
    },
    "missions.falsify": {
        "missions.execution", "missions.bench", "missions.sweeps", "stack",
    },
    "missions.editor": {
        "missions.execution", "missions.inspection", "missions.language", "behaviours", "robots",
        "stack",
    },
    "missions.cli": {"missions", "behaviours", "stack"},
    "missions.my_behaviours": {"treepilot"},
}  # fmt: skip

DATA = {"stack": set(), "missions": {"worlds", "parameters", "routes", "maps"}}
"""Folders that hold data."""

PYBULLET_ENGINE = "stack/sim/physics/pybullet_engine"

ONE_PLACE = {
    "pybullet": {PYBULLET_ENGINE},
    "moderngl": {"stack/sim/sensors"},
    "rerun": {"stack/telemetry"},
    "foxglove": {"stack/telemetry/foxglove"},
    "pyarrow": {"stack/telemetry/rerun", "missions/sweeps"},
    "scipy": {"missions/sweeps"},
    "distributed": {"missions/sweeps"},
    "optuna": {"missions/tuning"},
    "cma": {"missions/falsify"},
    "can": {"robots/motors"},
    "pymavlink": {"stack/mavlink", "stack/telemetry", "robots"},
    "zmq": {"stack/telemetry"},
    "msgpack": {"stack/telemetry"},
    "mcap": {"stack/telemetry"},
    "rosbags": {"robots/logs"},
    "textual": {"tui"},
    "typer": {"missions/cli"},
    "gtsam": {"stack/mapping"},
    "pinocchio": {"stack/manipulation"},
    "coal": {"stack/manipulation"},
    "pygls": {"missions/editor"},
    "lsprotocol": {"missions/editor"},
    "yaml": {"stack/documents", "stack/mapping"},
    "py_trees": {"treepilot", "missions", "behaviours"},
}

PROVIDED_BY = {
    "yaml": "pyyaml", "cv2": "opencv-python-headless", "zmq": "pyzmq", "rerun": "rerun-sdk",
    "rich": "textual", "pyarrow": "rerun-sdk", "lz4": "mcap", "zstandard": "mcap",
    "lsprotocol": "pygls",
    "coal": "pinocchio",
}  # fmt: skip
"""Distributions that install a library of another name, themselves or with their dependencies."""


def module_of(file: Path) -> str:
    """The dotted name of a file: stack/sim/__init__.py is stack.sim."""
    parts = list(file.relative_to(ROOT).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def imported_names(file: Path) -> frozenset[str]:
    """Dotted names of all that a file imports; `from a import b` is a.b, relative ones resolved."""
    return frozenset(_imported_names(file))


def _imported_names(file: Path) -> Iterator[str]:
    package = module_of(file).split(".")
    if file.name != "__init__.py":
        package.pop()
    for node in _statements(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            origin = ".".join([*base, *([node.module] if node.module else [])])
            yield from (f"{origin}.{alias.name}" for alias in node.names)


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """All statements in a node: expressions, most of a syntax tree, import nothing."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            yield child
            yield from _statements(child)


@cache
def files_of(place: str) -> tuple[Path, ...]:
    """All modules of a package, or the one module; a place that is not there is an error."""
    folder = ROOT / place.replace(".", "/")
    files = sorted(folder.rglob("*.py")) or [
        file for file in [folder.with_suffix(".py")] if file.exists()
    ]
    assert files, f"{place}: no such package or module"
    return tuple(files)


def covered(name: str, allowed: set[str]) -> bool:
    """Whether the name, or a package around it, is on the list."""
    parts = name.split(".")
    return any(".".join(parts[: n + 1]) in allowed for n in range(len(parts)))


def test_relative_imports_are_resolved(tmp_path, monkeypatch):
    package = tmp_path / "stack" / "sim"
    package.mkdir(parents=True)
    (package / "lidar.py").write_text("from ..runtime import loop\nfrom . import imu\nimport numpy")
    (package / "__init__.py").write_text("from .lidar import Lidar")
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    found = {*imported_names(package / "lidar.py"), *imported_names(package / "__init__.py")}
    assert found == {"stack.runtime.loop", "stack.sim.imu", "numpy", "stack.sim.lidar.Lidar"}


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_imports_point_inwards(package):
    allowed = {package, *MAY_IMPORT[package]}
    wrong = [
        f"{file.relative_to(ROOT)} imports {name}"
        for file in files_of(package)
        for name in imported_names(file)
        if name.split(".")[0] in TOP and not covered(name, allowed)
    ]
    assert not wrong


@pytest.mark.parametrize("top", ["stack", "missions"])
def test_every_package_has_a_row(top):
    there = {
        path.stem if path.is_file() else path.name
        for path in (ROOT / top).iterdir()
        if path.suffix == ".py" or (path.is_dir() and any(path.rglob("*.py")))
    } - {"__init__", "__pycache__"}
    rows = {name.split(".")[1] for name in MAY_IMPORT if name.startswith(f"{top}.")}
    assert there - DATA[top] == rows


def test_no_module_imports_back_up():
    modules = {module_of(file): file for top in TOP for file in files_of(top)}
    graph: dict[str, set[str]] = {}
    for module, file in modules.items():
        names = (
            name if name in modules else name.rpartition(".")[0] for name in imported_names(file)
        )
        graph[module] = {name for name in names if name in modules and name != module}
    tuple(TopologicalSorter(graph).static_order())  # raises CycleError and names the modules


@pytest.mark.parametrize("library", ONE_PLACE)
def test_heavy_libraries_are_imported_in_one_place(library):
    importers = [
        file.relative_to(ROOT)
        for top in TOP
        for file in files_of(top)
        if any(covered(name, {library}) for name in imported_names(file))
    ]
    assert importers, f"nothing imports {library}: the row is out of date"
    places = ONE_PLACE[library]
    assert not [file for file in importers if not any(file.is_relative_to(p) for p in places)]


def test_only_the_default_names_the_pybullet_engine():
    """All of the simulation but this line works with another engine (stack/sim/physics)."""
    package = PYBULLET_ENGINE.replace("/", ".")
    outside = {
        str(file.relative_to(ROOT))
        for top in TOP
        for file in files_of(top)
        if not file.is_relative_to(ROOT / PYBULLET_ENGINE)
        and any(covered(name, {package}) for name in imported_names(file))
    }
    assert outside == {"stack/sim/physics/default.py"}


def test_every_library_is_a_dependency_or_in_the_table_of_optional_packages():
    """What only an extra installs must be asked for, or its user fails on the way."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    known = {re.split(r"[^\w.-]", entry)[0] for entry in project["dependencies"]}
    known |= {item.module for item in vars(optional_packages).values() if isinstance(item, Package)}
    used = {name.split(".")[0] for top in TOP for file in files_of(top)
            for name in imported_names(file)} - {*TOP, *sys.stdlib_module_names}  # fmt: skip
    assert {name for name in used if PROVIDED_BY.get(name, name) not in known} == set()


def test_no_folder_is_crowded():
    """At most 20 loose modules in a folder."""
    folders = {file.parent for top in TOP for file in files_of(top)}
    crowded = {
        str(folder.relative_to(ROOT)): count
        for folder in folders
        if (count := sum(file.name != "__init__.py" for file in folder.glob("*.py"))) > 20
    }
    assert not crowded


def test_every_package_says_what_it_is():
    silent = [
        str(folder.relative_to(ROOT))
        for folder in {file.parent for top in TOP for file in files_of(top)}
        if folder.name != "my_behaviours"
        and not (
            (folder / "__init__.py").exists()
            and ast.get_docstring(ast.parse((folder / "__init__.py").read_text("utf-8")))
        )
    ]
    assert not silent


def test_every_module_of_the_benches_serves_a_command():
    """Those that only developers use are in tests/benchmarks, and the wheel does not hold them."""
    modules = {module_of(file): file for file in files_of("missions.bench")}
    waiting = [*files_of("missions.cli"), *files_of("missions.sweeps")]
    reached: set[str] = set()
    while waiting:
        names = imported_names(waiting.pop())
        new = {
            module
            for name in names
            for module in (name, name.rpartition(".")[0])
            if module in modules and module not in reached
        }
        reached |= new
        waiting += [modules[module] for module in new]
    packages = {module for module in modules if modules[module].name == "__init__.py"}
    assert {*modules} - packages == reached - packages
