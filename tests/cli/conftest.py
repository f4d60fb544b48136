"""A small site and a small recording, written by hand: what a user's first folders look like."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from commission import cli

REFLECTORS = ((2.0, 3.0), (6.0, -3.0), (9.0, 3.5), (12.0, -2.5), (15.0, 3.0))
MOUNTING = 0.2
SPEED = 0.5
ODOMETRY_PERIOD = 0.05
CYCLES = 60

PROJECT = f"""\
schema: 1
name: Small hall
reflectors: reflectors.csv
vehicle: {{kind: differential, wheel_separation: 0.4}}
scanner:
  mounting: [{MOUNTING}, 0.0, 0.0]
  field_of_view_deg: [-180.0, 180.0]
  rate: 5.0
routes:
  - name: Straight
    speed: 0.5
    segments:
      - {{direction: forward, degree: 1, control_points: [[0, 0], [6, 0]]}}
parameters:
  association: {{gate_probability: 0.99}}
"""


@pytest.fixture
def project(tmp_path) -> Path:
    """Folder of a project: an open field with five reflectors and a straight route of 6 m."""
    folder = tmp_path / "hall"
    folder.mkdir()
    (folder / "project.yaml").write_text(PROJECT, encoding="utf-8")
    rows = [f"R{index},{x},{y},0.04" for index, (x, y) in enumerate(REFLECTORS)]
    (folder / "reflectors.csv").write_text("\n".join(["id,x,y,radius", *rows]) + "\n", encoding="utf-8")
    return folder


@pytest.fixture
def recording(tmp_path) -> Path:
    """Folder of a recording: twelve seconds along that route, the sensor's own detections at 5 Hz."""
    folder = tmp_path / "drive"
    folder.mkdir()
    rng = np.random.default_rng(7)
    odometry, detections, reference = ["stamp_ns,dx,dy,dtheta"], ["stamp_ns,range,bearing"], ["stamp_ns,x,y,theta"]
    for step in range(4 * CYCLES + 1):
        stamp = round(step * ODOMETRY_PERIOD * 1e9)
        moved = SPEED * ODOMETRY_PERIOD if step else 0.0
        odometry.append(f"{stamp},{moved + rng.normal(0.0, 1e-3) * (step > 0)},0,0")
        if step % 4 == 0:
            x = step * ODOMETRY_PERIOD * SPEED
            reference.append(f"{stamp},{x},0,0")
            for reflector_x, reflector_y in REFLECTORS:
                dx, dy = reflector_x - x - MOUNTING, reflector_y
                distance = math.hypot(dx, dy) + rng.normal(0.0, 0.02)
                detections.append(f"{stamp},{distance},{math.atan2(dy, dx) + rng.normal(0.0, 0.004)}")
    for name, lines in (("odometry", odometry), ("detections", detections), ("reference", reference)):
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


@pytest.fixture
def commission(capsys):
    """Run a command line in this process: (exit code, stdout, stderr)."""

    def run(*words) -> tuple[object, str, str]:
        with pytest.raises(SystemExit) as finished:
            cli.main([str(word) for word in words])
        shown = capsys.readouterr()
        return finished.value.code, shown.out, shown.err

    return run


@pytest.fixture
def refused(commission):
    """Run a command line that must be refused; returns its one line."""

    def run(*words) -> str:
        code, _, err = commission(*words)
        lines = err.splitlines()
        assert code == 2, (code, err)
        assert len(lines) == 1, lines
        assert lines[0].startswith("commission: ")
        assert not lines[0].startswith("commission: unexpected"), lines[0]
        return lines[0]

    return run
