"""Prints the README's two tables of Sobreira et al. 2016, section 5: `python -m tests.benchmarks.paper_tables`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from commission.io.project_file import load_project
from commission.simulation.scenario import virtual_drive
from tests.acceptance.judged import Judged, judge, seen_within, with_filters
from tests.planning.driven import EXACT

MAPS = Path(__file__).resolve().parents[2] / "maps"
DRIVES = 20


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def precision() -> None:
    """Print position errors in the laboratory, 360 and 180 degrees."""
    project = replace(load_project(MAPS / "laboratory"), uncertainty=EXACT)
    route = project.routes[0].name
    logs = [virtual_drive(project, route, seed) for seed in range(DRIVES)]
    full = [judge(project, route, log) for log in logs]
    half = [judge(project, route, seen_within(log, 90.0)) for log in logs]
    print("| field of view | cycles | position RMS | heading RMS | at most | ANEES |\n|---|---|---|---|---|---|")
    _row("360°", full, [np.ones(len(d.distances), bool) for d in full])
    _row("180°", half, [np.ones(len(d.distances), bool) for d in half])
    _row("180°, 2 reflectors or more", half, [d.inliers >= 2 for d in half])
    _row("180°, fewer than 2", half, [d.inliers < 2 for d in half])


def _row(name: str, drives: list[Judged], chosen: list[np.ndarray]) -> None:
    distances = np.concatenate([d.distances[c] for d, c in zip(drives, chosen, strict=True)])
    headings = np.concatenate([d.errors[c, 2] for d, c in zip(drives, chosen, strict=True)])
    whole = all(c.all() for c in chosen)
    anees = f"{np.mean([d.statistics.anees for d in drives]):.2f}" if whole else ""
    print(
        f"| {name} | {len(distances):,} | {1e3 * rms(distances):.1f} mm | {np.degrees(rms(headings)):.2f}° "
        f"| {1e3 * distances.max():.0f} mm | {anees} |"
    )


def robustness() -> None:
    """Print errors and jumps on the shop floor under the three settings of Fig. 13."""
    project = replace(load_project(MAPS / "shop_floor"), uncertainty=EXACT)
    settings = {"none": (False, False), "detector filter": (True, False), "both filters": (True, True)}
    judged: dict[str, list[Judged]] = {name: [] for name in settings}
    for seed in range(DRIVES):
        log = virtual_drive(project, "P0-P1-P2", seed)
        for name, filters in settings.items():
            judged[name].append(judge(with_filters(project, *filters), "P0-P1-P2", log))
    print("\n| filters | position RMS | largest jump, mean of the drives | largest jump of all |\n|---|---|---|---|")
    for name, drives in judged.items():
        jumps = np.array([d.statistics.largest_jump for d in drives])
        distances = np.concatenate([d.distances for d in drives])
        print(f"| {name} | {1e3 * rms(distances):.1f} mm | {1e3 * jumps.mean():.0f} mm | {1e3 * jumps.max():.0f} mm |")


if __name__ == "__main__":
    precision()
    robustness()
