"""Motion of a camera by a contour, beside that of the vehicle by its laser: Alenya et al. 2005, sections III and V.

The paper measures the camera's place (its d_x, d_y) and the first depth Z_0 by hand and leaves open how to find them;
here the drive tells them. The laser's poses and their covariances are measurements of the vehicle's poses, the control
points are measurements of the camera's, and what makes both agree best is estimated with its covariance. The motion
itself is then found from the contour alone, with the constants found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.errors import UsageError
from commission.geometry import se2
from commission.geometry.angles import difference
from commission.geometry.arrays import BoolArray, FloatArray, IntArray, read_only
from commission.localization.contour_bundle import Bundle
from commission.localization.egomotion import why_degenerate
from commission.localization.estimate import Mode
from commission.localization.run_columns import RunColumns
from commission.progress import Progress, silent
from commission.site.contour_track import ContourTrack
from commission.site.quantity import MILLIMETRES, PLAIN_DEGREES
from commission.studies.inputs import StudyInput
from commission.studies.metrics import reference_at
from commission.studies.vision_fit import SLANT_SIGMA, Tied, closed_forms, fit_alone, fit_tied, planar_motion, to_planar

FEWEST_FRAMES = 5
"""Frames with a pose of the vehicle below which nothing is compared."""
NOT_PLANAR = 5.0
"""Residuals at the end, by those at the beginning, above which a contour is not planar."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class VisionInput(StudyInput):
    """All that the comparison depends on."""

    track: ContourTrack
    """Control points, in focal lengths."""
    poses: FloatArray
    """(K, 3) pose of base by laser at each frame [m, m, rad], map frame; NaN where there is none."""
    covariances: FloatArray
    """(K, 3, 3) of those."""

    @staticmethod
    def of(columns: RunColumns, track: ContourTrack) -> VisionInput:
        """Return the input with the poses of a run: linear between two cycles that are both operational.

        Parameters
        ----------
        columns : the run by laser.
        track : control points, in focal lengths.
        """
        means = np.where((columns.modes == Mode.OPERATIONAL)[:, np.newaxis], columns.means, np.nan)
        before = np.clip(np.searchsorted(columns.stamps_ns, track.stamps_ns, side="right") - 1, 0, len(columns) - 1)
        return VisionInput(
            track=track,
            poses=read_only(reference_at(track.stamps_ns, columns.stamps_ns, means)),
            covariances=read_only(columns.covariances[before]),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Constant:
    """A constant that the drive tells."""

    name: str
    """What it is."""
    value: float
    """[m] or [rad]."""
    sigma: float
    """1-sigma, the same unit."""
    unit: str
    """m or rad."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class VisionResult:
    """Both motions, and what ties them."""

    stamps_ns: IntArray
    """(K,) frames with a pose of the vehicle [ns]."""
    constants: tuple[Constant, ...]
    """forward, left, yaw: the camera in the base frame; depth Z_0; slant_across, slant_down, pitch, roll."""
    camera: FloatArray
    """(K, 3) motion of the camera by the contour since the first frame: forward [m], left [m], turn [rad]."""
    camera_covariances: FloatArray
    """(K, 3, 3) of that, given the constants."""
    laser: FloatArray
    """(K, 3) the same motion by the laser, of the camera's place."""
    closed_form: FloatArray
    """(K, 3) the same by the paper's equations 1 to 12 frame by frame, with the depth found; NaN where they fail."""
    camera_map: FloatArray
    """(K, 3) pose of the camera by the contour, map frame; it begins where the laser says."""
    laser_map: FloatArray
    """(K, 3) pose of the camera by the laser, map frame."""
    noise: float
    """1-sigma of a coordinate of a control point [focal lengths]."""
    way: float
    """Distance of the camera's first and farthest place by the laser [m]."""
    findings: tuple[str, ...]
    """What looks wrong, in words."""

    def constant(self, name: str) -> Constant:
        """Return a constant by its name."""
        return next(each for each in self.constants if each.name == name)

    @property
    def differences(self) -> FloatArray:
        """(K, 3) vision less laser, as in the paper's Fig. 10: forward [m], left [m], turn [rad]."""
        return _less(self.camera, self.laser)


def summary(result: VisionResult) -> dict[str, float | int | list[str] | None]:
    """Entries of `summary.json`."""
    off, paper = result.differences, _less(result.closed_form, result.laser)
    entries: dict[str, float | int | list[str] | None] = {
        "frames": len(result.stamps_ns),
        "motion_m": result.way,
        "noise_focal_lengths": result.noise,
    }
    for name, each in (("difference", off), ("closed_form_difference", paper)):
        known = each[np.isfinite(each).all(axis=1)]
        rms = np.sqrt(np.mean(np.square(known), axis=0)) if len(known) else np.full(3, np.nan)
        entries |= {
            f"{name}_forward_rms_m": float(rms[0]),
            f"{name}_left_rms_m": float(rms[1]),
            f"{name}_turn_rms_rad": float(rms[2]),
            f"{name}_share_of_motion": float(np.hypot(rms[0], rms[1]) / result.way),
        }
    for each in result.constants:
        entries |= {f"{each.name}_{each.unit}": each.value, f"{each.name}_sigma_{each.unit}": each.sigma}
    finite = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in entries.items()}
    return {**finite, "findings": list(result.findings)}


