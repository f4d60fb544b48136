"""Every tunable of the localizer, grouped by the stage that reads it. The docstrings are the hints users see."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from commission.site.checks import above, at_least, between


@dataclass(frozen=True, slots=True)
class ObservationParameters:
    """Noise of a detected reflector (R of equation 2)."""

    range_sigma: float = 0.02
    """1-sigma noise of a reflector's measured range [m]."""
    bearing_sigma: float = 0.004
    """1-sigma noise of a reflector's measured bearing [rad]."""
    range_bias: float = 0.0
    """What the scanner adds to the true range of a reflector [m]; it is subtracted. Reflective tape often causes it."""

    def __post_init__(self) -> None:
        above(self.range_sigma, 0.0, "observation.range_sigma", "m")
        above(self.bearing_sigma, 0.0, "observation.bearing_sigma", "rad")
        between(self.range_bias, (-1.0, 1.0), "observation.range_bias", "m")


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryParameters:
    """Growth of the uncertainty while driving (Q of equation 1), independent of how finely odometry is sampled."""

    forward_per_sqrt_m: float = 0.01
    """1-sigma error along the motion after one metre driven [m/sqrt(m)]."""
    lateral_per_sqrt_m: float = 0.003
    """1-sigma error across the motion after one metre driven [m/sqrt(m)]."""
    heading_per_sqrt_m: float = 0.006
    """1-sigma heading error after one metre driven [rad/sqrt(m)]."""
    heading_per_sqrt_rad: float = 0.01
    """1-sigma heading error after turning one radian [rad/sqrt(rad)]."""
    forward_per_sqrt_s: float = 0.0005
    """1-sigma error along the vehicle's axis after one second, even at rest [m/sqrt(s)]."""
    heading_per_sqrt_s: float = 0.0002
    """1-sigma heading error after one second, even at rest [rad/sqrt(s)]."""

    def __post_init__(self) -> None:
        for name in (
            "forward_per_sqrt_m",
            "lateral_per_sqrt_m",
            "heading_per_sqrt_m",
            "heading_per_sqrt_rad",
            "forward_per_sqrt_s",
            "heading_per_sqrt_s",
        ):
            at_least(getattr(self, name), 0.0, f"odometry.{name}")


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorParameters:
    """From a scan to detections (Algorithm 2) and the detector filter (equation 3)."""

    enabled: bool = True
    """Whether clusters with too few or too many beams for a reflector at their range are rejected (detector filter)."""
    intensity_threshold: float = 0.5
    """Echo strength from which a beam counts as reflective, where the scanner gives no flag [sensor's unit]."""
    min_model_error: int = 1
    """Beams that a cluster may have fewer than equation 3 says [beams]."""
    max_model_error: int = 2
    """Beams that a cluster may have more than equation 3 says [beams]."""
    range_jump: float = 0.25
    """Difference in range between neighboring beams that separates two clusters [m]."""
    center: str = "circle"
    """Center of a reflector from its cluster: `circle` fits a circle of known radius, `central_beam` is the paper's."""

    def __post_init__(self) -> None:
        if not math.isfinite(self.intensity_threshold):
            raise ValueError(f"detector.intensity_threshold is {self.intensity_threshold}; expected a finite number")
        at_least(self.min_model_error, 0, "detector.min_model_error", "beams")
        at_least(self.max_model_error, 0, "detector.max_model_error", "beams")
        above(self.range_jump, 0.0, "detector.range_jump", "m")
        if self.center not in ("circle", "central_beam"):
            raise ValueError(f"detector.center is {self.center!r}; expected 'circle' or 'central_beam'")


@dataclass(frozen=True, slots=True)
class AssociationParameters:
    """Which reflector a detection belongs to, and the association filter (Algorithm 3)."""

    enabled: bool = True
    """Whether detections outside the validation gate of their likeliest reflector are rejected (association filter)."""
    gate_probability: float = 0.95
    """Probability that a true detection falls inside the validation gate, P_G [0..1]."""

    def __post_init__(self) -> None:
        if not 0.0 < self.gate_probability < 1.0:
            raise ValueError(
                f"association.gate_probability is {self.gate_probability:g}; expected more than 0 and less than 1"
            )


@dataclass(frozen=True, slots=True)
class SupervisorParameters:
    """When the estimate is no longer good enough to drive on (Algorithm 4)."""

    enabled: bool = True
    """Whether the supervisor may stop the vehicle."""
    position_limit: float = 0.1
    """Largest allowed 2-sigma of x and of y, Err_p [m]."""
    heading_limit: float = math.radians(3.0)
    """Largest allowed 2-sigma of the heading, Err_o [rad]."""
    recovery_ratio: float = 2.0
    """The vehicle may drive again once every 2-sigma is below its limit divided by this ratio, R_B [1 or more]."""

    def __post_init__(self) -> None:
        above(self.position_limit, 0.0, "supervisor.position_limit", "m")
        above(self.heading_limit, 0.0, "supervisor.heading_limit", "rad")
        at_least(self.recovery_ratio, 1.0, "supervisor.recovery_ratio")


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """All tunables of the localizer."""

    observation: ObservationParameters = field(default_factory=ObservationParameters)
    """Noise of a detected reflector."""
    odometry: OdometryParameters = field(default_factory=OdometryParameters)
    """Growth of the uncertainty while driving."""
    detector: DetectorParameters = field(default_factory=DetectorParameters)
    """From a scan to detections."""
    association: AssociationParameters = field(default_factory=AssociationParameters)
    """From detections to reflectors."""
    supervisor: SupervisorParameters = field(default_factory=SupervisorParameters)
    """When to stop the vehicle."""
