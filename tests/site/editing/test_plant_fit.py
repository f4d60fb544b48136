"""Many surveyed points against a move that is known, by another way of solving, and by points that no move explains."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from commission.app.base.actions import ClickFloor
from commission.app.base.state import AppState
from commission.app.editing.actions import ChooseTool
from commission.app.editing.editor import editor_of
from commission.app.floor_map.actions import AlignMap, SetPlantPoint, SetSurveyed
from commission.app.floor_map.align_tool import AlignTool
from commission.app.floor_map.tool_fields import alignment_text
from commission.cli.align import Align
from commission.errors import CommissionError, UsageError
from commission.io.plant_points import surveyed_points
from commission.io.project_file import load_project, save_project
from commission.site.editing.plant_check import check_points, worst_of
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


def test_sigma_of_a_residual_and_of_what_the_others_miss_a_point_by_is_how_much_they_scatter() -> None:
    rng, sigma, count = np.random.default_rng(3), 0.004, 400
    residuals, missed, told, told_without = (np.empty((count, len(PLACES), *rest)) for rest in ((2,), (), (), ()))
    for trial in range(count):
        noise = rng.normal(0.0, sigma, (len(PLACES), 2))
        given = [
            replace(each, plant=(each.plant[0] + dx, each.plant[1] + dy))
            for each, (dx, dy) in zip(pairs(), noise.tolist(), strict=True)
        ]
        for index, each in enumerate(check_points(fit_points(given))):
            residuals[trial, index], missed[trial, index] = each.residual, each.left_out
            told[trial, index], told_without[trial, index] = each.sigma, each.left_out_sigma
    # Squares average without bias: 1-sigma of a mean of 2 * 400 squares is 5 %, of those told less.
    real = np.mean(residuals**2, axis=(0, 2))
    assert np.mean(told**2, axis=0) == pytest.approx(real, rel=0.2)
    assert np.mean(told_without**2, axis=0) == pytest.approx(0.5 * np.mean(missed**2, axis=0), rel=0.2)
    # The point in the middle has the most freedom, those at the corners the least.
    assert int(np.argmax(real)) == 4
    assert np.mean(told**2, axis=0)[4] == pytest.approx(0.8 * sigma**2, rel=0.1)


def test_the_worst_point_is_the_one_that_is_wrong_and_the_others_say_by_how_much() -> None:
    given = pairs(noise=0.002)
    x, y = given[2].plant
    given[2] = replace(given[2], plant=(x + 0.06, y - 0.08))
    checks = check_points(fit_points(given))
    worst = worst_of(checks)
    assert worst is checks[2]
    assert worst.left_out == pytest.approx(0.1, abs=0.01)
    assert worst.off < 0.08, "a wrong point draws the fit to it"
    assert [each.pair.name for each in checks] == [each.name for each in given]
    assert math.isnan(check_points(fit_points(given[:2]))[0].left_out)
    # Of three points, one wrong by 0.1 m, each contradicts the other two.
    three = check_points(fit_points(given[1:4]))
    assert all(each.left_out > 0.03 for each in three)
    assert worst_of(three) is None


def test_corners_that_are_no_reflectors_align_the_site_and_each_is_held_against_the_others() -> None:
    project = room()
    state = joined(AppState(project=project, saved=project))
    corners = ((1.0, 6.0), (9.0, 6.5), (5.0, 1.0), (2.0, 4.0))
    clicked = after(state, ChooseTool(AlignTool()), *(ClickFloor(place, 0.01) for place in corners)).state
    places = [point.at for point in editor_of(clicked, ME).tool.known]  # type: ignore[union-attr]
    plants = [in_plant(*place) for place in places]
    wrong = (plants[2][0] + 0.05, plants[2][1])
    named = after(
        clicked,
        SetPlantPoint(0, plants[0], "column B4"),
        SetPlantPoint(1, plants[1]),
        # The third and the fourth by a table, one of them by its letter's name.
        SetPlantPoint(2, places[2], "gate"),
        SetPlantPoint(3, places[3], "D4"),
        SetSurveyed(f"gate\t{wrong[0]:.4f}\t{wrong[1]:.4f}\nd4\t{plants[3][0]:.4f}\t{plants[3][1]:.4f}\nX\t0\t0"),
    )
    assert any("nothing is called X" in effect.text for effect in named.effects)  # type: ignore[attr-defined]
    tool = editor_of(named.state, ME).tool
    assert isinstance(tool, AlignTool)
    text = alignment_text(tool)
    assert "<b>gate</b> (worst)" in text
    assert text.count("(worst)") == 1
    assert [each in text for each in ("column B4", "<td>B</td>", "d4")] == [True] * 3
    right = after(named.state, SetSurveyed(f"gate\t{plants[2][0]:.4f}\t{plants[2][1]:.4f}")).state
    assert "Not counted: D4, of which x, y in the plant are missing." in alignment_text(
        editor_of(right, ME).tool  # type: ignore[arg-type]
    )
    moved = after(right, AlignMap()).state
    assert len(moved.undo) == 1
    for before, now in zip(project.reflectors.reflectors, moved.project.reflectors.reflectors, strict=True):
        assert (now.x, now.y) == pytest.approx(in_plant(before.x, before.y), abs=1e-3)


def test_the_command_takes_points_that_are_no_reflectors_and_says_what_each_is_off_by(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_project(room(), tmp_path / "site")
    here = {"gate": (5.0, 1.0), "B4": (1.0, 6.0), "C7": (9.0, 6.5)}
    for name, rows in (("map", here), ("plant", {name: in_plant(*place) for name, place in here.items()})):
        lines = [f"{each},{x:.4f},{y:.4f}" for each, (x, y) in rows.items()]
        (tmp_path / f"{name}.csv").write_text("\n".join(["name,x,y", *lines]), encoding="utf-8")
    command = Align(
        project=tmp_path / "site", points=tmp_path / "plant.csv", on_map=tmp_path / "map.csv", out=tmp_path / "out"
    )
    command.run()
    said = capsys.readouterr().out
    assert "turned by 31.00" in said
    assert said.count("Off ") == 3
    assert "gate: " in said
    assert "the others miss it by 0." in said
    reflector, now = (load_project(tmp_path / each).reflectors.reflectors[0] for each in ("site", "out"))
    assert (now.x, now.y) == pytest.approx(in_plant(reflector.x, reflector.y), abs=1e-3)


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
