"""The command `inspect`: what a recording holds, and whether it can be what it says."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

if TYPE_CHECKING:
    from commission.site.project import Project
    from commission.site.record_log import RecordLog


@dataclass(frozen=True, kw_only=True)
class Inspect:
    """Tell what a recording holds: records, rates, pauses, time span, ranges of values, and what looks wrong."""

    recording: Annotated[Positional[Path], arg(metavar="REC")]
    """Recording: a CSV folder (odometry.csv with detections.csv or scans.npz), a ROS bag (.mcap, .db3, .bag)
    or a capture (.pcap, .pcapng)."""
    project: Annotated[Path | None, arg(metavar="PROJECT")] = None
    """Project whose scanner and threshold the recording is held against. None: those of a new project."""

    shiny: bool = False
    """Localize the recording by the project, and list what is as bright as a reflector and none of its map: where, how
    often, intensity against threshold. `monitor` says what of it is a reflector that was moved or added."""
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
        bright = self._shiny(given, log) if self.shiny else []
        notes = [f"Note         {finding}" for finding in (*log.notes, *found)]
        sys.stdout.write("\n".join([*lines, *true, *bright, *notes]) + "\n")
        if self.strict and found:
            raise SourceError(f"{self.recording}: {len(found)} things look wrong; the first: {found[0]}")

    @staticmethod
    def _shiny(project: Project | None, log: RecordLog) -> list[str]:
        """Return a line for each shiny thing; raises UsageError without a project."""
        from commission.errors import UsageError
        from commission.localization.setup import LocalizerSetup
        from commission.studies.run import RunInput, judged_run
        from commission.studies.shiny import ShinyInput, shiny_things
        from commission.studies.start import start_of

        if project is None:
            raise UsageError("--shiny needs a map to know what is a reflector; expected --project PROJECT")
        columns = judged_run(RunInput.of(project, log, start_of(project, log))).columns
        found = shiny_things(ShinyInput(log=log, columns=columns, setup=LocalizerSetup.of(project)))
        return [f"Shiny        {each.text}" for each in found] or ["Shiny        nothing but reflectors of the map"]
