"""Prediction against reality: predicted 1-sigma and trips against seeded virtual drives, metre by metre.

    python tests/benchmarks/bench_prediction.py [DRIVES]

Prints, for each bundled site without people: the ratio of predicted sigma to RMS error of the position and the heading
(median over metres, share of metres between 0.8 and 1.25), the share of metres on which predicted and actual fail modes
agree, and how much faster the prediction is than one virtual drive with its localization.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np

from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.localization.estimate import Mode
from commission.planning.route_prediction import PredictionOptions, plan_route, predict_route
from commission.simulation.scenario import start_of
from commission.site.disturbances import Disturbances
from tests.planning.test_route_prediction import drives_along, predicted_squares

SITES = (("laboratory", 0), ("shop_floor", 1), ("warehouse", 0))


def compare(site: str, route_index: int, drives: int) -> None:
    project = replace(load_project(bundled_folder("maps") / site), disturbances=Disturbances())
    route = project.routes[route_index].name
    x, y, theta = (float(sigma) for sigma in start_of(project, route).sigmas)
    planned = plan_route(project, route, PredictionOptions(start_sigmas=(x, y, theta)))
    predict_route(planned)
    began = time.perf_counter()
    prediction = predict_route(planned)
    predicting = time.perf_counter() - began
    began = time.perf_counter()
    squares, stopped = drives_along(project, route, range(drives), planned)
    driving = (time.perf_counter() - began) / drives
    variances = predicted_squares(planned, prediction)
    metre = np.minimum(planned.drive.metres, planned.drive.length - 1e-6).astype(int)
    fails = np.maximum.reduceat(prediction.modes == Mode.FAIL, np.unique(metre, return_index=True)[1])
    print(f"{site}, {route!r}: {len(squares)} m, {drives} drives, prediction {driving / predicting:.0f} times faster")
    for name, axes in (("position", [0, 1]), ("heading", [2])):
        ratio = np.sqrt(variances[:, axes].sum(axis=1) / squares[:, axes].sum(axis=1))
        inside = np.mean((ratio > 0.8) & (ratio < 1.25))
        print(f"  {name}: sigma / RMS median {np.median(ratio):.3f}, {100 * inside:.0f} % of metres in 0.8 .. 1.25")
    print(f"  fail mode agrees on {100 * np.mean(fails == (stopped > 0.5)):.1f} % of metres")


if __name__ == "__main__":
    for each, index in SITES:
        compare(each, index, int(sys.argv[1]) if len(sys.argv) > 1 else 200)
