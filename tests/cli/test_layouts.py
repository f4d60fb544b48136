"""Two layouts compared from the command line: with the figures of the study, and from either kind of file."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import pytest

from commission.io.project_file import save_project
from commission.io.reflector_tables import write_reflectors
from commission.site.reflectors import ReflectorMap
from commission.studies.layouts import LayoutInput, layout
from tests.app.sites import room

Command: TypeAlias = Callable[..., tuple[int, str, str]]


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    save_project(room(), tmp_path / "hall")
    return tmp_path / "hall"


def test_a_table_of_fewer_reflectors_is_worse_in_the_figures_of_the_study(
    commission: Command, hall: Path, tmp_path: Path
) -> None:
    fewer = ReflectorMap(room().reflectors.reflectors[:3])
    write_reflectors(fewer, tmp_path / "fewer.csv")
    code, told, err = commission("layouts", hall, tmp_path / "fewer.csv")
    assert (code, err) == (0, "")
    assert re.search(r"^Reflectors +4 -> 3$", told, re.M)
    first, other = (layout(LayoutInput.of(room(), each)) for each in (None, fewer))
    worst = [1000.0 * each.figures.routes[0].intact.position for each in (first, other)]
    assert f"2-sigma {worst[0]:.1f} -> {worst[1]:.1f} mm" in told
    assert f"{first.ambiguous_area:.1f} -> {other.ambiguous_area:.1f} m2" in told
    assert re.search(r"better on 0\.0 % of the floor, worse on [1-9]", told)


def test_of_another_project_only_the_reflectors_count(commission: Command, hall: Path, tmp_path: Path) -> None:
    save_project(replace(room(), routes=()), tmp_path / "other")
    code, told, _ = commission("layouts", hall, tmp_path / "other")
    assert code == 0
    assert "Reflectors           4 -> 4" in told
    assert "There and back" in told
    assert "better on 0.0 % of the floor, worse on 0.0 %" in told


def test_a_layout_that_is_not_there_is_told_in_one_line(commission: Command, hall: Path, tmp_path: Path) -> None:
    code, _, err = commission("layouts", hall, tmp_path / "nothing.csv")
    assert code == 2
    assert err.count("\n") == 1
    assert "nothing.csv" in err
