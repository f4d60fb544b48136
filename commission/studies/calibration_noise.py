"""Noise of detections and odometry as figures of a project, and setups that have it.

Its sizes come from a fit and from localizers that agree; nothing is estimated in here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.localization.setup import LocalizerSetup
from commission.site.quantity import DEGREES, MILLIMETRES, Shown
from commission.studies.calibration_fit import CalibrationFit
from commission.studies.calibration_values import CalibrationInput, CalibrationVerdict, Value

ODOMETRY = (
    *("forward_per_sqrt_m", "forward_per_sqrt_s", "lateral_per_sqrt_m"),
    *("heading_per_sqrt_m", "heading_per_sqrt_rad", "heading_per_sqrt_s"),
)
"""Noises of odometry, in the order of their variances."""


def residual_spread(found: CalibrationFit) -> FloatArray:
    """(2,) standard deviation of the residuals of range [m] and bearing [rad].

    Parameters
    ----------
    found : the fit.
    """
    return np.sqrt(np.nanmean(found.residuals**2, axis=0))


def noisy(setup: LocalizerSetup, sigmas: FloatArray, odometry: FloatArray) -> LocalizerSetup:
    """Return the setup with other noise.

    Parameters
    ----------
    setup : of the localizer.
    sigmas : (2,) 1-sigma of range [m] and bearing [rad].
    odometry : (6,) variances, in the order of `ODOMETRY`.
    """
    driven = dict(zip(ODOMETRY, np.sqrt(odometry).tolist(), strict=True))
    given = setup.parameters
    parameters = replace(
        given,
        observation=replace(given.observation, range_sigma=float(sigmas[0]), bearing_sigma=float(sigmas[1])),
        odometry=replace(given.odometry, **driven),
    )
    scanners = tuple(
        replace(each, detection_range_sigma=None, detection_bearing_sigma_deg=None) for each in setup.scanners
    )
    return replace(setup, scanners=scanners, parameters=parameters)


def noise_values(
    inputs: CalibrationInput, whole: CalibrationFit, odometry: FloatArray, spread: FloatArray, factor: float
) -> list[Value]:
    """Noise as figures of the project: what two localizers that see different reflectors need to agree.

    Parameters
    ----------
    inputs : what the project says.
    whole : the fit.
    odometry : (6,) variances, in the order of `ODOMETRY`.
    spread : (2,) `residual_spread`.
    factor : multiple of it that the localizer needs.
    """
    seen, driven = inputs.parameters.observation, inputs.parameters.odometry
    shown = [MILLIMETRES, DEGREES, *_shown_of_noise()]
    keys = ["observation.range_sigma", "observation.bearing_sigma", *(f"odometry.{name}" for name in ODOMETRY)]
    before = [seen.range_sigma, seen.bearing_sigma, *(getattr(driven, name) for name in ODOMETRY)]
    after = [*(factor * spread).tolist(), *np.sqrt(odometry).tolist()]
    values: list[Value] = []
    for index, key in enumerate(keys):
        # Correlated residuals are as many independent ones as the square of the factor leaves of them.
        relative = 0.5 * factor * float(whole.noise_sigmas[index])
        is_shown = relative < 0.5
        values.append(
            Value(
                key=key,
                before=before[index],
                proposed=after[index],
                sigma=after[index] * relative,
                verdict=CalibrationVerdict.PROPOSED if is_shown else CalibrationVerdict.NOT_SHOWN,
                shown=shown[index],
                reason="" if is_shown else "other noise of the wheels hides it in this drive",
            )
        )
    return values


def _shown_of_noise() -> tuple[Shown, ...]:
    """Units of the noises of odometry."""
    along, turning = MILLIMETRES.scale, DEGREES.scale
    return (
        *(Shown("mm/√m", along), Shown("mm/√s", along), Shown("mm/√m", along)),
        *(Shown("°/√m", turning), Shown("°/√rad", turning), Shown("°/√s", turning)),
    )
