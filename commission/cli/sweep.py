"""The command `sweep`: one or two parameters over ranges, a figure of the drive for each value."""

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
    from commission.studies.sweep import SweepInput, SweepResult


@dataclass(frozen=True, kw_only=True)
class SweepCommand:
    """Localize a recording with many values of one or two parameters; writes sweep.csv, sweep.png and summary.json."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    recording: Positional[Path]
    """Recording: a CSV folder, a ROS bag or a capture, as for `localize`."""
    over: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="GROUP.KEY=FROM..TO:N")]
    """A parameter and N values between two, in SI units and radians; repeat it once for a heatmap."""
    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for the results; made when it does not exist."""
    figure: str = "nis_before_gate_mean"
    """What is computed: a key of summary.json, or accepted_fraction, longest_fail_s, largest_jump_m."""
    initial_pose: Annotated[str | None, arg(metavar="X,Y,THETA[,SX,SY,STHETA]")] = None
    """Pose of base at the first record and its 1-sigma, map frame [m, m, rad]. None: as for `localize`."""
    set: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="GROUP.KEY=VALUE")] = ()
    """A parameter of the localizer in place of the project's, in SI units and radians."""
    scheduler: Annotated[str | None, arg(metavar="ADDRESS")] = None
    """Scheduler of a Dask cluster that does the runs, as tcp://HOST:PORT (extra commission[cluster]; workers with one
    thread each). None: the cores of this machine."""
    force: bool = False
    """Whether files in DIR that this command did not write are overwritten; its own earlier results always are."""

    def run(self) -> None:
        """Sweep, write, and tell the best and the worst place."""
        given = None if self.initial_pose is None else initial_pose(self.initial_pose)

        from commission.io.overwriting import result_folder
        from commission.io.project_file import apply_settings, load_project
        from commission.io.recordings.base import load_log
        from commission.io.sweep_files import PICTURE, SUMMARY, TABLE, write_sweep
        from commission.studies.run import RunInput
        from commission.studies.start import start_of
        from commission.studies.sweep import SweepAxis, SweepInput, told

        names, sources = (TABLE, PICTURE, SUMMARY), (self.recording, self.project)
        out = result_folder(self.out, "sweep", names, force=self.force, sources=sources)
        project = load_project(self.project)
        project = dataclasses.replace(project, parameters=apply_settings(project.parameters, self.set))
        axes = tuple(SweepAxis.parse(text, project.parameters) for text in self.over)
        log = load_log(self.recording)
        start = start_of(project, log, given and given.pose, given and given.sigmas)
        inputs = SweepInput(run=RunInput.of(project, log, start), axes=axes, figure=self.figure)
        result = self._swept(inputs)
        with out.writing() as folder:
            write_sweep(folder, result)
        sys.stdout.write("\n".join([*told(result), f"Written to   {self.out}"]) + "\n")

    def _swept(self, inputs: SweepInput) -> SweepResult:
        """Sweep here, or on a cluster."""
        from commission.localization import whole_run
        from commission.studies.sweep import sweep

        if self.scheduler is None:
            whole_run.warm_up()
            return sweep(inputs, shown_progress)

        from commission.io.cluster import cluster

        with cluster(self.scheduler) as workers:
            return sweep(inputs, shown_progress, workers=workers)
