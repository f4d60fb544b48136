"""The command `problems`."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from commission.io.map_server import write_floor_map
from commission.io.reflector_tables import read_reflectors
from commission.site.floor_map import FREE, OCCUPIED, FloorMap


@pytest.fixture
def plates(project: Path) -> Path:
    """The small hall with walls at y = -4 and y = 4 m, and plates on them of which nobody says where they face."""
    cells = np.full((90, 300), FREE, np.int8)
    cells[:5], cells[-5:] = OCCUPIED, OCCUPIED
    write_floor_map(FloorMap(cells, 0.1, np.array([-5.0, -4.5, 0.0])), project / "map.yaml")
    text = (project / "project.yaml").read_text(encoding="utf-8")
    (project / "project.yaml").write_text(
        text.replace("reflectors:", "floor_map: map.yaml\nreflectors:"), encoding="utf-8"
    )
    rows = ["S,3,-4.04,0.1,flat,", "N,6,3.99,0.1,flat,", "F,9,0,0.1,flat,", "C,12,3,,cylinder,"]
    (project / "reflectors.csv").write_text("\n".join(["id,x,y,radius,kind,heading", *rows]) + "\n", encoding="utf-8")
    return project


def test_problems_of_a_site_are_told_with_what_is_unknown(commission, plates: Path) -> None:
    code, told, _ = commission("problems", plates)
    assert code == 0
    assert "Warning      3 of 4 reflectors are plates of unknown direction" in told
    assert "(S, N, F)" in told
    assert "1 of 4 reflectors have an unknown radius" in told


def test_plates_take_the_directions_of_their_walls_into_another_project(
    commission, plates: Path, tmp_path: Path
) -> None:
    out = tmp_path / "faced"
    code, told, _ = commission("problems", plates, "--face-from-walls", "--out", out)
    assert code == 0
    assert "2 plates face away from their walls now; F are locked" in told
    assert "1 of 4 reflectors are plates of unknown direction" in told
    written = {each.id: each for each in read_reflectors(out / "reflectors.csv").reflectors}
    assert written["S"].heading == pytest.approx(math.pi / 2, abs=1e-6)
    assert written["N"].heading == pytest.approx(-math.pi / 2, abs=1e-6)
    assert written["F"].heading is None
    assert written["C"].radius is None
    assert all(each.heading is None for each in read_reflectors(plates / "reflectors.csv").reflectors)


def test_out_and_face_from_walls_go_together(refused, plates: Path, tmp_path: Path) -> None:
    assert "together" in refused("problems", plates, "--face-from-walls")
    assert "together" in refused("problems", plates, "--out", tmp_path / "faced")
    assert "another folder" in refused("problems", plates, "--face-from-walls", "--out", plates)


def test_routes_from_which_too_few_reflectors_are_seen_are_told(commission, project):
    lines = (project / "reflectors.csv").read_text(encoding="utf-8").splitlines()
    (project / "reflectors.csv").write_text("\n".join(lines[:2]) + "\n", encoding="utf-8")
    code, told, _ = commission("problems", project)
    assert code == 0
    assert "Warning      Route 'Straight': " in told
    assert "in sight at worst" in told
