"""The command `tune`: compare, diagnose, calibrate and export, without a page."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from commission.cli.parsing import initial_pose
from commission.cli.terminal import shown_progress

if TYPE_CHECKING:
    from commission.io.tune_files import TuneResult


@dataclass(frozen=True, kw_only=True)
class Tune:
    """Diagnose a site by a recording, calibrate, compare the proposed values with the project's, and export them."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml); it stays as it is."""
    recording: Positional[Path]
    """Recording: a CSV folder, a ROS bag or a capture, as in `localize`."""
    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for parameters.yaml, ros_parameters.yaml, parameters.csv (for a controller), comparison.csv,
    reflectors.csv, residuals.html (plots) and summary.json; made when it does not exist."""
    initial_pose: Annotated[str | None, arg(metavar="X,Y,THETA[,SX,SY,STHETA]")] = None
    """Pose of base at the first record and its 1-sigma, map frame [m, m, rad]. None: as in `localize`."""
    set: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="GROUP.KEY=VALUE")] = ()
    """A parameter of the localizer in place of the project's, in SI units and radians."""
    channel: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="KIND=TOPIC")] = ()
    """ROS bag with several candidates: the topic of scan, odometry or reference, as in `localize`."""
    wheels: Annotated[str | None, arg(metavar="LEFT,RIGHT,RADIUS,SEPARATION[,TICKS]")] = None
    """ROS bag whose odometry is a JointState: names of the two driven wheels, their radius and distance [m]."""
    force: bool = False
    """Whether files in DIR that this command did not write are overwritten; its own earlier results always are."""

    def run(self) -> None:
        """Diagnose, calibrate, compare, write, and tell what is wrong and what is proposed."""
        given = None if self.initial_pose is None else initial_pose(self.initial_pose)

        from commission.io.fingerprint import Fingerprint, recording_digest
        from commission.io.overwriting import result_folder
        from commission.io.project_file import apply_settings, load_project
        from commission.io.recordings.base import load_log
        from commission.io.recordings.channels import ChannelOptions
        from commission.io.tune_files import FILES, FITTED, TuneResult, write_tuned
        from commission.progress import part
        from commission.studies.calibration import CalibrationInput, accepted, calibrate
        from commission.studies.diagnosis import diagnosis, diagnosis_input
        from commission.studies.residual_study import ResidualInput, residual_study
        from commission.studies.run import RunInput, judged_run
        from commission.studies.start import start_of
        from commission.studies.variants import VariantsInput, variants

        sources = (self.recording, self.project)
        out = result_folder(self.out, "tune", FILES, force=self.force, sources=sources)
        project_digest, digest = Fingerprint.of(self.project).digest, recording_digest(self.recording)
        project = load_project(self.project)
        project = dataclasses.replace(project, parameters=apply_settings(project.parameters, self.set))
        log = load_log(self.recording, ChannelOptions.parse(self.channel, self.wheels))
        start = start_of(project, log, given and given.pose, given and given.sigmas)
        found = calibrate(CalibrationInput.of(project, log, start), part(shown_progress, 0.0, 0.7))
        tuned = accepted(project, found.proposed)
        runs = tuple(
            judged_run(RunInput.of(each, log, start), part(shown_progress, begin, begin + 0.1))
            for each, begin in ((project, 0.7), (tuned, 0.8))
        )
        result = TuneResult(
            project=tuned,
            project_digest=project_digest,
            recording_digest=digest,
            variant="calibrated",
            calibration=found,
            diagnosis=diagnosis(diagnosis_input(project, found, project.floor_map, part(shown_progress, 0.9, 1.0))),
            residuals=residual_study(ResidualInput(run=runs[0], floor_map=project.floor_map)),
            compared=variants(VariantsInput(names=("project", "calibrated"), runs=runs)),
        )
        with out.writing() as folder:
            write_tuned(folder, result)
        sys.stdout.write("\n".join([*_told(result), f"Note         {FITTED}", f"Written to   {self.out}"]) + "\n")


def _told(result: TuneResult) -> list[str]:
    """What is wrong, what is proposed, and how the figures differ, a line each."""
    from commission.studies.residual_words import residual_lines

    lines = [f"Found        {line}" for line in result.diagnosis.lines] or ["Found        nothing that is wrong"]
    lines += [f"Residuals    {line}" for line in residual_lines(result.residuals)]
    for value in result.calibration.proposed:
        before, after, sigma = (value.shown.text(each, ".4g") for each in (value.before, value.proposed, value.sigma))
        lines.append(f"Proposed     {value.key}: {before} -> {after} ± {sigma}")
    for each in result.compared.figures:
        before, after = map(each.figure.text, each.values)
        lines.append(f"Compared     {each.figure.label}: {before} -> {after} ({each.verdicts[-1].value})")
    return lines
