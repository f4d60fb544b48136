"""Every tunable of the localizer, grouped by the stage that reads it. The docstrings are the hints users see."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from commission.site.checks import check_fields
from commission.site.floor_map import FloorMap
from commission.site.odometry_growth import (
    FORWARD_PER_SQRT_M,
    FORWARD_PER_SQRT_S,
    HEADING_PER_SQRT_M,
    HEADING_PER_SQRT_RAD,
    HEADING_PER_SQRT_S,
    LATERAL_PER_SQRT_M,
)
from commission.site.quantity import (
    DEGREES,
    MILLIMETRES,
    NOT_NEGATIVE,
    PERCENT,
    POSITIVE,
    SHARE,
    Bounds,
    Choice,
    Group,
    Quantity,
    Shown,
    Switch,
)

FILTER_KINDS = ("ekf", "ukf", "ckf", "invariant")
"""Kinds of filter: extended (the paper's), unscented, cubature, right-invariant extended Kalman filter."""

ASSOCIATION_METHODS = ("exclusive", "nearest", "careful", "joint", "several_scans")
"""Ways to decide which reflector a detection belongs to; `nearest` is the paper's."""


def _gate(label: str) -> Quantity:
    """What is known of the probability that something true falls inside a validation gate."""
    return Quantity(
        label=label,
        shown=PERCENT,
        bounds=Bounds.inside(0.0, 1.0),
        step=0.01,
        slider=(50.0, 99.99),
        is_tail=True,
    )


_SCALE = Bounds.between(-0.5, 0.5)
"""Wheels that are off by more are other wheels."""


@dataclass(frozen=True, slots=True)
class ObservationParameters:
    """Noise of a detected reflector (R of equation 2)."""

    range_sigma: Annotated[
        float,
        Quantity(label="Range 1σ", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=0.5, slider=(0.5, 100.0)),
    ] = 0.02
    """1-sigma noise of a reflector's measured range."""
    bearing_sigma: Annotated[
        float,
        Quantity(label="Bearing 1σ", unit="rad", shown=DEGREES, bounds=POSITIVE, step=0.01, slider=(0.01, 3.0)),
    ] = 0.004
    """1-sigma noise of a reflector's measured bearing."""
    range_bias: Annotated[
        float,
        Quantity(
            label="Range bias",
            unit="m",
            shown=MILLIMETRES,
            bounds=Bounds.between(-1.0, 1.0),
            step=1.0,
            slider=(-100.0, 100.0),
        ),
    ] = 0.0
    """What the scanner adds to the true range of a reflector; it is subtracted. Reflective tape often causes it."""

    def __post_init__(self) -> None:
        check_fields(self, "observation.")


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryParameters:
    """Growth of the uncertainty while driving (Q of equation 1), independent of how finely odometry is sampled."""

    forward_per_sqrt_m: Annotated[float, FORWARD_PER_SQRT_M] = 0.05
    """1-sigma error along the motion after one metre driven: wheels of a slightly other diameter, slip, worn tires."""
    lateral_per_sqrt_m: Annotated[float, LATERAL_PER_SQRT_M] = 0.03
    """1-sigma error across the motion after one metre driven: wheels that are not quite parallel, slip in curves."""
    heading_per_sqrt_m: Annotated[float, HEADING_PER_SQRT_M] = 0.02
    """1-sigma heading error after one metre driven: wheels of unequal diameter, steering that is not quite straight."""
    heading_per_sqrt_rad: Annotated[float, HEADING_PER_SQRT_RAD] = 0.02
    """1-sigma heading error after turning one radian: a wheel separation or gyroscope slightly off."""
    forward_per_sqrt_s: Annotated[float, FORWARD_PER_SQRT_S] = 0.0005
    """1-sigma error along the vehicle's axis after one second, even at rest: the resolution of encoders, vibration."""
    heading_per_sqrt_s: Annotated[float, HEADING_PER_SQRT_S] = 0.0002
    """1-sigma heading error after one second, even at rest: noise of a gyroscope, vibration."""
    acceleration: Annotated[
        float,
        Quantity(
            label="Acceleration",
            unit="m/s^2",
            shown=Shown("m/s²", 1.0),
            bounds=NOT_NEGATIVE,
            step=0.05,
            slider=(0.0, 5.0),
        ),
    ] = 0.5
    """1-sigma acceleration that a vehicle may have when a scan is not followed by odometry in time."""
    turn_acceleration: Annotated[
        float,
        Quantity(
            label="Turning",
            unit="rad/s^2",
            shown=Shown("°/s²", DEGREES.scale),
            bounds=NOT_NEGATIVE,
            step=1.0,
            slider=(0.0, 500.0),
        ),
    ] = 1.0
    """1-sigma turning acceleration that a vehicle may have when a scan is not followed by odometry in time."""
    gap_speed: Annotated[
        float, Quantity(label="Speed in a gap", unit="m/s", bounds=NOT_NEGATIVE, step=0.1, slider=(0.0, 5.0))
    ] = 1.5
    """Largest speed of the vehicle: what it may have driven where odometry is missing is unknown up to it."""
    gap_turn_rate: Annotated[
        float,
        Quantity(
            label="Turn in a gap",
            unit="rad/s",
            shown=Shown("°/s", DEGREES.scale),
            bounds=NOT_NEGATIVE,
            step=1.0,
            slider=(0.0, 360.0),
        ),
    ] = 1.0
    """Fastest turn of the vehicle: how far it may have turned where odometry is missing is unknown up to it."""
    forward_scale: Annotated[
        float,
        Quantity(label="Distance scale", shown=PERCENT, bounds=_SCALE, step=0.01, slider=(-10.0, 10.0)),
    ] = 0.0
    """Share by which the true way is longer than odometry says: wheels that are larger than the vehicle knows."""
    turn_scale: Annotated[
        float,
        Quantity(label="Turn scale", shown=PERCENT, bounds=_SCALE, step=0.01, slider=(-10.0, 10.0)),
    ] = 0.0
    """Share by which true turns are larger than odometry says: wheels that are closer together than the vehicle
    knows."""
    turn_per_m: Annotated[
        float,
        Quantity(
            label="Course off by",
            unit="rad/m",
            shown=Shown("°/m", DEGREES.scale),
            bounds=_SCALE,
            step=0.001,
            slider=(-3.0, 3.0),
        ),
    ] = 0.0
    """True turn to the left with each metre forward beyond what odometry says: a left wheel that is smaller than the
    right one."""

    def __post_init__(self) -> None:
        check_fields(self, "odometry.")


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorParameters:
    """From a scan to detections (Algorithm 2) and the detector filter (equation 3)."""

    enabled: Annotated[bool, Switch("Detector filter")] = True
    """Whether clusters with too few or too many beams for a reflector at their range are rejected (detector filter)."""
    intensity_threshold: Annotated[
        float,
        # No slider: sensors count to 1, 254 or 65,535, and the line of the sensor view is dragged over what they say.
        Quantity(label="Intensity from", unit="sensor's unit", shown=Shown("", 1.0), step=0.01),
    ] = 0.5
    """Echo strength from which a beam counts as reflective, where the scanner gives no flag."""
    far_threshold: Annotated[
        float,
        Quantity(
            label="Intensity, far", shown=PERCENT, bounds=Bounds.between(0.0, 10.0), step=1.0, slider=(0.0, 200.0)
        ),
    ] = 1.0
    """What of `intensity_threshold` it takes at `far_distance` and beyond; less and less on the way there: echoes of
    reflectors fade with the distance."""
    far_distance: Annotated[
        float, Quantity(label="Far from", unit="m", bounds=POSITIVE, step=0.5, slider=(1.0, 50.0))
    ] = 10.0
    """Range from which on `far_threshold` holds."""
    min_model_error: Annotated[
        int,
        Quantity(
            label="Beams too few", unit="beams", shown=Shown("", 1.0), bounds=NOT_NEGATIVE, step=1, slider=(0, 20)
        ),
    ] = 1
    """Beams that a cluster may have fewer than the fewest expected."""
    max_model_error: Annotated[
        int,
        Quantity(
            label="Beams too many", unit="beams", shown=Shown("", 1.0), bounds=NOT_NEGATIVE, step=1, slider=(0, 20)
        ),
    ] = 2
    """Beams that a cluster may have more than the most expected."""
    range_jump: Annotated[
        float,
        Quantity(label="Range jump", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=10.0, slider=(10.0, 1000.0)),
    ] = 0.25
    """Difference in range between neighboring beams that separates two clusters."""
    expected_beams: Annotated[str, Choice("Beams expected by", ("beam_width", "equation_3"))] = "beam_width"
    """Beams that a reflector is expected to show: `beam_width` reckons with width and aperture of a beam, `equation_3`
    is the paper's, without them."""
    center: Annotated[str, Choice("Center from", ("circle", "central_beam"))] = "circle"
    """Center of a reflector from its cluster: `circle` fits a circle of known radius, `central_beam` is the paper's."""

    def __post_init__(self) -> None:
        check_fields(self, "detector.")


@dataclass(frozen=True, slots=True)
class AssociationParameters:
    """Which reflector a detection belongs to, and the association filter (Algorithm 3)."""

    enabled: Annotated[bool, Switch("Association filter")] = True
    """Whether detections outside the validation gate of their likeliest reflector are rejected (association filter)."""
    gate_probability: Annotated[float, _gate("Gate")] = 0.95
    """Probability that a true detection falls inside the validation gate, P_G."""
    method: Annotated[str, Choice("Associated by", ASSOCIATION_METHODS)] = "exclusive"
    """How: `nearest` lets several detections be of one reflector (the paper), `exclusive` keeps the nearest of them,
    `careful` leaves out all that contradict each other, `joint` takes the most that fit together (JCBB),
    `several_scans` lets up to six poses go along until scans tell which is right: for few detections a scan."""

    def __post_init__(self) -> None:
        check_fields(self, "association.")


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterParameters:
    """How detections correct the pose."""

    kind: Annotated[str, Choice("Corrected by", FILTER_KINDS)] = "ekf"
    """Filter: `ekf` is the paper's, `ukf` and `ckf` use sigma points, `invariant` takes an error of the pose for a
    motion of the plane: consistent also where one reflector comes in sight after a long way without any."""
    consider: Annotated[bool, Switch("Consider constant errors")] = True
    """Whether errors of map, mounting, range and clock (the project's uncertainty) are known not to average out."""

    def __post_init__(self) -> None:
        check_fields(self, "filter.")


@dataclass(frozen=True, slots=True, kw_only=True)
class ContourParameters:
    """Contours of the floor map that scans are matched with (Perfect Match)."""

    enabled: Annotated[bool, Switch("Contours")] = False
    """Whether scans are matched with the walls of the floor map, beside reflectors or without any."""
    method: Annotated[str, Choice("Matched by", ("gauss_newton", "rprop"))] = "gauss_newton"
    """How the best pose is found: `gauss_newton` in few steps, `rprop` is the paper's."""
    length: Annotated[
        float,
        Quantity(
            label="Cost flat from", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=10.0, slider=(20.0, 1000.0)
        ),
    ] = 0.1
    """Distance from a contour at which a beam's cost is half of what it may be at most, L: beams that are farther off
    count less and less."""
    iterations: Annotated[
        int,
        Quantity(
            label="Iterations",
            unit="steps",
            shown=Shown("", 1.0),
            bounds=Bounds.between(1, 1000),
            step=1,
            slider=(5, 100),
        ),
    ] = 50
    """Steps of a match at most: what bounds its time."""
    smallest_step: Annotated[
        float,
        Quantity(label="Ends below", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=0.01, slider=(0.01, 10.0)),
    ] = 0.0001
    """A match ends when its step is smaller."""
    largest_error: Annotated[
        float,
        Quantity(label="Matched to", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=10.0, slider=(50.0, 1000.0)),
    ] = 0.5
    """Beams farther from a contour are never matched; nearer ones by the histogram of their errors."""
    beam_sigma: Annotated[
        float, Quantity(label="Beam 1σ", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=0.5, slider=(1.0, 100.0))
    ] = 0.02
    """1-sigma noise of a beam's end across a contour; what matched beams show counts where it is more."""
    map_sigma: Annotated[
        float, Quantity(label="Map 1σ", unit="m", shown=MILLIMETRES, bounds=NOT_NEGATIVE, step=0.5, slider=(0.0, 200.0))
    ] = 0.01
    """1-sigma error of the map's contours where the vehicle is, along each axis: no number of beams averages it out."""
    map_heading_sigma: Annotated[
        float,
        Quantity(label="Map turned 1σ", unit="rad", shown=DEGREES, bounds=NOT_NEGATIVE, step=0.01, slider=(0.0, 3.0)),
    ] = 0.002
    """1-sigma error of the directions of the map's contours where the vehicle is."""
    map_correlation: Annotated[
        float, Quantity(label="Map alike over", unit="m", bounds=POSITIVE, step=0.5, slider=(0.5, 100.0))
    ] = 5.0
    """Way over which the map's error stays alike: after it, what is left of it is a third."""
    depth_sigma: Annotated[
        float,
        Quantity(
            label="Drawn thick 1σ", unit="m", shown=MILLIMETRES, bounds=NOT_NEGATIVE, step=1.0, slider=(0.0, 150.0)
        ),
    ] = 0.05
    """How thick the map may draw its walls: 1-sigma of how far behind the drawn faces beams end. A map that scans have
    drawn does so; it is learned while driving. 0: faces are where beams end."""
    least_matched: Annotated[
        float, Quantity(label="Matched at least", shown=PERCENT, bounds=SHARE, step=1.0, slider=(0.0, 100.0))
    ] = 0.3
    """Share of a scan's beams that must lie on contours; of fewer, nothing is used."""
    least_share: Annotated[
        float, Quantity(label="Direction told by", shown=PERCENT, bounds=SHARE, step=0.5, slider=(0.0, 20.0))
    ] = 0.05
    """Share of the matched beams that must tell a direction: along a corridor, no information is taken from walls."""
    gate_probability: Annotated[float, _gate("Accepted to")] = 0.999
    """Probability that a true match falls inside the validation gate."""

    def seen_of(self, floor: FloorMap | None) -> FloorMap | None:
        """Return the floor map whose walls scans are matched with; None: they are not.

        Parameters
        ----------
        floor : of the site.
        """
        return floor if self.enabled else None

    def __post_init__(self) -> None:
        check_fields(self, "contour.")


@dataclass(frozen=True, slots=True, kw_only=True)
class TagParameters:
    """Tags, each of which tells place and heading at once."""

    enabled: Annotated[bool, Switch("Tags")] = True
    """Whether tags that a camera sees correct the pose, where the site has any."""
    position_sigma: Annotated[
        float,
        Quantity(label="Tag seen 1σ", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=0.5, slider=(1.0, 100.0)),
    ] = 0.02
    """1-sigma noise of a tag's measured place, each axis of the camera, where the recording does not say it."""
    heading_sigma: Annotated[
        float,
        Quantity(label="Tag turned 1σ", unit="rad", shown=DEGREES, bounds=POSITIVE, step=0.01, slider=(0.1, 10.0)),
    ] = 0.02
    """1-sigma noise of a tag's measured heading, where the recording does not say it."""
    gate_probability: Annotated[float, _gate("Tag gate")] = 0.999
    """Probability that a true sighting falls inside the validation gate, of three degrees of freedom."""

    def __post_init__(self) -> None:
        check_fields(self, "tag.")


@dataclass(frozen=True, slots=True, kw_only=True)
class BearingParameters:
    """Bearings alone, as a goniometer measures them of reflectors: each is a row of its own, at its own time."""

    enabled: Annotated[bool, Switch("Bearings alone")] = True
    """Whether bearings of a goniometer correct the pose, where the vehicle has one."""
    gate_probability: Annotated[float, _gate("Bearing gate")] = 0.999
    """Probability that a true bearing falls inside the validation gate, of one degree of freedom."""
    lasting_limit: Annotated[
        float, Quantity(label="Mean innovation to", unit="σ", bounds=NOT_NEGATIVE, step=0.5, slider=(0.0, 20.0))
    ] = 5.0
    """Multiple of what noise and constants explain: beyond it, innovations of a reflector do not average out, and the
    supervisor stops the vehicle; 0: it does not look."""
    lasting_window: Annotated[
        float, Quantity(label="Mean over", unit="s", bounds=POSITIVE, step=1.0, slider=(1.0, 120.0))
    ] = 20.0
    """Time after which a bearing counts a third in that mean."""

    def __post_init__(self) -> None:
        check_fields(self, "bearing.")


HELD_TWO_SIGMA, HELD_LEVEL = "two_sigma", "protection_level"
"""What the supervisor may hold against its limits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TemporaryParameters:
    """Temporary landmarks: reels and corners of goods that come and go ("Gold-fish SLAM")."""

    enabled: Annotated[bool, Switch("Temporary landmarks")] = False
    """Whether reels and corners that a scan shows are landmarks until they are forgotten, beside what is fixed."""
    most: Annotated[
        int,
        Quantity(
            label="Remembered at most",
            unit="landmarks",
            shown=Shown("", 1.0),
            bounds=Bounds.between(0, 200),
            step=1,
            slider=(0, 100),
        ),
    ] = 40
    """Temporary landmarks at most; the one seen longest ago makes room. 0: none are remembered."""
    least_radius: Annotated[
        float, Quantity(label="Reel radius from", unit="m", bounds=POSITIVE, step=0.01, slider=(0.05, 1.0))
    ] = 0.3
    """Radius of the smallest reel."""
    largest_radius: Annotated[
        float, Quantity(label="Reel radius to", unit="m", bounds=POSITIVE, step=0.01, slider=(0.1, 3.0))
    ] = 0.9
    """Radius of the largest reel."""
    fewest_points: Annotated[
        int,
        Quantity(
            label="Beams on it",
            unit="beams",
            shown=Shown("", 1.0),
            bounds=Bounds.between(3, 1000),
            step=1,
            slider=(3, 50),
        ),
    ] = 8
    """Beams that must meet a reel or a corner."""
    least_arc: Annotated[
        float,
        Quantity(label="Arc from", unit="rad", shown=DEGREES, bounds=POSITIVE, step=1.0, slider=(10.0, 180.0)),
    ] = 1.4
    """Arc angle of a reel that must be in sight: less is hidden too much, or no reel."""
    largest_arc: Annotated[
        float,
        Quantity(label="Arc to", unit="rad", shown=DEGREES, bounds=POSITIVE, step=1.0, slider=(90.0, 360.0)),
    ] = 3.5
    """Arc angle of a reel that can be in sight: more is a corner that was taken for a circle."""
    largest_residual: Annotated[
        float,
        Quantity(label="Residual to", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=1.0, slider=(5.0, 200.0)),
    ] = 0.04
    """Largest root mean square of the distances of beams from their circle, or from a side of their corner."""
    corners: Annotated[bool, Switch("Corners")] = True
    """Whether right-angled corners that stand out (pillars, pallets, boxes) are landmarks, too."""
    least_side: Annotated[
        float, Quantity(label="Sides from", unit="m", bounds=POSITIVE, step=0.05, slider=(0.05, 2.0))
    ] = 0.25
    """Length in sight of the shorter side of a corner."""
    largest_side: Annotated[
        float, Quantity(label="Sides to", unit="m", bounds=POSITIVE, step=0.1, slider=(0.2, 10.0))
    ] = 2.0
    """Length in sight of the longer side of a corner."""
    corner_tolerance: Annotated[
        float,
        Quantity(label="Square within", unit="rad", shown=DEGREES, bounds=POSITIVE, step=0.5, slider=(1.0, 30.0)),
    ] = 0.15
    """How far the two sides of a corner may be from a right angle."""
    gap: Annotated[
        float, Quantity(label="Cut at gaps of", unit="m", bounds=POSITIVE, step=0.05, slider=(0.05, 2.0))
    ] = 0.3
    """Distance of neighboring beams' ends from which on they are of two things."""
    beam_sigma: Annotated[
        float,
        Quantity(label="Beam end 1σ", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=0.5, slider=(1.0, 100.0)),
    ] = 0.02
    """1-sigma noise of a beam's end; what the beams of a reel show counts where it is more."""
    position_sigma: Annotated[
        float,
        Quantity(label="Landmark 1σ", unit="m", shown=MILLIMETRES, bounds=NOT_NEGATIVE, step=0.5, slider=(0.0, 100.0)),
    ] = 0.01
    """1-sigma noise of a measured place besides that of its beams, each axis."""
    gate_probability: Annotated[float, _gate("Landmark gate")] = 0.99
    """Probability that a true sighting of a landmark falls inside the validation gate."""
    confirmations: Annotated[
        int, Quantity(label="Born after", unit="scans", bounds=Bounds.between(1, 100), step=1, slider=(1, 20))
    ] = 3
    """Scans that must see a thing in one place until it is a landmark: what is carried is none."""
    misses: Annotated[
        int, Quantity(label="Gone after", unit="scans", bounds=Bounds.between(1, 1000), step=1, slider=(1, 20))
    ] = 3
    """Scans in a row that see past a landmark, or another thing in its place, until it is forgotten."""
    forget_after: Annotated[
        float, Quantity(label="Forgotten after", unit="s", bounds=POSITIVE, step=1.0, slider=(1.0, 600.0))
    ] = 60.0
    """Time after which a landmark that was not seen again is forgotten."""
    largest_sigma: Annotated[
        float, Quantity(label="Forgotten from 1σ", unit="m", bounds=POSITIVE, step=0.1, slider=(0.1, 10.0))
    ] = 1.0
    """1-sigma of its place, in any direction, from which on a landmark is forgotten."""
    reach: Annotated[
        float, Quantity(label="Remembered to", unit="m", bounds=POSITIVE, step=1.0, slider=(5.0, 200.0))
    ] = 30.0
    """Distance from the vehicle up to which landmarks are looked for and remembered."""

    def __post_init__(self) -> None:
        check_fields(self, "temporary.")
        for what, unit in (("radius", "m"), ("arc", "rad"), ("side", "m")):
            least, largest = getattr(self, f"least_{what}"), getattr(self, f"largest_{what}")
            if not least < largest:
                raise ValueError(
                    f"temporary.least_{what} is {least:g} {unit} and temporary.largest_{what} {largest:g} {unit}; "
                    "expected the smaller one first"
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class SupervisorParameters:
    """When the estimate is no longer good enough to drive on (Algorithm 4)."""

    enabled: Annotated[bool, Switch("Supervisor")] = True
    """Whether the supervisor may stop the vehicle."""
    position_limit: Annotated[
        float,
        Quantity(label="2σ position", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=1.0, slider=(5.0, 500.0)),
    ] = 0.1
    """Largest allowed 2-sigma of the position, Err_p."""
    position_sigma: Annotated[str, Choice("Position σ", ("largest", "axes"))] = "largest"
    """Which one: the `largest` in any direction (longer axis of the ellipse), or of the `axes` x and y (the paper)."""
    held: Annotated[str, Choice("Held against limits", (HELD_TWO_SIGMA, HELD_LEVEL))] = HELD_TWO_SIGMA
    """What is held against both limits: `two_sigma` of the filter, or the `protection_level`, which bounds the error at
    the integrity risk even where one reflector misleads. Predictions along routes go by 2σ."""
    heading_limit: Annotated[
        float,
        Quantity(label="2σ heading", unit="rad", shown=DEGREES, bounds=POSITIVE, step=0.1, slider=(0.1, 15.0)),
    ] = 0.05236  # 3 degrees, as a file has it
    """Largest allowed 2-sigma of the heading, Err_o."""
    recovery_ratio: Annotated[
        float, Quantity(label="Recovery ratio", bounds=Bounds.at_least(1.0), step=0.1, slider=(1.0, 10.0))
    ] = 2.0
    """The vehicle may drive again once every 2-sigma is below its limit divided by this ratio, R_B."""
    rejection_enabled: Annotated[bool, Switch("Lost by rejections")] = True
    """Whether a vehicle whose detections fit no reflector counts as lost, however small its covariance is."""
    rejection_window: Annotated[
        float, Quantity(label="Window", unit="s", bounds=POSITIVE, step=0.1, slider=(0.1, 10.0))
    ] = 0.6
    """Time after which a detection counts a third in the share near reflectors; longer where there are few."""
    rejection_long_window: Annotated[
        float, Quantity(label="Window of all", unit="s", bounds=POSITIVE, step=0.5, slider=(0.5, 30.0))
    ] = 3.0
    """The same for the share of all rejected ones: longer, as a shiny thing alone in sight is rejected for a while."""
    rejection_evidence: Annotated[
        float, Quantity(label="Evidence", unit="detections", bounds=Bounds.at_least(1.0), step=1.0, slider=(5.0, 100.0))
    ] = 12.0
    """Detections that the share near reflectors is taken of at least, and that of all in proportion to its window: a
    few rejected ones mean nothing."""
    rejection_reach: Annotated[
        float, Quantity(label="Near a reflector", unit="m", bounds=POSITIVE, step=0.1, slider=(0.1, 5.0))
    ] = 0.8
    """Distance up to which a rejected detection is near a reflector of the map: that one, seen from a wrong pose."""
    rejection_turn: Annotated[
        float,
        Quantity(label="Near, heading", unit="rad", shown=DEGREES, bounds=NOT_NEGATIVE, step=0.5, slider=(0.0, 20.0)),
    ] = 0.1
    """Angle that adds to that distance with the range: a wrong heading moves far reflectors farther."""
    rejection_harmless: Annotated[
        float, Quantity(label="Harmless up to", shown=PERCENT, bounds=SHARE, step=5.0, slider=(0.0, 100.0))
    ] = 0.4
    """Share of the limits of 2σ: a rejected detection that such an error explains is no sign of being lost, unless
    several together tell of one larger error. A turn explains nothing along the line of sight."""
    rejection_near_limit: Annotated[
        float,
        Quantity(label="Rejected near", shown=PERCENT, bounds=Bounds.inside(0.0, 1.0), step=1.0, slider=(5.0, 95.0)),
    ] = 0.42
    """Share of rejected detections near reflectors, among those and the accepted, beyond which the vehicle is lost."""
    rejection_limit: Annotated[
        float,
        Quantity(label="Rejected at all", shown=PERCENT, bounds=Bounds.inside(0.0, 1.0), step=1.0, slider=(5.0, 95.0)),
    ] = 0.7
    """Share of all rejected detections, false ones among people and shiny things too, beyond which it is lost."""
    rejection_scans: Annotated[
        int, Quantity(label="Against it", unit="scans", bounds=Bounds.at_least(1.0), step=1, slider=(3, 50))
    ] = 10
    """Scans in a row that reject three detections or more, and accept at most a quarter as many, until it is lost: a
    vehicle that was carried away is told sooner than by any share."""
    doubt_ratio: Annotated[
        float, Quantity(label="Doubt from", bounds=Bounds.at_least(1.0), step=0.1, slider=(1.0, 10.0))
    ] = 2.0
    """Multiple of the limits: where a 2σ passes it before a scan, any reflector is accepted, and its pose must prove
    right. So after missing odometry, or long without reflectors."""
    confirmations: Annotated[
        int, Quantity(label="Proven by", unit="detections", bounds=NOT_NEGATIVE, step=1, slider=(0, 100))
    ] = 20
    """Detections accepted after such doubt until the vehicle may drive; 0: none, as Algorithm 4 has it."""
    find_again: Annotated[bool, Switch("Search when lost")] = True
    """Whether a lost vehicle looks for its pose in the whole map, and is lost until one is left. If not, it is believed
    again as soon as its detections fit."""

    def __post_init__(self) -> None:
        check_fields(self, "supervisor.")


@dataclass(frozen=True, slots=True, kw_only=True)
class IntegrityParameters:
    """What the protection level is reckoned with."""

    risk: Annotated[
        float,
        Quantity(
            label="Integrity risk",
            shown=PERCENT,
            bounds=Bounds.inside(0.0, 0.5),
            step=0.0001,
            slider=(0.0001, 1.0),
            decimals=9,
        ),
    ] = 1e-5
    """Share of the cycles in which the error may be larger than the protection level, where one reflector misleads."""
    fault_probability: Annotated[
        float,
        Quantity(
            label="Misleading",
            shown=PERCENT,
            bounds=Bounds.inside(0.0, 1.0),
            step=0.01,
            slider=(0.01, 10.0),
            decimals=7,
        ),
    ] = 1e-3
    """Probability that a reflector in sight misleads: moved since the survey, or another thing taken for it."""

    def __post_init__(self) -> None:
        check_fields(self, "integrity.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """All tunables of the localizer."""

    observation: Annotated[ObservationParameters, Group("Noise of a detection")] = field(
        default_factory=ObservationParameters
    )
    """Noise of a detected reflector."""
    odometry: Annotated[OdometryParameters, Group("Noise of odometry")] = field(default_factory=OdometryParameters)
    """Growth of the uncertainty while driving."""
    detector: Annotated[DetectorParameters, Group("Detector")] = field(default_factory=DetectorParameters)
    """From a scan to detections."""
    association: Annotated[AssociationParameters, Group("Association")] = field(default_factory=AssociationParameters)
    """From detections to reflectors."""
    filter: Annotated[FilterParameters, Group("Filter")] = field(default_factory=FilterParameters)
    """From reflectors to a pose."""
    supervisor: Annotated[SupervisorParameters, Group("Supervisor limits")] = field(
        default_factory=SupervisorParameters
    )
    """When to stop the vehicle."""
    contour: Annotated[ContourParameters, Group("Contours")] = field(default_factory=ContourParameters)
    """What walls say."""
    tag: Annotated[TagParameters, Group("Tags")] = field(default_factory=TagParameters)
    """What tags say."""
    bearing: Annotated[BearingParameters, Group("Bearings")] = field(default_factory=BearingParameters)
    """What bearings alone say."""
    temporary: Annotated[TemporaryParameters, Group("Temporary landmarks")] = field(default_factory=TemporaryParameters)
    """What goods that come and go say."""
    integrity: Annotated[IntegrityParameters, Group("Protection level")] = field(default_factory=IntegrityParameters)
    """How sure a bound of the error has to be."""
