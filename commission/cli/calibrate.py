"""The command `calibrate`: what the figures of scanners and wheels are, by recordings without ground truth."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from commission.cli.parsing import initial_pose, recording_names
from commission.cli.terminal import shown_progress
from commission.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from commission.site.project import Project
    from commission.studies.calibration import Calibration
    from commission.studies.calibration_drives import DrivesCalibration
    from commission.studies.calibration_values import CalibrationInput, Value


@dataclass(frozen=True, kw_only=True)
class Calibrate:
    """Estimate noise, range bias, mountings, clocks and wheels from one recording or many, and say how surely."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    recordings: Positional[tuple[Path, ...]]
    """Recordings: CSV folders, ROS bags or captures, as in `localize`; their references are not read. Each of several
    is calibrated by itself; a value that most of them propose is proposed, weighed by how sure each is."""
    out: Annotated[Path | None, arg(metavar="FILE")] = None
    """YAML file for the values: `parameters` as --set takes them, and all figures with 1-sigma and reason."""
    calibrated_project: Annotated[Path | None, arg(metavar="PROJECT2")] = None
    """Folder for the project with the proposed values; made when it does not exist."""
    initial_pose: Annotated[str | None, arg(metavar="X,Y,THETA[,SX,SY,STHETA]")] = None
    """Pose of base at the first record of each recording and its 1-sigma, map frame [m, m, rad]. None: as in
    `localize`."""
    set: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="GROUP.KEY=VALUE")] = ()
    """A parameter of the localizer in place of the project's, in SI units and radians."""
    channel: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="KIND=TOPIC")] = ()
    """ROS bag with several candidates: the topic of scan, odometry or reference, as in `localize`."""
    wheels: Annotated[str | None, arg(metavar="LEFT,RIGHT,RADIUS,SEPARATION[,TICKS]")] = None
    """ROS bag whose odometry is a JointState: names of the two driven wheels, their radius and distance [m]."""
    scheduler: Annotated[str | None, arg(metavar="ADDRESS")] = None
    """Scheduler of a Dask cluster that calibrates the recordings, as tcp://HOST:PORT (extra commission[cluster];
    workers with one thread each). None: the cores of this machine."""
    force: bool = False
    """Whether FILE, or another project in PROJECT2, is overwritten."""

    def run(self) -> None:
        """Calibrate, write, and tell each figure on a line."""
        if not self.recordings:
            raise UsageError("no recording is named; expected one or more")

        from commission.io.atomic import write_text
        from commission.io.project_copy import refuse_to_replace, save_copy
        from commission.io.project_file import apply_settings, load_project
        from commission.studies.calibration import accepted

        if self.out is not None and self.out.exists() and not self.force:
            raise UsageError(f"{self.out} exists; expected another file, or --force to overwrite")
        if self.calibrated_project is not None:
            if self.calibrated_project.resolve() == self.project.resolve():
                raise UsageError(f"--calibrated-project is the project itself, {self.project}; expected another folder")
            refuse_to_replace(self.calibrated_project, force=self.force)
        as_saved = load_project(self.project)
        project = dataclasses.replace(as_saved, parameters=apply_settings(as_saved.parameters, self.set))
        result = self._calibrated(project)
        written: list[str] = []
        if self.out is not None:
            write_text(self.out, _yaml(result))
            written.append(f"Written to   {self.out}")
        if self.calibrated_project is not None:
            save_copy(accepted(project, result.proposed), self.calibrated_project, force=self.force)
            written.append(f"Calibrated   {self.calibrated_project}")
        notes = [f"Note         {note}" for note in result.notes]
        sys.stdout.write("\n".join([*map(_line, result.values), *notes, *written]) + "\n")

    def _calibrated(self, project: Project) -> Calibration | DrivesCalibration:
        """Calibrate by one recording or by several, here or on a cluster."""
        from commission.localization import whole_run
        from commission.studies.calibration import calibrate
        from commission.studies.calibration_drives import calibrate_drives

        drives, count = self._drives(project), len(self.recordings)
        if self.scheduler is None:
            if count == 1:
                return calibrate(next(drives)[1], shown_progress)
            whole_run.warm_up()
            return calibrate_drives(drives, count, shown_progress)

        from commission.io.cluster import cluster

        with cluster(self.scheduler) as workers:
            return calibrate_drives(drives, count, shown_progress, workers=workers)

    def _drives(self, project: Project) -> Iterator[tuple[str, CalibrationInput]]:
        """Read each recording when it is its turn: those of hours are not held all at once."""
        from commission.io.recordings.base import load_log
        from commission.io.recordings.channels import ChannelOptions
        from commission.studies.calibration_values import CalibrationInput
        from commission.studies.start import start_of

        given = None if self.initial_pose is None else initial_pose(self.initial_pose)
        options = ChannelOptions.parse(self.channel, self.wheels)
        for name, path in zip(recording_names(self.recordings), self.recordings, strict=True):
            log = load_log(path, options)
            start = start_of(project, log, given and given.pose, given and given.sigmas)
            yield name, CalibrationInput.of(project, log, start)


def _line(value: Value) -> str:
    """One figure for a person: before, proposed, 1-sigma, verdict."""
    before, proposed, sigma = (value.shown.text(each, ".4g") for each in (value.before, value.proposed, value.sigma))
    stretches = ", ".join(f"{begin:.0f} to {end:.0f} s" for begin, end in value.stretches)
    reason = f" ({value.reason})" if value.reason else ""
    where = f"; most from {stretches}" if stretches else ""
    return f"{value.key}: {before} -> {proposed} ± {sigma}: {value.verdict.value}{reason}{where}"


def _yaml(result: Calibration | DrivesCalibration) -> str:
    """All figures as YAML: what is proposed by `key=value`, then the table, of several drives that of each, too."""
    from commission.studies.calibration_drives import DrivesCalibration

    proposed = [f"{value.key}={value.proposed:.6g}" for value in result.proposed]
    settings = [text for text in proposed if not text.startswith(("scanners.", "reflectors."))]
    others = [text for text in proposed if text not in settings]
    lines = ["# SI units and radians; `parameters` are what --set takes.", "parameters:"]
    lines += [f"  - {text}" for text in settings] or ["  []"]
    lines += ["site:", *([f"  - {_quoted(text)}" for text in others] or ["  []"]), "values:"]
    lines += [f"  - {_row(value)}" for value in result.values]
    lines += ["notes:", *(f"  - {_quoted(note)}" for note in result.notes)]
    if isinstance(result, DrivesCalibration):
        lines.append("drives:")
        for drive in result.inputs.drives:
            rows = [f"      - {_row(each)}" for each in drive.values] or ["      []"]
            lines += [f"  - name: {_quoted(drive.name)}", "    values:", *rows]
    return "\n".join(lines) + "\n"


def _row(value: Value) -> str:
    """One figure as a mapping of YAML."""
    from commission.studies.calibration_values import CalibrationVerdict

    return (
        f"{{key: {_quoted(value.key)}, before: {value.before:.9g}, value: {value.proposed:.9g}, "
        f"sigma: {value.sigma:.6g}, proposed: {str(value.verdict is CalibrationVerdict.PROPOSED).lower()}, "
        f"verdict: {_quoted(value.verdict.value)}, reason: {_quoted(value.reason)}, "
        f"stretches: {[[round(begin, 1), round(end, 1)] for begin, end in value.stretches]}}}"
    )


def _quoted(text: str) -> str:
    """Text as YAML takes it literally."""
    return "'" + text.replace("'", "''") + "'"
