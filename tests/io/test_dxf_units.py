"""Units of drawings: what they state, what their size suggests, and what is doubted."""

from __future__ import annotations

from pathlib import Path

import ezdxf
import pytest
from ezdxf import units

from commission.io.dxf import read_drawing
from commission.io.dxf_units import UNITS, doubts, judged_unit, stated_unit


def hall(folder: Path, width: float, code: int) -> Path:
    document = ezdxf.new("R2010", units=code)
    document.modelspace().add_lwpolyline([(0, 0), (width, 0), (width, 0.5 * width), (0, 0.5 * width)], close=True)
    document.saveas(folder / "hall.dxf")
    return folder / "hall.dxf"


METRES = {code: 1.0 / units.METER_FACTOR[code] for code in (*range(1, 8), *range(10, 20))}
"""ezdxf's own table (units per metre), where it has one that agrees with the definitions."""
METRES |= {8: 2.54e-8, 9: 2.54e-5, 20: 3.0857e16, 21: 0.3048006096, 22: 0.0254000508, 23: 0.9144018288, 24: 1609.347219}
"""By definition: the survey foot is 1200/3937 m (Mendenhall order of 1893)."""


@pytest.mark.parametrize(("code", "metres"), METRES.items())
def test_every_stated_unit_has_its_length(code: int, metres: float) -> None:
    stated = stated_unit(code)
    assert stated is not None
    assert stated[1] == pytest.approx(metres, rel=1e-4)


@pytest.mark.parametrize("code", [0, 25, 99, -1])
def test_code_that_names_no_unit_names_none(code: int) -> None:
    assert stated_unit(code) is None


def test_survey_feet_are_not_the_international_ones_and_no_doubt_is_said(tmp_path: Path) -> None:
    read = read_drawing(hall(tmp_path, 1_000_000.0 / 1000, 21))
    assert read.unit == "us-ft"
    # 1000 survey feet are 0.6 mm longer than 1000 feet of 0.3048 m.
    assert read.segments.max() == pytest.approx(304.8006096, abs=1e-7)
    assert read.warnings == ()


def test_hall_in_inches_that_nobody_chose_is_doubted_with_the_units_that_make_it_a_hall(tmp_path: Path) -> None:
    (warning,) = read_drawing(hall(tmp_path, 20.0, 1)).warnings
    assert "unit is in" in warning
    assert "0.508 x 0.254 m" in warning
    assert "m (20 x 10 m)" in warning
    assert "--unit" in warning


def test_chosen_unit_is_not_doubted(tmp_path: Path) -> None:
    assert read_drawing(hall(tmp_path, 20.0, 1), unit="in").warnings == ()


@pytest.mark.parametrize(
    ("width", "unit"), [(20.0, "m"), (999.0, "m"), (1001.0, "cm"), (2000.0, "cm"), (5000.0, "mm"), (20_000.0, "mm")]
)
def test_drawing_without_a_unit_is_in_the_one_that_makes_it_a_hall(width: float, unit: str) -> None:
    assert judged_unit((width, 0.5 * width)) == unit


def test_what_was_judged_is_said_with_its_size_and_what_else_it_could_be(tmp_path: Path) -> None:
    read = read_drawing(hall(tmp_path, 8000.0, 0))
    assert read.unit == "mm"
    (warning,) = read.warnings
    assert "names no unit" in warning
    assert "8 x 4 m" in warning
    assert "cm (80 x 40 m)" in warning


@pytest.mark.parametrize(("width", "doubted"), [(2.9, True), (3.1, False), (2999.0, False), (3001.0, True)])
def test_stated_unit_is_doubted_where_no_plant_has_that_size(width: float, doubted: bool) -> None:
    assert bool(doubts((width, 1.0), "m", UNITS["m"], is_stated=True)) is doubted


def test_empty_drawing_is_not_doubted() -> None:
    assert doubts((0.0, 0.0), "m", 1.0, is_stated=True) == ""
