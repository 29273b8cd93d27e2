"""Nav2 parameter files as texts: what is imported from them, and missions that name them."""

from __future__ import annotations

from pathlib import Path

from missions.execution.prepare import Diagnosis, diagnose
from missions.execution.resources import MISSIONS
from missions.nav2.reading import Nav2Settings, read_nav2

SHIPPED = MISSIONS / "parameters" / "nav2_params.yaml"
PURE_PURSUIT = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"


def read(text: str) -> Nav2Settings:
    return read_nav2(Path("nav2_params.yaml"), text)


def values(found: Nav2Settings, kind: str) -> dict[str, object]:
    return dict(found.kinds[kind].values)


def check(tmp_path: Path, nav2: str, more: str = "") -> Diagnosis:
    """The diagnosis of a mission with these Nav2 parameters."""
    (tmp_path / "nav2.yaml").write_text(nav2, "utf-8")
    mission = "mission: a\nrobot: scout\nworld: office\nnavigation: {nav2_params: nav2.yaml"
    text = f"{mission}{more}}}\nrun: {{wait: 1 s}}\n"
    (tmp_path / "a.yaml").write_text(text, "utf-8")
    return diagnose(tmp_path / "a.yaml")
