"""Figures of contours, counted by hand."""

# pyright: basic

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from commission.localization.contour import COLUMNS, COST, LEARNED_DEPTH, MATCHED, NIS, POINTS, ROWS, USE, ContourUse
from commission.studies.contour_figures import contour_figures, contour_findings


def columns_of(*rows) -> Any:
    figures = np.zeros((len(rows), COLUMNS))
    for row, (use, points, matched, cost, nis, count) in zip(figures, rows, strict=True):
        row[[USE, POINTS, MATCHED, COST, NIS, ROWS]] = use, points, matched, cost, nis, count
    return SimpleNamespace(contours=figures)


def test_figures_are_those_counted_by_hand():
    columns = columns_of(
        *(
            (ContourUse.NONE, 5, 0, 0.0, 0.0, 0),
            (ContourUse.ACCEPTED, 100, 80, 0.1, 2.0, 3),
            (ContourUse.ACCEPTED, 100, 60, 0.2, 3.0, 2),
            (ContourUse.REJECTED, 100, 70, 0.3, 99.0, 3),
            (ContourUse.UNMATCHED, 100, 10, 0.8, 0.0, 0),
            (ContourUse.CONTRADICTED, 100, 55, 0.35, 0.0, 0),
        )
    )
    columns.contours[1:3, LEARNED_DEPTH] = 0.01, 0.02
    found = contour_figures(columns)
    assert found == {
        "contour_accepted": 2,
        "contour_rejected": 1,
        "contour_unmatched": 1,
        "contour_contradicted": 1,
        "contour_matched_fraction": pytest.approx(0.55),
        "contour_cost_mean": pytest.approx(0.35),
        "contour_nis_per_row_mean": pytest.approx(1.0),
        "contour_depth": 0.02,
    }


def test_a_run_without_contours_has_no_figures_of_them():
    assert contour_figures(columns_of()) == {}


def test_a_run_that_never_looked_has_counts_and_no_means():
    found = contour_figures(columns_of((ContourUse.NONE, 5, 0, 0.0, 0.0, 0)))
    assert found["contour_accepted"] == 0
    assert found["contour_matched_fraction"] is None
    assert found["contour_nis_per_row_mean"] is None
    assert found["contour_depth"] is None


@pytest.mark.parametrize(
    ("enabled", "uses", "floor", "said"),
    [
        (True, (), None, "no floor map"),
        (True, (ContourUse.NONE, ContourUse.NONE), "a floor", "no whole scans"),
        (True, (ContourUse.NONE, ContourUse.UNMATCHED), "a floor", None),
        (False, (), None, None),
    ],
)
def test_contours_that_are_asked_for_and_never_matched_are_told(enabled, uses, floor, said):
    columns = columns_of(*((use, 5, 0, 0.0, 0.0, 0) for use in uses))
    parameters = SimpleNamespace(contour=SimpleNamespace(enabled=enabled))
    setup = SimpleNamespace(parameters=parameters, floor=floor, zones=())
    columns.segments = (SimpleNamespace(setup=setup),)
    found = contour_findings(columns)
    assert len(found) == (said is not None)
    assert said is None or said in str(found[0])
    if said == "no whole scans":
        setup.zones = ("Hall",)
        assert "zones leave contours out wherever the drive went" in str(contour_findings(columns)[0])
