"""Priors are found again to the last bit, wherever the cursor asks for them, and are not kept."""

from __future__ import annotations

import numpy as np

from commission.localization.growing_run import GrowingRun
from commission.localization.priors import KEPT, PriorRows, ReplayedPriors
from commission.localization.whole_run import run

from .drives import Plan, random_drive
from .test_whole_run import setup_of


def test_priors_of_a_whole_run_are_those_of_the_live_one_in_any_order() -> None:
    rng = np.random.default_rng(12)
    setup = setup_of(rng, scanners=2)
    drive = random_drive(setup, rng, Plan(scans=30, clutter=2.0))
    live = GrowingRun(setup, drive.initial)
    for record in drive.log.records():
        live.feed(record)
    live.flush()
    kept, replayed = live.columns().priors, run(drive.log, setup, drive.initial).priors
    for cycle in rng.permutation(len(live)).tolist():
        for one, other in zip(kept.at(cycle), replayed.at(cycle), strict=True):
            assert one.tobytes() == other.tobytes(), cycle
    for one, other in zip(kept.rows(), replayed.rows(), strict=True):
        assert one.tobytes() == other.tobytes()


def test_a_cursor_replays_between_two_checkpoints_once_while_it_is_near_them() -> None:
    asked: list[tuple[int, int]] = []

    def replay(first: int, last: int) -> PriorRows:
        asked.append((first, last))
        means = np.arange(first, last)[:, np.newaxis] * np.ones(3)
        return PriorRows(means, np.zeros((last - first, 3, 3)))

    ends = range(0, 10 * KEPT, 10)
    cycles = (0, 3, 9, 12, 19, 10 * KEPT, 5, *range(25, 10 * KEPT, 10), 5, 12)
    priors = ReplayedPriors((*ends, 10 * KEPT), 10 * KEPT + 3, replay)
    assert [priors.at(cycle)[0][0] for cycle in cycles] == list(cycles)
    stretches = [(0, 10), (10, 20), (10 * KEPT, 10 * KEPT + 3), *((first, first + 10) for first in ends[2:])]
    # Of one more than are kept, the one used longest ago is replayed again when it is asked for.
    assert asked == [*stretches, (10, 20)]