def vision(inputs: VisionInput, progress: Progress = silent) -> VisionResult:
    """Estimate the camera's constants and its motion, and compare it with the laser's.

    Parameters
    ----------
    inputs : control points, and the poses of the run.
    progress : told which fit is under way; may raise to cancel.

    Raises
    ------
    UsageError
        the contour is degenerate, too few frames have a pose, or the drive tells no depth; says which.
    """
    known: BoolArray = np.all(np.isfinite(inputs.poses), axis=1)
    seen, poses, covariances = inputs.track.points[known], inputs.poses[known], inputs.covariances[known]
    _refuse(inputs.track, seen, poses)
    progress(0.0, "tying the contour to the laser")
    first = closed_forms(seen, poses)
    tied = fit_tied(seen, poses, covariances, first)
    way = float(np.hypot(*(tied.laser[:, :2] - tied.laser[0, :2]).T).max())
    depth = float(tied.bundle.further[3])
    if not depth > 0.0 or tied.sigmas[3] > 0.5 * depth:
        raise UsageError(
            f"the drive tells no depth of the contour ({depth:.2f} ± {tied.sigmas[3]:.2f} m); "
            "expected motion towards or along it"
        )
    progress(0.7, "moving by the contour alone")
    alone = fit_alone(seen, first, tied.bundle)
    camera, spread = planar_motion(alone, depth)
    places = se2.compose(poses[0], tied.bundle.further[:3])
    closed = to_planar(first, np.zeros(2)) * [depth, depth, 1.0]
    return VisionResult(
        stamps_ns=inputs.track.stamps_ns[known],
        constants=_constants(tied),
        camera=camera,
        camera_covariances=spread,
        laser=tied.laser,
        closed_form=closed,
        camera_map=se2.compose(places, camera),
        laser_map=se2.compose(poses, tied.bundle.further[:3]),
        noise=alone.noise,
        way=way,
        findings=_findings(inputs, known, tied, alone),
    )


def vision_alone(track: ContourTrack) -> tuple[FloatArray, FloatArray]:
    """Motion of the camera from the contour and nothing else, by the depth of the contour in the first frame.

    Parameters
    ----------
    track : control points, in focal lengths; not degenerate, else UsageError.

    Returns
    -------
    motion : (K, 3) forward and left by Z_0, turn [rad], since the first frame.
    covariances : (K, 3, 3) of it, with a plane that faces the camera within `SLANT_SIGMA`.
    """
    _refuse(track, track.points, np.zeros((len(track), 3)), moves=False)
    first = closed_forms(track.points, None)
    return planar_motion(fit_alone(track.points, first, None), 1.0)


def _refuse(track: ContourTrack, seen: FloatArray, poses: FloatArray, *, moves: bool = True) -> None:
    """Raise UsageError where motion cannot be told."""
    if len(seen) < FEWEST_FRAMES:
        has = "a pose of the vehicle" if moves else "all points"
        raise UsageError(f"{len(seen)} of {len(track)} frames have {has}; expected at least {FEWEST_FRAMES}")
    if reason := why_degenerate(seen[0]):
        raise UsageError(f"the contour {reason}")
    way = float(np.hypot(*(poses[:, :2] - poses[0, :2]).T).max())
    if moves and way == 0.0:
        raise UsageError("the vehicle stands still in all frames; expected motion")


def _constants(tied: Tied) -> tuple[Constant, ...]:
    """All constants with their 1-sigmas."""
    names = ("forward", "left", "yaw", "depth", "slant_across", "slant_down", "pitch", "roll")
    units = ("m", "m", "rad", "m", "rad", "rad", "rad", "rad")
    values = [*tied.bundle.further[:4].tolist(), *tied.bundle.shared.tolist()]
    return tuple(
        Constant(name=name, value=value, sigma=float(sigma), unit=unit)
        for name, value, sigma, unit in zip(names, values, tied.sigmas, units, strict=True)
    )


def _less(one: FloatArray, other: FloatArray) -> FloatArray:
    off = one - other
    off[:, 2] = difference(one[:, 2], other[:, 2])
    return off


def _findings(inputs: VisionInput, known: BoolArray, tied: Tied, alone: Bundle) -> tuple[str, ...]:
    """What looks wrong."""
    found: list[str] = []
    if inputs.track.left_out:
        found.append(f"{inputs.track.left_out} frames lack a point and are left out")
    if not known.all():
        found.append(f"{np.count_nonzero(~known)} of {len(known)} frames have no operational pose and are left out")
    if not (tied.bundle.converged and alone.converged):
        found.append("the fit did not come to rest; the figures are those of its last step")
    whole = np.sqrt(np.mean(np.square(alone.residuals), axis=(1, 2)))
    early = float(np.median(whole[: max(len(whole) // 10, 2)]))
    late = float(np.median(whole[-max(len(whole) // 10, 2) :]))
    if late > NOT_PLANAR * max(early, 1e-12):
        found.append(
            f"points lie {late / early:.0f} times farther from where the contour should be at the end than at the "
            "beginning: it is not planar, or the tracker lost it"
        )
    slant = math.atan(math.hypot(*tied.bundle.shared[:2].tolist()))
    if slant > 3.0 * SLANT_SIGMA:
        found.append(
            f"the contour's plane is slanted by {PLAIN_DEGREES.text(slant)}; "
            "the closed form takes it for facing the camera"
        )
    if tied.sigmas[0] > 0.1 or tied.sigmas[1] > 0.1:
        turned = float(np.ptp(difference(inputs.poses[known][:, 2], inputs.poses[known][0, 2])))
        worst = float(max(tied.sigmas[0], tied.sigmas[1]))
        found.append(
            f"the camera's place is told to {MILLIMETRES.text(worst)} only (1 sigma); "
            f"the drive turns by {PLAIN_DEGREES.text(turned, '.1f')}, more tells it better"
        )
    return tuple(found)
