"""The command `vision`: motion of a camera by a contour that it sees, beside that of the vehicle by its laser."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from commission.cli.parsing import initial_pose
from commission.errors import UsageError
from commission.site.quantity import MILLIMETRES, PERCENT, PLAIN_DEGREES

if TYPE_CHECKING:
    from commission.studies.vision import Constant, VisionResult


@dataclass(frozen=True, kw_only=True)
class Vision:
    """Tell how a camera moved by a planar contour it saw, where it is on the vehicle, and how deep the contour was.

    The contour's control points are in contour.csv of the recording (stamp_ns,point,u,v); writes vision.csv and
    summary.json. Alenya et al. 2005, sections III and V.
    """

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    recording: Positional[Path]
    """Recording as in `localize`, with contour.csv in its folder or by --contour."""
    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for the results; made when it does not exist."""
    contour: Annotated[Path | None, arg(metavar="FILE")] = None
    """Table with the control points. None: contour.csv of the recording."""
    focal_length: Annotated[float | None, arg(metavar="PIXELS")] = None
    """Focal length of the camera [pixels], where u and v are pixels. None: u and v are in focal lengths already."""
    principal_point: Annotated[tuple[float, float] | None, arg(metavar="U V")] = None
    """Principal point of the camera [pixels]; needed with --focal-length."""
    initial_pose: Annotated[str | None, arg(metavar="X,Y,THETA[,SX,SY,STHETA]")] = None
    """Pose of base at the first record and its 1-sigma, map frame [m, m, rad]. None: as for `localize`."""
    set: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="GROUP.KEY=VALUE")] = ()
    """A parameter of the localizer in place of the project's, in SI units and radians."""
    force: bool = False
    """Whether files in DIR that this command did not write are overwritten; its own earlier results always are."""

    def run(self) -> None:
        """Localize, compare, write, and tell the figures."""
        given = None if self.initial_pose is None else initial_pose(self.initial_pose)
        if (self.focal_length is None) != (self.principal_point is None):
            raise UsageError("one of --focal-length and --principal-point is given; expected both, or neither")
        if self.focal_length is not None and not self.focal_length > 0.0:
            raise UsageError(f"--focal-length is {self.focal_length:g}; expected pixels > 0")

        from commission.io.overwriting import result_folder
        from commission.io.project_file import apply_settings, load_project
        from commission.io.recordings.base import load_log
        from commission.io.recordings.contour_file import read_contour
        from commission.io.vision_files import FILES, write_vision
        from commission.localization import whole_run
        from commission.studies.run import RunInput, judged_run
        from commission.studies.start import start_of
        from commission.studies.vision import VisionInput, vision

        sources = (self.recording, self.project)
        out = result_folder(self.out, "vision", FILES, force=self.force, sources=sources)
        project = load_project(self.project)
        project = dataclasses.replace(project, parameters=apply_settings(project.parameters, self.set))
        track = read_contour(self.recording if self.contour is None else self.contour)
        if self.focal_length is not None and self.principal_point is not None:
            track = track.in_focal_lengths(self.focal_length, self.principal_point)
        log = load_log(self.recording)
        start = start_of(project, log, given and given.pose, given and given.sigmas)
        whole_run.warm_up()
        result = vision(VisionInput.of(judged_run(RunInput.of(project, log, start)).columns, track))
        with out.writing() as folder:
            write_vision(folder, result)
        sys.stdout.write("\n".join([*_told(result), f"Written to   {self.out}"]) + "\n")


def _told(result: VisionResult) -> list[str]:
    """Lines for a person."""
    from commission.studies.vision import summary

    entries = summary(result)
    seconds = (result.stamps_ns[-1] - result.stamps_ns[0]) * 1e-9
    lines = [
        f"Motion       {result.way:.3f} m in {len(result.stamps_ns)} frames and {seconds:.1f} s; "
        f"points are seen to {PERCENT.text(result.noise, '.2g')} of the focal length (1 sigma)"
    ]
    for label, name in (("Difference", "difference"), ("Equation 6-12", "closed_form_difference")):
        ahead, left, share = (
            float(str(entries[f"{name}_{key}"])) for key in ("forward_rms_m", "left_rms_m", "share_of_motion")
        )
        lines.append(
            f"{label:12} vision less laser {MILLIMETRES.text(ahead, '.1f')} forward, "
            f"{MILLIMETRES.text(left, '.1f')} sideways (rms): {PERCENT.text(share, '.1f')} of the motion"
        )
    lines += [f"{label:12} {_with_sigma(result.constant(name))}" for label, name in _LABELS]
    return [*lines, *(f"Note         {finding}" for finding in result.findings)]


_LABELS = (
    ("Camera ahead", "forward"),
    ("Camera left", "left"),
    ("Camera yaw", "yaw"),
    ("First depth", "depth"),
    ("Board slant", "slant_across"),
)


def _with_sigma(constant: Constant) -> str:
    shown = MILLIMETRES if constant.unit == "m" else PLAIN_DEGREES
    return f"{shown.text(constant.value, '.2f')} ± {shown.text(constant.sigma, '.2f')}"
