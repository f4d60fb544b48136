"""Clusters of real intensities: a car among poles, a scanner of half a degree, 586 scans with 914 lit runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from commission.io.project_file import load_project
from commission.io.recordings.base import load_log
from commission.localization.detection_log import DetectionLog, detect_log
from commission.localization.estimate import Status
from commission.localization.setup import LocalizerSetup


def detected(folder: Path, model: str) -> DetectionLog:
    project, log = load_project(folder), load_log(folder / "recording")
    detector = replace(project.parameters.detector, expected_beams=model)
    parameters = replace(project.parameters, detector=detector)
    return detect_log(
        log.scans[0], LocalizerSetup(reflectors=project.reflectors, scanners=project.scanners, parameters=parameters)
    )


def split_bodies(found: DetectionLog) -> int:
    """Neighbors within a scan that are nearer to each other than any two of the poles."""
    scan = np.repeat(np.arange(len(found)), np.diff(found.offsets))
    distance, bearing = found.range_bearing.T
    x, y = distance * np.cos(bearing), distance * np.sin(bearing)
    return int(np.count_nonzero((np.diff(scan) == 0) & (np.hypot(np.diff(x), np.diff(y)) < 0.3)))


def test_poles_that_are_dark_inside_are_one_cluster_each(shared_data: Path) -> None:
    printed, bridged = (detected(shared_data / "car_park", model) for model in ("equation_3", "beam_width"))
    assert (len(printed.beams), split_bodies(printed)) == (914, 21)
    assert (len(bridged.beams), split_bodies(bridged)) == (893, 0)
    passed = [int(np.count_nonzero(each.status == Status.INLIER)) for each in (printed, bridged)]
    assert passed == [809, 836]
