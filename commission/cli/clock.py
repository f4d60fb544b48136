"""The command `clock`: what each scanner's clock shows more than the vehicle's, by the motion of one drive."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from commission.cli.parsing import initial_pose

if TYPE_CHECKING:
    from commission.site.project import Project
    from commission.studies.clock import ClockOffset


@dataclass(frozen=True, kw_only=True)
class Clock:
    """Estimate the offset between the clocks of scanners and vehicle from a recording, or say what it lacks for it."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    recording: Positional[Path]
    """Recording: a CSV folder, a ROS bag or a capture, as in `localize`; its reference is not read."""
    initial_pose: Annotated[str | None, arg(metavar="X,Y,THETA[,SX,SY,STHETA]")] = None
    """Pose of base at the first record and its 1-sigma, map frame [m, m, rad]. None: as in `localize`."""
    channel: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="KIND=TOPIC")] = ()
    """ROS bag with several candidates: the topic of scan, odometry or reference, as in `localize`."""
    wheels: Annotated[str | None, arg(metavar="LEFT,RIGHT,RADIUS,SEPARATION[,TICKS]")] = None
    """ROS bag whose odometry is a JointState: names of the two driven wheels, their radius and distance [m]."""

    def run(self) -> None:
        """Estimate, and tell each scanner on a line."""
        given = None if self.initial_pose is None else initial_pose(self.initial_pose)

        from commission.io.project_file import load_project
        from commission.io.recordings.base import load_log
        from commission.io.recordings.channels import ChannelOptions
        from commission.studies.calibration_values import CalibrationInput
        from commission.studies.clock import clock_offsets
        from commission.studies.start import start_of

        project = load_project(self.project)
        log = load_log(self.recording, ChannelOptions.parse(self.channel, self.wheels))
        start = start_of(project, log, given and given.pose, given and given.sigmas)
        found = clock_offsets(CalibrationInput.of(project, log, start))
        sys.stdout.writelines(f"{_line(each, project)}\n" for each in found)


def _line(each: ClockOffset, project: Project) -> str:
    """One scanner for a person: what the drive says, how surely, and what it comes to."""
    from commission.site.quantity import MILLIMETRES, MILLISECONDS
    from commission.studies.clock import ClockVerdict, displacement

    before = f"{each.scanner}: {MILLISECONDS.text(each.before, '+.1f')} in the project"
    if each.verdict is ClockVerdict.NOT_SHOWN:
        return f"{before}, {each.verdict}: {each.reason}"
    speed = max((route.speed for route in project.routes), default=1.0)
    left = MILLIMETRES.text(displacement(each.offset - each.before, speed), ".1f")
    said = f"{MILLISECONDS.number(each.offset, '+.1f')} ± {MILLISECONDS.text(each.sigma, '.1f')} (1-sigma)"
    reason = f": {each.reason}" if each.reason else ""
    return f"{before}, {said} by motion, {each.verdict}; the difference is {left} at {speed:.2f} m/s{reason}"
