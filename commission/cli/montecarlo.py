"""The command `montecarlo`: many virtual drives with faults, the distribution of errors, and the Stanford diagram."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg

from commission.cli.terminal import shown_progress
from commission.errors import UsageError

if TYPE_CHECKING:
    from commission.simulation.random_faults import FaultRates
    from commission.studies.monte_carlo_figures import MonteCarloInput, MonteCarloResult


RATES = ("people", "glints", "covered", "false", "moved", "moved_sigma", "missing", "dirt", "slip", "kidnapping")
"""Options that are rates of faults."""


@dataclass(frozen=True, kw_only=True)
class MonteCarlo:
    """Drive many times in a virtual world with faults; writes drives.csv, stanford.csv and .png, and summary.json."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for the results; made when it does not exist."""
    runs: Annotated[int, arg(metavar="N")] = 100
    """Number of drives."""
    route: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = ()
    """Route to drive; repeated, they are driven in turn. None: all of the project."""
    seed: int = 1
    """Seed of all drives, 0 or more: the same seed gives the same result, bit by bit, whoever does the drives."""
    faults: bool = True
    """Whether anything goes wrong that is not the noise of sensors and wheels; without, no rate below may be given."""
    people: Annotated[int | None, arg(metavar="N")] = None
    """People walking about; they need beams. None: as many as the project says."""
    glints: Annotated[float | None, arg(metavar="PER_SCAN")] = None
    """Mean number of random short reflections in a scan; they need beams. None: as the project says."""
    covered: Annotated[float, arg(metavar="PER_HOUR")] = 2.0
    """Times per hour that all reflectors are covered, for 2 to 20 s each."""
    false: Annotated[float, arg(metavar="MEAN")] = 0.5
    """Mean number of things on the floor of a drive that are taken for a reflector."""
    moved: Annotated[float, arg(metavar="SHARE")] = 0.01
    """Share of the reflectors that were moved after the survey [0..1]."""
    moved_sigma: Annotated[float, arg(metavar="M")] = 0.05
    """How far a moved reflector is from its place, along x and along y, 1-sigma [m]."""
    missing: Annotated[float, arg(metavar="SHARE")] = 0.02
    """Share of the reflectors that are gone [0..1]."""
    dirt: Annotated[float, arg(metavar="SHARE")] = 0.05
    """Share of the reflectors that are dirty [0..1]: each is not seen in 20 to 90 % of the scans."""
    slip: Annotated[float, arg(metavar="PER_100_M")] = 0.5
    """Wheel slips per 100 m."""
    kidnapping: Annotated[float, arg(metavar="PER_HOUR")] = 0.5
    """Times per hour that the vehicle is carried on by 0.2 to 2 m: its wheels stand, and it sees nothing."""
    constants: bool = True
    """Whether survey, mounting, range bias and clock are drawn by the 1-sigmas of the project's `uncertainty`; if not,
    they are as its disturbances say."""
    detections: Literal["auto", "shadows", "beams"] = "auto"
    """Whether detections come from shadow maps, or beam by beam. auto: beams where a fault needs them."""
    set: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="GROUP.KEY=VALUE")] = ()
    """A parameter of the localizer in place of the project's, in SI units and radians."""
    scheduler: Annotated[str | None, arg(metavar="ADDRESS")] = None
    """Scheduler of a Dask cluster that does the drives, as tcp://HOST:PORT (extra commission[cluster]; workers with one
    thread each). None: the cores of this machine."""
    force: bool = False
    """Whether files in DIR that this command did not write are overwritten; its own earlier results always are."""

    def run(self) -> None:
        """Drive, write, and tell what was found."""
        from commission.io.monte_carlo_files import DRIVES, PICTURE, SUMMARY, TABLE, write_monte_carlo
        from commission.io.overwriting import result_folder
        from commission.io.project_file import apply_settings, load_project
        from commission.studies.monte_carlo_figures import Detecting, MonteCarloInput
        from commission.studies.monte_carlo_words import told

        rates = self._rates()
        names = (DRIVES, TABLE, PICTURE, SUMMARY)
        out = result_folder(self.out, "montecarlo", names, force=self.force, sources=(self.project,))
        project = load_project(self.project)
        project = dataclasses.replace(project, parameters=apply_settings(project.parameters, self.set))
        if not self.faults:
            project = dataclasses.replace(project, disturbances=project.disturbances.undisturbed())
        inputs = MonteCarloInput(
            project=project,
            routes=tuple(project.route(name).name for name in self.route)
            or tuple(each.name for each in project.routes),
            runs=self.runs,
            seed=self.seed,
            rates=rates,
            detecting=Detecting(self.detections),
        )
        result = self._driven(inputs)
        with out.writing() as folder:
            write_monte_carlo(folder, result)
        sys.stdout.write("\n".join([*told(result), f"Written to   {self.out}"]) + "\n")

    def _driven(self, inputs: MonteCarloInput) -> MonteCarloResult:
        """Drive here, or on a cluster."""
        from commission.studies.monte_carlo import monte_carlo, warm_up

        if self.scheduler is None:
            warm_up()
            return monte_carlo(inputs, shown_progress)

        from commission.io.cluster import cluster

        with cluster(self.scheduler) as workers:
            return monte_carlo(inputs, shown_progress, workers=workers)

    def _rates(self) -> FaultRates:
        """How often each fault happens; raises UsageError for a number out of range."""
        from commission.simulation.random_faults import FaultRates

        if not self.faults:
            given = [name for name in RATES if getattr(self, name) != getattr(FaultRates(), name)]
            if given:
                words = ", ".join(f"--{name.replace('_', '-')}" for name in given)
                raise UsageError(f"{words} with --no-faults, which leaves no fault; expected one or the other")
            return FaultRates.none()
        try:
            return FaultRates(
                people=self.people,
                glints=self.glints,
                covered=self.covered,
                false=self.false,
                moved=self.moved,
                moved_sigma=self.moved_sigma,
                missing=self.missing,
                dirt=self.dirt,
                slip=self.slip,
                kidnapping=self.kidnapping,
                constants=self.constants,
            )
        except ValueError as error:
            raise UsageError(str(error)) from None
