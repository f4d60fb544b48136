"""The command `inspect`: what a recording holds, and whether it can be what it says."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg


@dataclass(frozen=True, kw_only=True)
class Inspect:
    """Tell what a recording holds: records, rates, pauses, time span, ranges of values, and what looks wrong."""

    recording: Annotated[Positional[Path], arg(metavar="REC")]
    """Recording: a CSV folder (odometry.csv with detections.csv or scans.npz), a ROS bag (.mcap, .db3, .bag)
    or a capture (.pcap, .pcapng)."""
    project: Annotated[Path | None, arg(metavar="PROJECT")] = None
    """Project whose scanner and threshold the recording is held against. None: those of a new project."""

    strict: bool = False
    """End with an error where something looks wrong."""
    channel: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="KIND=TOPIC")] = ()
    """ROS bag with several candidates: the topic of scan (or scan.NAME, for each of several scanners), odometry or
    reference; the topic none: of no topic. Repeat it for several."""
    wheels: Annotated[str | None, arg(metavar="LEFT,RIGHT,RADIUS,SEPARATION[,TICKS]")] = None
    """ROS bag whose odometry is a JointState: names of the two driven wheels, their radius and distance [m], and counts
    for one turn where they are no radians."""

    def run(self) -> None:
        """Read, judge and tell."""
        from commission.errors import SourceError
        from commission.io.project_file import load_project
        from commission.io.recordings.base import load_log
        from commission.io.recordings.channels import ChannelOptions
        from commission.site.truth import truth_lines
        from commission.studies.plausibility import PlausibilityInput, plausibility
        from commission.studies.recording_overview import channels

        log = load_log(self.recording, ChannelOptions.parse(self.channel, self.wheels))
        lines = [f"{channel.name.capitalize():12} {channel.text}" for channel in channels(log)]
        true = [] if log.truth is None else [f"True         {line}" for line in truth_lines(log.truth)]
        given = None if self.project is None else load_project(self.project)
        found = plausibility(PlausibilityInput.alone(log) if given is None else PlausibilityInput.of(given, log))
        notes = [f"Note         {finding}" for finding in (*log.notes, *found)]
        sys.stdout.write("\n".join([*lines, *true, *notes]) + "\n")
        if self.strict and found:
            raise SourceError(f"{self.recording}: {len(found)} things look wrong; the first: {found[0]}")
