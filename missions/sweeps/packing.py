"""A sweep for other machines: its files as a packed run, and what has to be the same there."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, entry_points, version
from pathlib import Path
from tempfile import TemporaryDirectory
from uuid import uuid4

from missions.bench.conditions import digest
from missions.execution.prepare import prepare
from missions.execution.records.inputs import COPIES, PACKAGES, SHIPPED, keep_inputs, read_inputs
from missions.execution.resources import MISSIONS, versions
from missions.execution.run import Run
from missions.inspection.exchange.packing import pack, unpack
from missions.sweeps.design import RunDescription
from missions.sweeps.row import SweepRow
from missions.sweeps.sweep import Sweep
from missions.sweeps.worker import SweepInputs
from stack.errors import InputError
from stack.telemetry.recorder import RunFolder

ALSO_COMPARED = ("pin", "gtsam", "distributed")
"""Further packages whose versions are compared: results of arms and maps depend on them."""


JOINED = "+"
"""Joins names and files of faults."""


@dataclass(frozen=True)
class PackedSweep:
    """What a process on another machine needs to make the runs of a sweep.

    Attributes:
        name: unique.
        content: the packed run (`treepilot runs pack`) with all files.
        inputs: as on this machine.
        places: text on the command line that names a file -> its place among the copies.
        environment: what has to be the same on the other machine.
    """

    name: str
    content: bytes
    inputs: SweepInputs
    places: Mapping[str, str]
    environment: Mapping[str, str]


def pack_sweep(inputs: SweepInputs) -> PackedSweep:
    """Pack the files that the runs of a sweep read: mission, worlds, robots, plugins, maps.

    Raises:
        InputError: a file is too large, or cannot be read.
    """
    sweep = inputs.sweep
    options = sweep.options({}, sweep.seed)
    plan = prepare(sweep.mission, options)
    run = Run(plan, options)  # an engine reads more files than a check, such as models
    run.close()
    every = dict.fromkeys([*inputs.paths, *run.read, *plan.files])
    with TemporaryDirectory(prefix="treepilot-") as place:
        folder = RunFolder.create(Path(place) / "sweep", plan.text)
        folder.events.touch()
        copies = keep_inputs(folder, plan, options, every, None)
        kept = read_inputs(folder.path)
        large = next((item for item in kept.files if item.source), None)
        if large is not None:
            raise InputError(f"{large.source} is too large to be sent to other machines")
        zipped = Path(place) / "sweep.zip"
        pack(folder.path, zipped)
        content = zipped.read_bytes()
    places = {
        text: copies.name_of(file) for text in _texts(sweep)
        if (file := copies.file_of(text)) is not None
    }  # fmt: skip
    return PackedSweep(
        f"treepilot-{uuid4().hex[:12]}", content, inputs, places, environment(_shipped(every))
    )


def _texts(sweep: Sweep) -> Iterable[str]:
    """Yield all texts of a sweep that may name a file."""
    chosen = (sweep.mission, sweep.robot, sweep.world, sweep.faults)
    texts = [text for text in chosen if text is not None]
    texts += [*sweep.arguments.values(), *sweep.parameters.values()]
    texts += [text for factor in sweep.factors for text in factor.values]
    yield from texts
    yield from (name.strip() for text in texts if JOINED in text for name in text.split(JOINED))


class UnpackedSweep:
    """A packed sweep on the machine where its runs are made.

    Args:
        packed: the sweep.
        folder: an empty folder, in which it is unpacked.

    Attributes:
        inputs: with the unpacked files in place of the original ones.
    """

    def __init__(self, packed: PackedSweep, folder: Path) -> None:
        file = folder / "sweep.zip"
        file.write_bytes(packed.content)
        base = unpack(file, folder)
        file.unlink()
        self._places = {text: _unpacked(base, place) for text, place in packed.places.items()}
        sweep = packed.inputs.sweep
        here = replace(
            sweep, mission=self._here(sweep.mission),
            robot=sweep.robot and self._here(sweep.robot),
            world=sweep.world and self._here(sweep.world),
            faults=sweep.faults and self._here(sweep.faults),
            arguments=self._all_here(sweep.arguments), parameters=self._all_here(sweep.parameters),
        )  # fmt: skip
        self.inputs = replace(packed.inputs, sweep=here, runs=folder / "kept" / "runs")

    def run_here(self, run: RunDescription) -> RunDescription:
        """Return a run with the unpacked files."""
        return replace(run, settings=tuple(self._all_here(dict(run.settings)).items()))

    def row_there(self, row: SweepRow, run: RunDescription) -> SweepRow:
        """Return a row as it is on the machine of the sweep."""
        reason = row.reason
        for text, place in self._places.items():
            reason = reason.replace(place, text)
        return replace(row, settings=dict(run.settings), reason=reason)

    def _here(self, text: str) -> str:
        parts = [text] if text in self._places else text.split(JOINED)
        return JOINED.join(self._places.get(part.strip(), part) for part in parts)

    def _all_here(self, texts: Mapping[str, str]) -> dict[str, str]:
        return {name: self._here(text) for name, text in texts.items()}


def _unpacked(base: Path, place: str) -> str:
    """Return the file in a place among the copies; those of treepilot are installed."""
    top, _, rest = place.partition("/")
    return str(MISSIONS.parent / rest if top == SHIPPED else base / COPIES / place)


def _shipped(files: Iterable[Path]) -> tuple[str, ...]:
    """Return the files of treepilot itself, which do not travel."""
    base = MISSIONS.parent
    return tuple(
        file.relative_to(base).as_posix() for file in files
        if any(file.is_relative_to(package) for package in PACKAGES)
    )  # fmt: skip


def environment(shipped: Iterable[str] = ()) -> dict[str, str]:
    """Return what results depend on here, besides the files of a sweep: versions and sources.

    Args:
        shipped: files of treepilot that the sweep reads, relative to where it is installed.
    """
    found = {**versions(), "Python": platform.python_version(), "processor": platform.machine()}
    for name in (*ALSO_COMPARED, *_plugin_packages()):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    found["sources of treepilot"] = _sources()
    for name in shipped:
        file = MISSIONS.parent / name
        found[name] = digest(file.read_bytes()) if file.is_file() else "not there"
    return found


def differences(here: Mapping[str, str], there: Mapping[str, str]) -> list[str]:
    """Return in what another machine differs from this one, as sentences."""
    return [
        f"{name} {there.get(name, 'not installed')} (here {here.get(name, 'not installed')})"
        for name in {**here, **there}
        if here.get(name) != there.get(name)
    ]


def _plugin_packages() -> list[str]:
    """Return the installed packages that bring plugins."""
    groups = [group for group in entry_points().groups if group.startswith("treepilot.")]
    points = (point for group in groups for point in entry_points(group=group))
    names = {point.dist.name for point in points if point.dist is not None}
    return sorted(names - {"treepilot"})


@cache
def _sources() -> str:
    """Return a digest of the Python files of treepilot: checkouts differ without a new version."""
    found = sha256()
    for package in PACKAGES:
        for file in sorted(package.rglob("*.py")):
            found.update(file.relative_to(package).as_posix().encode())
            found.update(file.read_bytes())
    return found.hexdigest()[:12]
