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
from commission.studies.calibration_values import CalibrationInput, CalibrationVerdict, NoiseVerdict, Value

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


def noisy(setup: LocalizerSetup, sigmas: FloatArray | None, odometry: FloatArray | None) -> LocalizerSetup:
    """Return the setup with other noise.

    Parameters
    ----------
    setup : of the localizer.
    sigmas : (2,) 1-sigma of range [m] and bearing [rad]; None: as it is.
    odometry : (6,) variances, in the order of `ODOMETRY`; None: as they are.
    """
    parameters, scanners = setup.parameters, setup.scanners
    if sigmas is not None:
        observation = replace(parameters.observation, range_sigma=float(sigmas[0]), bearing_sigma=float(sigmas[1]))
        parameters = replace(parameters, observation=observation)
        scanners = tuple(
            replace(each, detection_range_sigma=None, detection_bearing_sigma_deg=None) for each in scanners
        )
    if odometry is not None:
        driven = dict(zip(ODOMETRY, np.sqrt(odometry).tolist(), strict=True))
        parameters = replace(parameters, odometry=replace(parameters.odometry, **driven))
    return replace(setup, scanners=scanners, parameters=parameters)


def noise_values(
    inputs: CalibrationInput,
    whole: CalibrationFit,
    proposed: tuple[FloatArray, FloatArray],
    factor: float,
    verdicts: tuple[NoiseVerdict, NoiseVerdict],
) -> list[Value]:
    """Noise as figures of the project: what two localizers that see different reflectors need to agree.

    Parameters
    ----------
    inputs : what the project says.
    whole : the fit.
    proposed : (2,) `residual_spread`, and (6,) variances of odometry in the order of `ODOMETRY`.
    factor : multiple of the spread that the localizer needs.
    verdicts : of the noise of detections, and of that of odometry.
    """
    spread, odometry = proposed
    seen, driven = inputs.parameters.observation, inputs.parameters.odometry
    shown = [MILLIMETRES, DEGREES, *_shown_of_noise()]
    keys = ["observation.range_sigma", "observation.bearing_sigma", *(f"odometry.{name}" for name in ODOMETRY)]
    before = [seen.range_sigma, seen.bearing_sigma, *(getattr(driven, name) for name in ODOMETRY)]
    after = [*(factor * spread).tolist(), *np.sqrt(odometry).tolist()]
    values: list[Value] = []
    for index, key in enumerate(keys):
        # Correlated residuals are as many independent ones as the square of the factor leaves of them.
        relative = 0.5 * factor * float(whole.noise_sigmas[index])
        is_shown, judged = relative < 0.5, verdicts[0 if index < len(spread) else 1]
        verdict = CalibrationVerdict.WORSE if judged.is_worse else CalibrationVerdict.PROPOSED
        values.append(
            Value(
                key=key,
                before=before[index],
                proposed=after[index],
                sigma=after[index] * relative,
                verdict=verdict if is_shown else CalibrationVerdict.NOT_SHOWN,
                shown=shown[index],
                reason=judged.reason if is_shown else "other noise of the wheels hides it in this drive",
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
