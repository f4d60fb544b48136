"""Priors are found again to the last bit, wherever the cursor asks for them, and are not kept."""

from __future__ import annotations

import numpy as np

from commission.localization.growing_run import GrowingRun
from commission.localization.priors import PriorRows, ReplayedPriors
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


def test_a_cursor_that_moves_on_between_two_checkpoints_replays_once() -> None:
    asked: list[tuple[int, int]] = []

    def replay(first: int, last: int) -> PriorRows:
        asked.append((first, last))
        means = np.arange(first, last)[:, np.newaxis] * np.ones(3)
        return PriorRows(means, np.zeros((last - first, 3, 3)))

    priors = ReplayedPriors((0, 7, 10), 12, replay)
    assert [priors.at(cycle)[0][0] for cycle in (0, 3, 6, 7, 9, 10, 11, 6)] == [0, 3, 6, 7, 9, 10, 11, 6]
    assert asked == [(0, 7), (7, 10), (10, 12), (0, 7)]
