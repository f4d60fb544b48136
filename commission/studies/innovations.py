"""Innovations of a whole run: what each detection differs from its prediction by, and how much that was expected to.

Arrays over all detections; the likeliest reflector is the run's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.localization.observation import residuals
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Innovations:
    """Of n detections."""

    residuals: FloatArray
    """(n, 2) measured minus predicted range [m] and bearing [rad]; NaN where a detection has no reflector."""
    covariances: FloatArray
    """(n, 2, 2) S = H P H^T + R, and what the project's uncertainty adds."""
    jacobians: FloatArray
    """(n, 2, 3) H of range and bearing by x, y and heading of base."""
    noise: FloatArray
    """(n, 2) variances of range [m^2] and bearing [rad^2] alone, the diagonal of R."""
    distances: FloatArray
    """(n,) predicted range [m]."""


def innovations(run: RunColumns, setup: LocalizerSetup) -> Innovations:
    """Predict each detection from the belief before its scan.

    Parameters
    ----------
    run : a whole run.
    setup : that of the run.
    """
    priors = run.priors.rows()
    counts = np.diff(run.offsets)
    of = np.repeat(run.detected.scanners, counts)
    if not len(setup.reflectors) or not len(of):
        nothing = np.full(len(of), math.nan)
        none = np.full((len(of), 2), math.nan)
        return Innovations(
            residuals=none,
            covariances=np.full((len(of), 2, 2), math.nan),
            jacobians=np.full((len(of), 2, 3), math.nan),
            noise=none,
            distances=nothing,
        )
    mountings = np.array([each.mounting for each in setup.scanners])
    T = np.repeat(priors.means, counts, axis=0)
    sensors = se2.compose(T, mountings[of])
    nobody = run.reflector < 0
    centers = setup.reflectors.centers[np.where(nobody, 0, run.reflector)]
    bias = setup.parameters.observation.range_bias
    nu, distance = residuals(sensors, centers, run.range_bearing - (bias, 0.0))
    distance = np.maximum(distance, 1e-3)
    u = (centers - sensors[:, :2]) / distance[:, np.newaxis]
    arm = sensors[:, :2] - T[:, :2]
    H = np.zeros((len(of), 2, 3))
    H[:, 0, :2] = -u
    H[:, 1, 0], H[:, 1, 1] = u[:, 1] / distance, -u[:, 0] / distance
    H[:, 0, 2] = u[:, 0] * arm[:, 1] - u[:, 1] * arm[:, 0]
    H[:, 1, 2] = -(u[:, 0] * arm[:, 0] + u[:, 1] * arm[:, 1]) / distance - 1.0
    S = H @ np.repeat(priors.covariances, counts, axis=0) @ np.swapaxes(H, 1, 2)
    noise = setup.observation_rows[of, 3:5]
    known = setup.uncertainty
    place = known.survey**2 + known.mounting_position**2 if setup.parameters.filter.consider else 0.0
    S[:, 0, 0] += noise[:, 0] + place + (known.range_bias**2 if place else 0.0)
    S[:, 1, 1] += noise[:, 1] + place / distance**2 + (known.mounting_heading**2 if place else 0.0)
    return Innovations(
        residuals=np.where(nobody[:, np.newaxis], math.nan, nu),
        covariances=S,
        jacobians=H,
        noise=noise,
        distances=distance,
    )
