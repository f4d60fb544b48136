"""The command `triangulate`: a drive by the bearings of a goniometer alone."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg

from commission.cli.parsing import initial_pose
from commission.errors import UsageError
from commission.site.quantity import MILLIMETRES


@dataclass(frozen=True, kw_only=True)
class Triangulate:
    """Localize by bearings alone, each with its own time: dynamic triangulation, and a filter beside it.

    The bearings are in bearings.csv of the recording (stamp_ns,bearing and optional reflector); writes
    triangulation.csv and summary.json. Alenya et al. 2005, section II.
    """

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    recording: Positional[Path]
    """Recording as in `localize`, with bearings.csv in its folder or by --bearings."""
    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for the results; made when it does not exist."""
    bearings: Annotated[Path | None, arg(metavar="FILE")] = None
    """Table with the bearings. None: bearings.csv of the recording."""
    scanner: Annotated[str | None, arg(metavar="NAME")] = None
    """Scanner of the project whose mounting the goniometer has. None: the first."""
    bearing_sigma: Annotated[float | None, arg(metavar="RAD")] = None
    """1-sigma noise of a bearing [rad]. None: that of the scanner, or observation.bearing_sigma."""
    turns_per_second: float = 8.0
    """Turns of the goniometer [1/s]: a bearing is used for one and a half turns."""
    reach: float = 30.0
    """Distance out to which the goniometer sees reflectors [m]."""
    initial_pose: Annotated[str | None, arg(metavar="X,Y,THETA[,SX,SY,STHETA]")] = None
    """Pose of base at the first record and its 1-sigma, map frame [m, m, rad]. None: as for `localize`."""
    set: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="GROUP.KEY=VALUE")] = ()
    """A parameter of the localizer in place of the project's, in SI units and radians."""
    force: bool = False
    """Whether files in DIR that this command did not write are overwritten; its own earlier results always are."""

    def run(self) -> None:
        """Localize, write, and tell the figures."""
        given = None if self.initial_pose is None else initial_pose(self.initial_pose)
        for name in ("bearing_sigma", "turns_per_second", "reach"):
            value = getattr(self, name)
            if value is not None and not value > 0.0:
                raise UsageError(f"--{name.replace('_', '-')} is {value:g}; expected a number > 0")

        from commission.io.overwriting import result_folder
        from commission.io.project_file import apply_settings, load_project
        from commission.io.recordings.base import load_log
        from commission.io.recordings.bearing_file import read_bearings
        from commission.io.triangulation_files import FILES, write_triangulation
        from commission.studies.start import StartOrigin, start_of
        from commission.studies.triangulation import TriangulationInput, summary, triangulate

        sources = (self.recording, self.project)
        out = result_folder(self.out, "triangulate", FILES, force=self.force, sources=sources)
        project = load_project(self.project)
        project = dataclasses.replace(project, parameters=apply_settings(project.parameters, self.set))
        names = [each.name for each in project.scanners]
        if self.scanner is not None and self.scanner not in names:
            raise UsageError(f"--scanner is {self.scanner!r}; expected one of {', '.join(names)}")
        scanner = project.scanners[0 if self.scanner is None else names.index(self.scanner)]
        bearings = read_bearings(self.recording if self.bearings is None else self.bearings)
        log = load_log(self.recording)
        start = start_of(project, log, given and given.pose, given and given.sigmas)
        if start.origin is StartOrigin.SEARCH:
            raise UsageError(
                "nobody says where the vehicle starts, which bearings alone do not tell; give --initial-pose"
            )
        observation = project.parameters.observation
        _, sigma = scanner.detection_sigmas(observation.range_sigma, observation.bearing_sigma)
        inputs = TriangulationInput(
            log=log,
            bearings=bearings,
            start=start,
            reflectors=project.reflectors,
            mounting=scanner.mounting,
            odometry=project.parameters.odometry,
            bearing_sigma=sigma if self.bearing_sigma is None else self.bearing_sigma,
            rate=self.turns_per_second,
            reach=self.reach,
        )
        result = triangulate(inputs)
        figures = summary(inputs, result)
        with out.writing() as folder:
            write_triangulation(folder, result, tuple(each.id for each in project.reflectors.reflectors), figures)
        sys.stdout.write("\n".join([*_told(figures), f"Written to   {self.out}"]) + "\n")


def _told(figures: dict[str, float | int | None]) -> list[str]:
    """Lines for a person."""

    def length(key: str) -> str:
        value = figures.get(key)
        return "unknown" if value is None else MILLIMETRES.text(float(value), ".2f")

    nis = figures["nis_mean"]
    lines = [
        f"Reflexes     {figures['reflexes']}, {figures['of_nobody']} of no reflector or outside the gate",
        f"Fixes        {figures['fixes']} by three bearings each, 1-sigma {length('fix_sigma_m')} of the position",
        f"Filter       NIS mean {'unknown' if nis is None else format(nis, '.2f')} (1.00 is consistent)",
    ]
    if "filter_position_rmse_m" in figures:
        lines.append(
            f"Reference    position off by {length('fix_position_rmse_m')} (fixes) and "
            f"{length('filter_position_rmse_m')} (filter), root mean square"
        )
    return lines
