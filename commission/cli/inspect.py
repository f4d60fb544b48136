"""The command `inspect`: what a recording holds, and whether it can be what it says."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg


@dataclass(frozen=True, kw_only=True)
class Inspect:
    """Tell what a recording holds: records, rates, pauses, time span, ranges of values, and what looks wrong."""

    recording: Annotated[Positional[Path], arg(metavar="REC")]
    """Recording: a CSV folder (odometry.csv with detections.csv or scans.npz)."""
    project: Annotated[Path | None, arg(metavar="PROJECT")] = None
    """Project whose scanner and threshold the recording is held against. None: those of a new project."""

    def run(self) -> None:
        """Read, judge and tell."""
        from commission.io.project_file import load_project
        from commission.io.recordings.base import load_log
        from commission.site.project import Project
        from commission.site.truth import truth_lines
        from commission.studies.plausibility import PlausibilityInput, plausibility
        from commission.studies.recording_overview import channels

        log = load_log(self.recording)
        project = Project() if self.project is None else load_project(self.project)
        lines = [f"{channel.name.capitalize():12} {channel.text}" for channel in channels(log)]
        true = [] if log.truth is None else [f"True         {line}" for line in truth_lines(log.truth)]
        notes = [f"Note         {finding}" for finding in plausibility(PlausibilityInput.of(project, log))]
        sys.stdout.write("\n".join([*lines, *true, *notes]) + "\n")
