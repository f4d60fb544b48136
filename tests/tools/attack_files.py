"""Attack what a project keeps on disk: programs that are killed while somebody edits, and damaged journals.

For maintainers, some minutes: `python -m tests.tools.attack_files --kills 300 --storms 50 --damages 5000`. It fails at
the first edit that is lost though it is older than a second, is restored otherwise than it was made, or was intact in a
damaged journal, and at the first damaged journal that is not kept. The test command does a few of each.
"""

from __future__ import annotations

import random
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import tyro

from tests.app.project.killed_page import Toll, kill_pages
from tests.io.damaged_journals import check_restored, damaged, written

EDITS = 30
"""Edits in a journal that is damaged."""


@dataclass(frozen=True, kw_only=True)
class Attack:
    """Kill programs and damage journals."""

    kills: int = 300
    """Programs that are killed while somebody edits at human pace."""
    storms: int = 50
    """Programs that are killed in a storm of edits and saves."""
    damages: int = 5000
    """Journals that are damaged."""
    at_once: int = 10
    """Programs at human pace that run at the same time: they wait most of the time."""
    seed: int = 1
    """Seed of every random choice."""

    def run(self) -> bool:
        """Do all of it; return whether nothing was lost."""
        with tempfile.TemporaryDirectory() as folder:
            tolls = (
                self._timed(
                    "human pace", lambda: kill_many(Path(folder) / "pace", self.kills, self.at_once, self.seed)
                ),
                self._timed("storm", lambda: kill_pages(Path(folder) / "storm", self.storms, self.seed, storm=True)),
            )
            self._timed("damages", lambda: damage_many(Path(folder) / "damages", self.damages, self.seed))
        return all(age < 1.0 for toll in tolls for age in toll.lost_ages)

    def _timed(self, name, attack):
        began = time.monotonic()
        outcome = attack()
        sys.stdout.write(f"{name:12} {outcome} ({time.monotonic() - began:.0f} s)\n")
        sys.stdout.flush()
        return outcome


def kill_many(folder: Path, kills: int, at_once: int, seed: int) -> Toll:
    """Kill programs at human pace, several projects at a time."""
    shares = [len(range(first, kills, at_once)) for first in range(min(at_once, kills))]
    toll = Toll()
    with ThreadPoolExecutor(max(len(shares), 1)) as pool:
        for each in pool.map(
            lambda item: kill_pages(folder / str(item[0]), item[1], 1000 * seed + item[0], storm=False),
            enumerate(shares),
        ):
            toll.add(each)
    return toll


def damage_many(folder: Path, damages: int, seed: int) -> str:
    """Damage a journal in many ways; return what that came to."""
    journal, rng = written(folder, EDITS), random.Random(seed)
    intact = told = 0
    for _ in range(damages):
        restored = check_restored(folder, journal, damaged(journal.content, rng))
        intact += restored.edits if restored else 0
        told += bool(restored and restored.damage)
    return f"{damages} damaged journals of {EDITS} edits: {intact} intact edits, all restored; {told} files kept"


if __name__ == "__main__":
    sys.exit(0 if tyro.cli(Attack).run() else 1)
