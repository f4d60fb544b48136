"""Converts "Lost in the woods" (`dataset2.mat` of T. Barfoot, AER1513) into a project and a CSV-folder recording.

Run `python -m tests.tools.lost_in_the_woods DATASET2_MAT FOLDER`: makes FOLDER/project and FOLDER/recording. The file
knows the tube of each measurement; the recording does not.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from commission.geometry import se2
from commission.io.project_file import save_project
from commission.io.recordings.csv_writer import write_recording
from commission.site.project import Project
from commission.site.records import Detections, Odometry, Record, ReferencePose
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.site.vehicle import DifferentialVehicle

TUBE_RADIUS = 0.055
"""Not in the file; it matters to pictures only, because ranges there are to the tubes' centers [m]."""


def project(data: dict[str, np.ndarray]) -> Project:
    """The robot, its laser, and the tubes without names that mean anything."""
    tubes = tuple(
        Reflector(id=f"T{i:02d}", x=float(x), y=float(y), radius=TUBE_RADIUS)
        for i, (x, y) in enumerate(data["l"], start=1)
    )
    return Project(
        name="Lost in the woods",
        reflectors=ReflectorMap(tubes),
        vehicle=DifferentialVehicle(0.4, ((0.35, 0.25), (-0.25, 0.25), (-0.25, -0.25), (0.35, -0.25))),
        scanners=(
            Scanner(
                mounting=np.array([data["d"].item(), 0.0, 0.0]),
                # The bearings in the file reach from -119.3 to 120.1 deg, its ranges to 5.64 m.
                field_of_view_deg=(-121.0, 121.0),
                resolution_deg=0.5,
                rate=10.0,
                range=(0.05, 6.0),
                range_sigma=0.03,
                reflector_range=5.7,
            ),
        ),
    )


def records(data: dict[str, np.ndarray]) -> Iterator[Record]:
    """Steps of 0.1 s: motion, the pose that motion capture saw, and the tubes in no particular order."""
    stamps = np.round(data["t"].ravel() * 1e9).astype(np.int64).tolist()
    # Velocities are those of the interval that ends at their stamp, along the vehicle's x axis.
    twists = np.column_stack([data["v"].ravel(), np.zeros(len(stamps)), data["om"].ravel()])
    steps = np.diff(data["t"].ravel(), prepend=data["t"].ravel()[0])
    displacements = se2.exp(twists * steps[:, None])
    truth = np.column_stack([data[name].ravel() for name in ("x_true", "y_true", "th_true")])
    valid = data["true_valid"].ravel() > 0
    for step, stamp in enumerate(stamps):
        yield Odometry(stamp, displacements[step])
        if valid[step]:
            yield ReferencePose(stamp, truth[step])
        seen = data["r"][step] > 0.0
        detections = np.column_stack([data["r"][step][seen], data["b"][step][seen]])
        yield Detections(stamp, detections[np.argsort(detections[:, 1])])


def convert(mat_file: Path, folder: Path) -> tuple[Path, Path]:
    """Write project and recording; returns their folders."""
    data = loadmat(mat_file)
    save_project(project(data), folder / "project")
    write_recording(folder / "recording", records(data))
    return folder / "project", folder / "recording"


if __name__ == "__main__":
    convert(Path(sys.argv[1]), Path(sys.argv[2]))
