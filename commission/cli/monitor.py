"""The command `monitor`: which reflectors have changed since the survey, by one recording or by many."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from commission.cli.parsing import recording_names
from commission.errors import UsageError

if TYPE_CHECKING:
    from commission.site.reflectors import ReflectorMap
    from commission.studies.map_findings import MapFinding
    from commission.studies.monitor import Monitor

HEADER = ("fault", "id", "x_before", "y_before", "x", "y", "sigma", "since", "seen", "expected", "text")


@dataclass(frozen=True, kw_only=True)
class MonitorCommand:
    """Compare the reflector map with drives: reflectors that were moved, are missing or dirty, and new ones."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml); it stays as it is."""
    recordings: Positional[tuple[Path, ...]]
    """Recordings, the oldest first: CSV folders, ROS bags or captures, as in `localize`. The newest one in which a
    reflector comes in sight decides."""
    out: Annotated[Path | None, arg(metavar="FILE")] = None
    """CSV file for what is found [m]: fault, id, place before and now, since when, how often seen."""
    corrected_project: Annotated[Path | None, arg(metavar="PROJECT2")] = None
    """Folder for the project with the map corrected: moved reflectors at their new places, missing ones gone."""
    add_new: bool = False
    """Whether PROJECT2 also has what is seen where no reflector is mapped; that may be a shiny column."""
    set: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="GROUP.KEY=VALUE")] = ()
    """A parameter of the localizer in place of the project's, in SI units and radians."""
    force: bool = False
    """Whether FILE, or another project in PROJECT2, is overwritten."""

    def run(self) -> None:
        """Diagnose each drive, and tell a line for each finding."""
        if not self.recordings:
            raise UsageError("no recording is named; expected one or more, the oldest first")

        from commission.io.atomic import write_text
        from commission.io.overwriting import refuse_files
        from commission.io.project_copy import refuse_to_replace, save_copy
        from commission.io.project_file import apply_settings, load_project
        from commission.io.recordings.base import load_log
        from commission.studies.map_correction import corrected
        from commission.studies.monitor import MonitorInput, diagnosed_drive, monitor
        from commission.studies.start import start_of

        if self.out is not None:
            refuse_files(self.out, force=self.force)
        if self.corrected_project is not None:
            if self.corrected_project.resolve() == self.project.resolve():
                raise UsageError(f"--corrected-project is the project itself, {self.project}; expected another folder")
            refuse_to_replace(self.corrected_project, force=self.force)
        as_saved = load_project(self.project)
        project = dataclasses.replace(as_saved, parameters=apply_settings(as_saved.parameters, self.set))
        # One drive after the other: recordings of hours are not held all at once.
        diagnoses = []
        for path in self.recordings:
            log = load_log(path)
            try:
                diagnoses.append(diagnosed_drive(project, log, start_of(project, log)))
            except UsageError as error:
                raise UsageError(f"{path}: {error}") from None
        found = monitor(MonitorInput(names=recording_names(self.recordings), diagnoses=tuple(diagnoses)))
        written: list[str] = []
        if self.out is not None:
            write_text(self.out, table_of(found))
            written.append(f"Written to   {self.out}")
        if self.corrected_project is not None:
            reflectors = corrected(as_saved.reflectors, found.findings, add_new=self.add_new)
            save_copy(dataclasses.replace(as_saved, reflectors=reflectors), self.corrected_project, force=self.force)
            written.append(f"Corrected    {self.corrected_project}")
            written += _left(found, as_saved.reflectors, add_new=self.add_new)
        sys.stdout.write("\n".join([*_told(found), *written]) + "\n")


def _told(found: Monitor) -> list[str]:
    """What was found, a line each, and what nothing is known of."""
    lines = [f"Found        {each.text}" for each in found.findings]
    lines = lines or ["Found        nothing: every reflector that comes in sight is where the map has it"]
    if found.unseen:
        lines.append(f"Not told     {', '.join(found.unseen)}: hardly in sight on any of these drives")
    return lines


def _left(found: Monitor, reflectors: ReflectorMap, *, add_new: bool) -> list[str]:
    """What was found and is not corrected in the map, a line each with the reason."""
    from commission.studies.map_correction import why_not
    from commission.studies.map_findings import MapFault

    lines: list[str] = []
    for each in found.findings:
        is_left = each.fault is MapFault.NEW and not add_new
        reason = "new ones are not added: --add-new does" if is_left else why_not(reflectors, each)
        if reason:
            lines.append(f"As it was    {each.id}: {reason}")
    return lines


def table_of(found: Monitor) -> str:
    """Return the findings as CSV, metres; a place that there is none of is empty."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(HEADER)
    rows.writerows(map(_row, found.findings))
    return text.getvalue()


def _row(finding: MapFinding) -> list[str]:
    """One finding; counts are those of the newest drive that tells of it."""
    newest = finding.evidence[-1]
    before, after = (
        ("", "") if each is None else tuple(f"{v:.4f}" for v in each) for each in (finding.before, finding.after)
    )
    sigma = f"{finding.sigma:.4f}" if math.isfinite(finding.sigma) else ""
    counts = str(newest.seen), str(newest.expected)
    return [finding.fault.value, finding.id, *before, *after, sigma, finding.since, *counts, finding.text]
