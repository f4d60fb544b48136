"""Reflectors that do not stand to each other as the map says are named, and a map that is right is left alone.

The drive is by formulas alone; how far a reflector is moved in the map is the whole oracle.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from commission.localization.setup import LocalizerSetup
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import ReflectorMap
from commission.site.uncertainty import Uncertainty
from commission.studies.displaced import misplaced_findings
from commission.studies.map_shape import MapShape, map_shape
from commission.studies.plausibility import Finding
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.run_findings import run_findings
from commission.studies.start import Start, StartOrigin
from tests.studies.recorded import PROJECT, drive, start

WORDS = "do not stand to each other as the map says"


def with_moved(project: Project, moves: dict[str, tuple[float, float]]) -> Project:
    """The project whose map has reflectors elsewhere than the drive."""
    moved = (
        replace(each, x=each.x + dx, y=each.y + dy)
        for each in project.reflectors.reflectors
        for dx, dy in [moves.get(each.id, (0.0, 0.0))]
    )
    return replace(project, reflectors=ReflectorMap(tuple(moved)))


def localized(project: Project, log: RecordLog) -> RunResult:
    return judged_run(RunInput.of(project, log, Start(start(), StartOrigin.DRIVE)))


def shape_of(project: Project, log: RecordLog) -> MapShape:
    return map_shape(localized(project, log).columns, LocalizerSetup.of(project))


def findings_of(project: Project, log: RecordLog) -> tuple[Finding, ...]:
    return misplaced_findings(localized(project, log))


def without(project: Project, *names: str) -> Project:
    kept = (each for each in project.reflectors.reflectors if each.id not in names)
    return replace(project, reflectors=ReflectorMap(tuple(kept)))


@pytest.mark.parametrize("seed", range(8))
def test_a_right_map_is_left_alone(seed: int) -> None:
    assert findings_of(PROJECT, drive(seed=seed)) == ()


@pytest.mark.parametrize(
    "mistake",
    [{"bias": 0.05}, {"bias": -0.04}, {"late_s": 0.14}, {"turned": 0.03}],
    ids=["too long", "too short", "late", "turned"],
)
def test_what_is_wrong_with_the_scanner_is_not_laid_on_the_map(mistake: dict[str, float]) -> None:
    assert findings_of(PROJECT, drive(**mistake)) == ()


@pytest.mark.parametrize("scale", [0.985, 1.015])
def test_ranges_that_grow_too_fast_are_not_laid_on_the_map(scale: float) -> None:
    log = drive()
    seen = np.array(log.range_bearing)
    seen[:, 0] *= scale
    assert findings_of(PROJECT, replace(log, range_bearing=seen)) == ()


@pytest.mark.parametrize(
    ("name", "move"), [("R2", (0.0, 0.06)), ("R4", (-0.1, 0.0)), ("R0", (0.12, 0.16)), ("R6", (0.05, -0.05))]
)
def test_one_moved_reflector_is_named_and_where_it_stands(name: str, move: tuple[float, float]) -> None:
    moved = with_moved(PROJECT, {name: move})
    shape = shape_of(moved, drive())
    names = [each.id for each in moved.reflectors.reflectors]
    assert [names[index] for index in shape.wrong] == [name]
    # It stands where it stood: back from where the map has moved it. Others may each be 5.8 mm off, as the map says.
    assert shape.off[shape.wrong[0]] == pytest.approx(-np.array(move), abs=0.012)
    (finding,) = findings_of(moved, drive())
    assert finding.found.startswith(f"1 of 7 reflectors {WORDS}, by 599 scans that see several of them: {name} by ")
    assert "survey them again" in finding.remedy


def test_less_than_what_one_hides_of_a_reflector_is_not_named() -> None:
    assert findings_of(with_moved(PROJECT, {"R3": (0.015, 0.0)}), drive()) == ()


@pytest.mark.parametrize("seed", range(6))
def test_of_few_reflectors_each_a_hand_off_the_map_is_called_wrong(seed: int) -> None:
    few = without(PROJECT, "R4", "R6") if seed % 2 else without(PROJECT, "R1", "R3", "R4")
    turns = np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, 7)
    moves = {f"R{index}": (0.08 * math.cos(turn), 0.08 * math.sin(turn)) for index, turn in enumerate(turns)}
    # Sixty scans, as a drive of a few metres has them; not one of the moves is known to be common to all.
    (finding,) = findings_of(with_moved(few, moves), drive(30.0, seed=seed))
    assert WORDS in finding.found


def test_where_most_are_wrong_it_is_said_of_the_map_and_how_well_it_is_known() -> None:
    moves = np.random.default_rng(3).normal(0.0, 0.06, (7, 2))
    wrong = with_moved(PROJECT, {f"R{index}": tuple(move) for index, move in enumerate(moves.tolist())})
    shape = shape_of(wrong, drive())
    # Nobody can see a shift or a turn of all: both are taken off what was moved, by complex numbers.
    centers = wrong.reflectors.centers @ (1.0, 1j)
    centers, off = centers - centers.mean(), -moves @ (1.0, 1j)
    off = off - off.mean()
    off -= 1j * centers * np.imag(np.vdot(centers, off)) / np.vdot(centers, centers).real
    assert shape.off @ (1.0, 1j) == pytest.approx(off, abs=0.03)
    (finding,) = findings_of(wrong, drive())
    assert "the map is wrong as a whole" in finding.probably
    sigma = float(finding.remedy.split("uncertainty.survey to ")[1].removesuffix(" m"))
    assert sigma == pytest.approx(math.sqrt(0.5 * np.mean(np.abs(off) ** 2)), rel=0.1)
    assert findings_of(replace(wrong, uncertainty=known_to(sigma)), drive()) == ()


def known_to(survey: float) -> Uncertainty:
    return replace(PROJECT.uncertainty, survey=survey)


def test_a_map_that_makes_the_vehicle_lost_is_named_all_the_same() -> None:
    moves = {"R1": (0.08, 0.0), "R3": (-0.05, 0.07), "R5": (0.0, -0.08), "R0": (0.07, -0.05)}
    exact = replace(without(PROJECT, "R2", "R4", "R6"), uncertainty=known_to(0.001))
    result = localized(with_moved(exact, moves), drive())
    assert result.lost_fraction > 0.5
    assert map_shape(result.columns, LocalizerSetup.of(with_moved(exact, moves))).wrong == ()
    assert any(WORDS in each.found for each in run_findings(result))


def test_nothing_is_said_of_a_single_reflector_nor_of_a_drive_at_rest() -> None:
    lonely = without(PROJECT, *(f"R{index}" for index in range(6)))
    assert shape_of(lonely, drive()).judged == ()
    log = drive(30.0)
    still = replace(log, displacements=np.zeros_like(log.displacements))
    first = np.tile(log.range_bearing[: len(PROJECT.reflectors)], (len(log.detection_stamps_ns), 1))
    assert shape_of(PROJECT, replace(still, range_bearing=first)).judged == ()


@pytest.mark.parametrize("seed", range(6))
def test_errors_that_last_for_a_while_are_not_laid_on_the_map(seed: int) -> None:
    """What one view after the other errs by averages out over views, however many scans each of them has."""
    log, rng = drive(14.0, seed=seed), np.random.default_rng(seed)
    scans, count = len(log.detection_stamps_ns), len(PROJECT.reflectors)
    lasting = np.repeat(rng.normal(0.0, (0.05, 0.006), (1 + scans // 15, count, 2)), 15, axis=0)[:scans]
    noisy = replace(PROJECT.parameters.observation, range_sigma=0.05, bearing_sigma=0.006)
    project = replace(PROJECT, parameters=replace(PROJECT.parameters, observation=noisy))
    assert findings_of(project, replace(log, range_bearing=log.range_bearing + lasting.reshape(-1, 2))) == ()


@pytest.mark.parametrize("sigmas", [(1e-300, 1e-300), (1e9, 1e9)], ids=["exact", "nothing is known"])
@pytest.mark.parametrize("off", [0.0, 1e9], ids=["where it is", "nowhere"])
def test_numbers_at_the_edge_of_sense_say_nothing_of_the_map(sigmas: tuple[float, float], off: float) -> None:
    observation = replace(PROJECT.parameters.observation, range_sigma=sigmas[0], bearing_sigma=sigmas[1])
    project = replace(PROJECT, parameters=replace(PROJECT.parameters, observation=observation))
    elsewhere = replace(start(), mean=start().mean + np.array([off, -off, 0.0]))
    result = judged_run(RunInput.of(project, drive(10.0), Start(elsewhere, StartOrigin.DRIVE)))
    assert misplaced_findings(result) == ()


@pytest.mark.parametrize(("move", "is_told"), [((0.7, 0.0), True), ((-0.9, 1.2), True), ((2.5, 2.5), False)])
def test_a_reflector_that_is_seen_beside_its_place_alone_is_named(move: tuple[float, float], is_told: bool) -> None:
    told = findings_of(with_moved(PROJECT, {"R5": move}), drive())
    if not is_told:
        assert told == ()
        return
    (finding,) = told
    assert finding.found.startswith("R5 is seen nowhere at its place, in ")
    beside = finding.found.split("stands ")[1].split(" mm")[0]
    assert float(beside) == pytest.approx(1e3 * math.hypot(*move), abs=10.0)


def test_a_thing_beside_a_reflector_that_is_seen_is_none_that_was_moved() -> None:
    log, project = drive(), PROJECT
    more = replace(project.reflectors.reflectors[2], id="S", x=project.reflectors.reflectors[2].x + 0.8)
    assert findings_of(replace(project, reflectors=ReflectorMap((*project.reflectors.reflectors, more))), log) == ()


def test_of_hours_some_cycles_tell_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("commission.studies.map_shape.MOST_SCANS", 150)
    by_little, by_much = (with_moved(PROJECT, {"R5": move}) for move in ((0.1, 0.0), (0.7, 0.0)))
    (finding,) = findings_of(by_little, drive())
    assert finding.found.startswith(f"1 of 7 reflectors {WORDS}, by 150 scans that see several of them: R5 by ")
    (finding,) = findings_of(by_much, drive())
    assert finding.found.startswith("R5 is seen nowhere at its place, in ")
    assert findings_of(PROJECT, drive()) == ()
