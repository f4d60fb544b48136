"""Monte-Carlo: each drive is that of simulate and localize, in any number of threads; faults by their rates; cancel."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from commission.errors import JobCancelled, UsageError
from commission.simulation.drive import DriveOptions
from commission.simulation.random_faults import FaultRates, draw_faults
from commission.simulation.scenario import start_of, virtual_drive
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.studies.monte_carlo import monte_carlo
from commission.studies.monte_carlo_figures import (
    ERROR_EDGES,
    QUANTILES,
    Detecting,
    MonteCarloInput,
    floor_notes,
    quantiles_of,
)
from commission.studies.monte_carlo_words import told
from commission.studies.run import RunInput, judged_run, summary
from commission.studies.start import Start, StartOrigin, belief_at
from commission.studies.workers import Threads
from tests.simulation.halls import hall

PROJECT = hall()
RATES = FaultRates(covered=60.0, false=1.0, moved=0.2, missing=0.1, dirt=0.5, slip=3.0, kidnapping=30.0)


def inputs(runs: int, rates: FaultRates = RATES, detecting: Detecting = Detecting.AUTO) -> MonteCarloInput:
    return MonteCarloInput(
        project=PROJECT, routes=("Out and back",), runs=runs, seed=4, rates=rates, detecting=detecting
    )


def test_the_same_seed_gives_the_same_result_in_any_number_of_threads() -> None:
    one, three = (monte_carlo(inputs(7), workers=Threads(count)) for count in (1, 3))
    assert [each.number for each in one.drives] == list(range(7))
    for a, b in zip(one.drives, three.drives, strict=True):
        assert (a.seed, a.operational_fraction, a.position_rmse, a.anees) == (
            b.seed, b.operational_fraction, b.position_rmse, b.anees
        )  # fmt: skip
    assert len({each.seed for each in one.drives}) == 7
    assert told(one) == told(three)
    assert np.array_equal(one.counts.errors, three.counts.errors)
    assert np.array_equal(one.counts.errors_operational, three.counts.errors_operational)
    diagram, other = one.stanford, three.stanford
    assert diagram is not None and other is not None
    assert np.array_equal(diagram.counts, other.counts)
    assert diagram.regions.total == diagram.counts.sum() == one.counts.errors.sum()
    # The last scan of a drive may lie behind its last true pose.
    assert 0 <= one.column("cycles").sum() - diagram.regions.total <= len(one.drives)
    assert diagram.verdicts.hazardous == one.column("hazardous").sum()


def test_a_drive_by_beams_is_what_simulate_and_localize_make_of_its_seed() -> None:
    found = monte_carlo(inputs(1, FaultRates.none(), Detecting.BEAMS)).drives[0]
    log = virtual_drive(PROJECT, "Out and back", found.seed, options=DriveOptions(whole_scans=True))
    start = start_of(PROJECT, "Out and back")
    run = RunInput.of(PROJECT, log, Start(belief_at(0, start.pose, tuple(start.sigmas.tolist())), StartOrigin.DRIVE))
    alone = summary(judged_run(run))
    assert found.position_rmse == alone["position_rmse_m"]
    assert found.anees == alone["anees"]
    assert found.operational_fraction == alone["operational_fraction"]
    assert (found.moved, found.missing, found.dirty, found.false, found.covered, found.carried) == (0,) * 6


def test_each_fault_has_its_rate_and_switching_one_off_leaves_the_others() -> None:
    drawn = [draw_faults(PROJECT, RATES, seed, 60.0) for seed in range(400)]
    reflectors = 400 * len(PROJECT.reflectors)
    for counted, share in ((sum(len(each.missing) for each in drawn), 0.1), (sum(len(d.dirt) for d in drawn), 0.5)):
        assert counted == pytest.approx(share * reflectors, abs=4.5 * np.sqrt(share * (1 - share) * reflectors))
    moved = sum(len(each.moved) for each in drawn)
    assert moved == pytest.approx(0.18 * reflectors, abs=4.5 * np.sqrt(0.18 * 0.82 * reflectors))
    for name in ("covered", "shiny_objects"):
        counted = sum(len(getattr(each.project.disturbances, name)) for each in drawn)
        assert counted == pytest.approx(400.0, abs=4.5 * 20.0), name
    for seed in range(20):
        without = draw_faults(PROJECT, replace(RATES, dirt=0.0, covered=0.0), seed, 60.0)
        assert without.missing == drawn[seed].missing
        assert without.project.reflectors == drawn[seed].project.reflectors
        assert without.project.disturbances.shiny_objects == drawn[seed].project.disturbances.shiny_objects
        assert not without.dirt
        assert not without.project.disturbances.covered


def test_constants_are_drawn_as_the_project_knows_them() -> None:
    constants = draw_faults(PROJECT, RATES, 1, 60.0).project.disturbances.constants
    known = PROJECT.uncertainty
    assert constants.survey_sigma == known.survey
    assert constants.mounting_sigma == (known.mounting_position, known.mounting_position, known.mounting_heading)
    assert (constants.range_bias_sigma, constants.clock_offset_sigma) == (known.range_bias, known.clock)
    without = draw_faults(PROJECT, replace(RATES, constants=False), 1, 60.0)
    assert without.project.disturbances.constants == PROJECT.disturbances.constants
    # What else the project says of its constants acts in both.
    said = replace(PROJECT.disturbances.constants, forward_scale_sigma=0.02)
    site = replace(PROJECT, disturbances=replace(PROJECT.disturbances, constants=said))
    for rates in (RATES, replace(RATES, constants=False)):
        assert draw_faults(site, rates, 1, 60.0).project.disturbances.constants.forward_scale_sigma == 0.02


def test_constants_that_are_less_known_than_a_drive_can_draw_are_refused() -> None:
    vague = replace(PROJECT, uncertainty=replace(PROJECT.uncertainty, survey=0.3))
    with pytest.raises(UsageError, match=r"uncertainty holds 0\.3"):
        draw_faults(vague, RATES, 1, 60.0)
    draw_faults(vague, replace(RATES, constants=False), 1, 60.0)


def test_a_vehicle_of_two_scanners_drives_without_beams() -> None:
    first = PROJECT.scanners[0]
    rear = replace(first, name="rear", mounting=(-0.2, 0.0, 3.1416))
    posts = replace(PROJECT.reflectors.reflectors[0], id="shiny 1")
    named = ReflectorMap((posts, *PROJECT.reflectors.reflectors[1:]))
    site = replace(PROJECT, scanners=(first, rear), reflectors=named)
    given = MonteCarloInput(
        project=site, routes=("Out and back",), runs=2, seed=4, rates=RATES, detecting=Detecting.SHADOWS
    )
    found = monte_carlo(given, workers=Threads(1))
    assert len(found.drives) == 2
    assert all(np.isfinite(each.position_rmse) for each in found.drives)
    assert found.counts.errors.sum() > 0


def test_quantiles_are_no_smaller_than_those_of_the_errors_and_at_most_a_bin_larger() -> None:
    errors = np.random.default_rng(2).exponential(0.02, 5000)
    counts, _ = np.histogram(errors, ERROR_EDGES)
    exact = np.quantile(errors, QUANTILES, method="inverted_cdf")
    found = quantiles_of(counts)
    assert (found >= exact).all()
    assert (found <= 1.012 * exact).all()
    assert np.isnan(quantiles_of(np.zeros_like(counts))).all()


def test_a_study_that_is_cancelled_begins_no_further_drive() -> None:
    calls: list[str] = []

    def progress(_fraction: float, message: str, /) -> None:
        calls.append(message)
        if message.startswith("2 of"):
            raise JobCancelled

    with pytest.raises(JobCancelled):
        monte_carlo(inputs(500), progress, workers=Threads(2))
    assert calls == ["preparing", "1 of 500 drives", "2 of 500 drives"]


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"runs": 0}, "--runs is 0; expected 1 to 100000"),
        ({"seed": -1}, "--seed is -1"),
        ({"routes": ()}, "has no route"),
        ({"project": Project()}, "has no reflector"),
        (
            {"rates": replace(RATES, people=3), "detecting": Detecting.SHADOWS},
            "shadows, which show no people; expected beams or auto",
        ),
    ],
)
def test_what_cannot_be_driven_is_refused(change: dict[str, Any], problem: str) -> None:
    with pytest.raises(UsageError, match=problem):
        replace(inputs(2), **change)


@pytest.mark.parametrize(("name", "value"), [("moved", 1.01), ("slip", -0.1), ("covered", float("nan"))])
def test_a_rate_out_of_range_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"--{name} is {value:g}; expected a"):
        replace(FaultRates(), **{name: value})
    assert getattr(replace(FaultRates(), **{name: 1.0}), name) == 1.0


def test_where_no_floor_can_be_walked_on_it_says_what_does_not_occur() -> None:
    floor = PROJECT.floor_map
    assert floor is not None
    assert floor_notes(PROJECT, FaultRates(people=2)) == ()
    walls = replace(PROJECT, floor_map=replace(floor, cells=np.full_like(floor.cells, 100)))
    (note,) = floor_notes(walls, FaultRates(people=2))
    assert note.startswith("the floor map has no free floor that is wide enough to walk on")
    assert note.endswith("people and false things do not occur")
    (note,) = floor_notes(replace(PROJECT, floor_map=None), FaultRates(people=0))
    assert note.startswith("there is no floor map: false things are on an open field")
    assert floor_notes(walls, FaultRates.none()) == ()
    found = monte_carlo(replace(inputs(1, FaultRates(people=0, glints=0.0)), project=walls))
    assert any("false things do not occur" in line for line in told(found))
