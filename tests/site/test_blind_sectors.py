"""Blind sectors lie in the field of view, apart from each other, and are mirrored with the scanner."""

from __future__ import annotations

import math

import numpy as np
import pytest

from commission.site.presets import SCANNERS, with_preset
from commission.site.scanner import Scanner


@pytest.mark.parametrize(
    ("sectors", "message"),
    [
        (((10.0, 5.0),), r"holds \[10, 5\]; expected first < last"),
        (((10.0, 10.0),), r"holds \[10, 10\]; expected first < last"),
        (((-140.0, -120.0),), r"holds \[-140, -120\]; expected sectors inside of the field of view, -135 to 135 deg"),
        (((120.0, 136.0),), "expected sectors inside of the field of view"),
        (((40.0, 60.0), (10.0, 41.0)), r"holds \[10, 41\] and \[40, 60\]; expected sectors that do not overlap"),
    ],
)
def test_sectors_that_cannot_be_are_refused(sectors, message):
    with pytest.raises(ValueError, match=message):
        Scanner(blind_sectors_deg=sectors)


def test_sectors_may_touch_each_other_and_the_ends_of_the_field_of_view():
    scanner = Scanner(blind_sectors_deg=((60.0, 135.0), (-135.0, -100.0), (-100.0, -90.0)))
    np.testing.assert_allclose(np.degrees(scanner.views), [[-90.0, 60.0]])


@pytest.mark.parametrize("upside_down", [False, True])
def test_what_is_left_of_the_field_of_view_is_mirrored_with_the_scanner(upside_down):
    scanner = Scanner(
        field_of_view_deg=(-100.0, 120.0), blind_sectors_deg=((20.0, 30.0), (-50.0, -40.0)), upside_down=upside_down
    )
    upright = [[-120.0, -30.0], [-20.0, 40.0], [50.0, 100.0]]
    expected = upright if upside_down else [[-100.0, -50.0], [-40.0, 20.0], [30.0, 120.0]]
    np.testing.assert_allclose(np.degrees(scanner.views), expected)
    firsts = sorted(np.degrees(scanner.blind_sectors)[:, 0].tolist())
    assert firsts == pytest.approx([-30.0, 40.0] if upside_down else [-50.0, 20.0], abs=1e-6)
    assert scanner.reported_blind_sectors[0].tolist() == pytest.approx([math.radians(20.0), math.radians(10.0)])


def test_without_any_the_field_of_view_is_one_view():
    scanner = Scanner()
    assert scanner.views.tolist() == [list(scanner.field_of_view)]
    assert scanner.blind_sectors.shape == (0, 2)


def test_a_preset_keeps_of_the_sectors_what_lies_in_its_field_of_view():
    wide = Scanner(
        field_of_view_deg=(-180.0, 180.0), blind_sectors_deg=((-180.0, -150.0), (-20.0, 10.0), (80.0, 180.0))
    )
    for preset in SCANNERS:
        first, last = preset.scanner.field_of_view_deg
        kept = with_preset(wide, preset.name).blind_sectors_deg
        assert (-20.0, 10.0) in kept
        assert all(first <= low < high <= last for low, high in kept)
