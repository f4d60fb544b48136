"""Many surveyed points against a move that is known, by another way of solving, and by points that no move explains."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from commission.app.base.state import AppState
from commission.app.editing.actions import ChooseTool
from commission.app.editing.editor import editor_of
from commission.app.floor_map.actions import AlignMap, SetSurveyed
from commission.app.floor_map.align_tool import AlignTool
from commission.app.floor_map.tool_fields import alignment_text
from commission.errors import CommissionError, UsageError
from commission.io.plant_points import surveyed_points
from commission.site.editing.plant_fit import PlantPair, fit_points, pairs_of
from tests.app.asking import ME, after, joined
from tests.app.sites import room

PLACES = ((0.0, 0.0), (30.0, 1.0), (28.0, 17.0), (2.0, 16.0), (15.0, 9.0))
MOVE = (1000.5, -250.25, math.radians(31.0))


def in_plant(x: float, y: float) -> tuple[float, float]:
    c, s = math.cos(MOVE[2]), math.sin(MOVE[2])
    return MOVE[0] + c * x - s * y, MOVE[1] + s * x + c * y


def pairs(noise: float = 0.0, seed: int = 1) -> list[PlantPair]:
    rng = np.random.default_rng(seed)
    found = []
    for index, place in enumerate(PLACES):
        dx, dy = rng.normal(0.0, 1.0, 2) * noise
        x, y = in_plant(*place)
        found.append(PlantPair(f"P{index}", place, (x + dx, y + dy)))
    return found


def test_exact_points_say_the_move_and_are_missed_by_nothing() -> None:
    fit = fit_points(pairs())
    assert fit.T_plant_map == pytest.approx(MOVE, abs=1e-9)
    assert fit.offs == pytest.approx(np.zeros(5), abs=1e-9)
    assert fit.scale == pytest.approx(1.0)
    assert fit.striking == ()


def test_the_fit_is_that_of_a_general_solver() -> None:
    given = pairs(noise=0.01)

    def missed(move: np.ndarray) -> np.ndarray:
        c, s = math.cos(move[2]), math.sin(move[2])
        return np.array(
            [
                (
                    each.plant[0] - move[0] - c * each.at[0] + s * each.at[1],
                    each.plant[1] - move[1] - s * each.at[0] - c * each.at[1],
                )
                for each in given
            ]
        ).ravel()

    plain = least_squares(missed, np.array(MOVE), xtol=1e-14, ftol=1e-14, gtol=1e-14, x_scale=(1.0, 1.0, 0.01))
    fit = fit_points(given)
    assert fit.T_plant_map == pytest.approx(plain.x, abs=1e-6)
    assert fit.rms == pytest.approx(math.sqrt(2.0 * np.mean(plain.fun**2)), abs=1e-7)


def test_a_point_that_is_wrong_by_itself_stands_out() -> None:
    given = pairs(noise=0.003)
    x, y = given[2].plant
    given[2] = replace(given[2], plant=(x + 0.1, y))
    assert fit_points(given).striking == ("P2",)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda each: replace(each, plant=each.plant[::-1]), "mirror image"),
        (lambda each: replace(each, plant=(1000.0 * each.plant[0], 1000.0 * each.plant[1])), "a wrong unit"),
        (lambda each: replace(each, at=(1.0, 1.0)), "expected them 0.1 m apart"),
    ],
)
def test_points_that_no_move_explains_are_refused(change, why: str) -> None:
    with pytest.raises(UsageError, match=why):
        fit_points([change(each) for each in pairs()])
    with pytest.raises(UsageError, match="expected 2 or more"):
        fit_points(pairs()[:1])


def table(extra: str = "") -> str:
    rows = [
        f"{each.id.lower()}\t{x:.4f}\t{y:.4f}"
        for each in room().reflectors.reflectors
        for x, y in [in_plant(each.x, each.y)]
    ]
    return "\n".join(rows) + extra


def test_a_pasted_survey_moves_everything_in_one_undo_step_and_tells_what_is_left() -> None:
    project = room()
    state = joined(AppState(project=project, saved=project))
    outcome = after(state, ChooseTool(AlignTool()), SetSurveyed(table("\nX9\t1.0\t2.0")))
    assert any("X9" in effect.text for effect in outcome.effects)  # type: ignore[attr-defined]
    tool = editor_of(outcome.state, ME).tool
    assert isinstance(tool, AlignTool)
    text = alignment_text(tool)
    assert "RMS" in text
    assert "31.000" in text
    moved = after(outcome.state, AlignMap()).state
    assert len(moved.undo) == 1
    for before, now in zip(project.reflectors.reflectors, moved.project.reflectors.reflectors, strict=True):
        assert (now.x, now.y) == pytest.approx(in_plant(before.x, before.y), abs=2e-4)
    start = project.routes[0].segments[0].control_points[0].tolist()
    assert moved.project.routes[0].segments[0].control_points[0].tolist() == pytest.approx(in_plant(*start), abs=2e-4)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("1.0\t2.0\n3.0\t4.0", "names no points"),
        ("R1\tabc\t2", "first row"),
        ("R1\t1\t2\nR1\t3\t4", "R1"),
        ("Q1\t1\t2\nQ2\t3\t4", "0 points are known"),
    ],
)
def test_a_table_that_says_nothing_is_refused(text: str, why: str) -> None:
    with pytest.raises(CommissionError, match=why):
        fit_points(pairs_of(room(), surveyed_points(text))[0])
