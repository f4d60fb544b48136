"""A laser scanner: where it sits on the vehicle, what it sees, and how well. Not its telegrams, not its scans."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, equal_fields, frozen
from commission.site.checks import check_fields
from commission.site.detection_rates import DetectionRates, check_detection_rates
from commission.site.quantity import (
    AS_DEGREES,
    BARE,
    DEGREES,
    MILLIMETRES,
    NOT_NEGATIVE,
    POSITIVE,
    Bounds,
    Choice,
    Quantity,
    Switch,
    Words,
)

LONGEST_RANGE = 10_000.0
"""No laser scanner measures farther [m]."""
NO_RANGE_SIGMA = 1e3
"""1-sigma of the range of what a goniometer meets [m]: as good as unknown in any hall."""
ONLY_NAME = "scanner"
"""What the only scanner of a vehicle is called."""
AS_THE_FILTER = "as the filter"
"""What the noise of detections is called where a scanner has none of its own."""
_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_ -]{0,38}[A-Za-z0-9_-]|[A-Za-z0-9_-]")
_SLACK = 1e-6
"""Share of a period by which a sweep may be longer: both are rounded in files."""
_EDGE = 1e-9
"""Angle by which a blind sector is widened on each side [rad]: the beam on its edge is rounded, too."""


def is_name(text: str) -> bool:
    """Whether a scanner may be called so."""
    return _NAME.fullmatch(text) is not None


class StampOf(StrEnum):
    """Which beam of a sweep was measured at the stamp of its scan."""

    FIRST = "first"
    MIDDLE = "middle"
    LAST = "last"


class ScannerKind(StrEnum):
    """What a scanner measures."""

    LASER = "laser"
    """Ranges along many beams, scan by scan."""
    GONIOMETER = "goniometer"
    """The bearing of each reflector at the moment its turning laser meets it, and no range (Alenya et al. 2005)."""


_ON_A_VEHICLE = Bounds.between(-50.0, 50.0)
"""No vehicle is longer [m]: a scanner farther from base is mounted in another unit."""


def _split(low: float, high: float, first: float, last: float) -> str:
    """Say how a sector across the back of a full turn is given: as two of them [deg]; empty: it is none."""
    if last - first < 360.0 or not first <= low <= last < high:
        return ""
    return f"; across its end it is two: {low:g} {last:g}, {first:g} {high - 360.0:g}"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Scanner:
    """A 2D laser scanner on the vehicle."""

    name: Annotated[str, Words(label="Name")] = ONLY_NAME
    """What it is called in files and results: letters, digits, blanks, - and _."""
    kind: Annotated[ScannerKind, Choice(label="Measures as")] = ScannerKind.LASER
    """What it measures: laser (ranges along beams) or goniometer (bearings of reflectors alone, each at its time)."""
    mounting: Annotated[
        FloatArray,
        Quantity(label="Mounted at x", unit="m", bounds=_ON_A_VEHICLE, decimals=4),
        Quantity(label="Mounted at y", unit="m", bounds=_ON_A_VEHICLE, decimals=4),
        Quantity(label="Faces", unit="rad", shown=DEGREES, step=0.01, decimals=6),
    ] = field(default_factory=lambda: frozen([0.0, 0.0, 0.0], (3,), "scanner.mounting"))
    """(3,) `T_base_scanner`: x, y and heading of the scanner in the base frame."""
    upside_down: Annotated[bool, Switch(label="Upside down")] = False
    """Whether it hangs upside down: its beams then go clockwise, seen from above."""
    field_of_view_deg: Annotated[
        tuple[float, float],
        Quantity(label="First bearing", unit="deg", shown=AS_DEGREES, step=0.1, decimals=6),
        Quantity(label="Last bearing", unit="deg", shown=AS_DEGREES, step=0.1, decimals=6),
    ] = (-135.0, 135.0)
    """First and last bearing, scanner frame, counter-clockwise; a full turn is -180 to 180."""
    blind_sectors_deg: Annotated[
        tuple[tuple[float, float], ...],
        Quantity(label="Blind sectors", unit="deg", shown=AS_DEGREES, bounds=Bounds.between(-360.0, 360.0), decimals=6),
    ] = ()
    """First and last bearing of each sector in which the vehicle itself is in the way, scanner frame; nothing comes
    back from there, and what does is ignored."""
    # The last of thousands of beams is at thousands of steps: one step in a file needs all its digits.
    resolution_deg: Annotated[
        float,
        Quantity(
            label="Resolution",
            unit="deg",
            shown=AS_DEGREES,
            bounds=Bounds.between(0.01, 10.0),
            step=0.0001,
            decimals=12,
        ),
    ] = 0.5
    """Step between neighboring beams."""
    rate: Annotated[
        float,
        Quantity(
            label="Scans per s",
            unit="scans/s",
            shown=BARE,
            bounds=Bounds.between(0.1, 1000.0),
            step=0.01,
            decimals=9,
        ),
    ] = 25.0
    """Scans per second."""
    range: Annotated[
        tuple[float, float],
        Quantity(label="Range from", unit="m", bounds=NOT_NEGATIVE, step=0.01, decimals=4),
        Quantity(label="Range to", unit="m", bounds=Bounds.between(0.0, LONGEST_RANGE), step=0.01, decimals=4),
    ] = (0.05, 30.0)
    """Smallest and largest range at which the scanner measures."""
    range_sigma: Annotated[
        float, Quantity(label="Range 1σ", unit="m", shown=MILLIMETRES, bounds=NOT_NEGATIVE, step=0.1)
    ] = 0.01
    """1-sigma noise of each beam's range."""
    bearing_sigma_deg: Annotated[
        float, Quantity(label="Bearing 1σ", unit="deg", shown=AS_DEGREES, bounds=NOT_NEGATIVE, step=0.001)
    ] = 0.05
    """1-sigma noise of each beam's bearing."""
    detection_range_sigma: Annotated[
        float | None,
        Quantity(label="Detection 1σ", unit="m", shown=MILLIMETRES, bounds=POSITIVE, step=0.5, none=AS_THE_FILTER),
    ] = None
    """1-sigma noise of the range of a reflector that this scanner detects; none: `observation.range_sigma`."""
    detection_bearing_sigma_deg: Annotated[
        float | None,
        Quantity(
            label="Detection 1σ",
            unit="deg",
            shown=AS_DEGREES,
            bounds=POSITIVE,
            step=0.01,
            none=AS_THE_FILTER,
        ),
    ] = None
    """1-sigma noise of the bearing of a reflector that this scanner detects; none: `observation.bearing_sigma`."""
    beam_width_deg: Annotated[
        float, Quantity(label="Beam width", unit="deg", shown=AS_DEGREES, bounds=NOT_NEGATIVE, step=0.01)
    ] = 0.25
    """Divergence of a beam: a reflector is met when any part of the beam touches it."""
    beam_aperture: Annotated[
        float,
        Quantity(label="Beam aperture", unit="m", shown=MILLIMETRES, bounds=Bounds.between(0.0, 1.0), step=0.1),
    ] = 0.0
    """Width of a beam where it leaves the scanner; its divergence comes on top."""
    reflector_range: Annotated[
        float, Quantity(label="Reflectors to", unit="m", bounds=POSITIVE, step=0.1, decimals=4)
    ] = 20.0
    """Range up to which the scanner tells reflectors from other things."""
    detection_rates: Annotated[
        DetectionRates,
        Quantity(
            label="Detection rates", unit="m, 0 to 1", bounds=Bounds.between(0.0, LONGEST_RANGE), step=0.001, decimals=4
        ),
    ] = ()
    """Distances to reflectors in free sight, each with the share of scans in which the scanner tells them from other
    things: linear in between, and the last one beyond; none: in all scans. What the detector rejects comes on top."""
    sweep_duration: Annotated[
        float, Quantity(label="Sweep takes", unit="s", bounds=NOT_NEGATIVE, step=0.001, decimals=9)
    ] = 0.0
    """Time from the first to the last beam of a scan; 0: all are measured at once."""
    sweep_direction: Annotated[int, Quantity(label="Sweep direction", bounds=Bounds.between(-1, 1), step=1)] = 1
    """Way in which the beam turns, scanner frame: 1 counter-clockwise, -1 clockwise."""
    stamp_of: Annotated[StampOf, Choice(label="Stamp of the beam")] = StampOf.FIRST
    """Which beam of the sweep was measured at the stamp of the scan: first, middle or last."""
    clock_offset: Annotated[
        float, Quantity(label="Clock offset", unit="s", bounds=Bounds.between(-10.0, 10.0), step=0.001, decimals=9)
    ] = 0.0
    """What the scanner's clock shows more than the vehicle's."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "mounting", frozen(self.mounting, (3,), "scanner.mounting"))
        check_detection_rates(self.detection_rates, "scanner.detection_rates")
        check_fields(self, "scanner.")
        if not is_name(self.name):
            expected = "1 to 40 letters, digits, blanks (inside), - and _"
            raise ValueError(f"scanner.name is {self.name!r}; expected {expected}")
        self._check_angles()
        if self.sweep_direction == 0:
            raise ValueError("scanner.sweep_direction is 0; expected 1 (counter-clockwise) or -1 (clockwise)")
        if self.sweep_duration * self.rate > 1.0 + _SLACK:
            found = f"scanner.sweep_duration is {self.sweep_duration:g} s at {self.rate:g} scans/s"
            raise ValueError(f"{found}; expected no more than from one scan to the next")
        object.__setattr__(self, "stamp_of", StampOf(self.stamp_of))
        object.__setattr__(self, "kind", ScannerKind(self.kind))

    def _check_angles(self) -> None:
        """Check what two numbers say together: the ends of sectors and of the range."""
        first, last = self.field_of_view_deg
        if not 0.0 < last - first <= 360.0:
            raise ValueError(
                f"scanner.field_of_view_deg is [{first:g}, {last:g}]; expected first < last, at most 360 deg apart"
            )
        for low, high in self.blind_sectors_deg:
            if not 0.0 < high - low <= 360.0:
                found = f"scanner.blind_sectors_deg holds [{low:g}, {high:g}]"
                raise ValueError(f"{found}; expected first < last, at most 360 deg apart")
            if not (first <= low and high <= last):
                found = f"scanner.blind_sectors_deg holds [{low:g}, {high:g}]"
                expected = f"sectors inside of the field of view, {first:g} to {last:g} deg"
                raise ValueError(f"{found}; expected {expected}{_split(low, high, first, last)}")
        for (low, high), (begin, end) in itertools.pairwise(sorted(self.blind_sectors_deg)):
            if begin < high:
                found = f"scanner.blind_sectors_deg holds [{low:g}, {high:g}] and [{begin:g}, {end:g}]"
                raise ValueError(f"{found}; expected sectors that do not overlap")
        nearest, farthest = self.range
        if not nearest < farthest:
            raise ValueError(f"scanner.range is [{nearest:g}, {farthest:g}]; expected smallest < largest range [m]")

    def __eq__(self, other: object) -> bool:
        """Equal when every field is, arrays element by element."""
        return equal_fields(self, other)

    def detection_sigmas(self, range_sigma: float, bearing_sigma: float) -> tuple[float, float]:
        """1-sigma noise of range and bearing of a reflector that this scanner detects [m, rad].

        Parameters
        ----------
        range_sigma, bearing_sigma : those of a scanner that has none of its own [m, rad].
        """
        own_range, own_bearing = self.detection_range_sigma, self.detection_bearing_sigma_deg
        if self.is_goniometer:
            # What it meets is the reflector itself: where nothing else is said, its bearing is as noisy as that.
            own_bearing = own_bearing or self.bearing_sigma_deg or None
            return NO_RANGE_SIGMA, bearing_sigma if own_bearing is None else math.radians(own_bearing)
        return (
            range_sigma if own_range is None else own_range,
            bearing_sigma if own_bearing is None else math.radians(own_bearing),
        )

    @property
    def is_goniometer(self) -> bool:
        """Whether it reports bearings of reflectors alone."""
        return self.kind == ScannerKind.GONIOMETER

    @property
    def angle_min(self) -> float:
        """Bearing of the first beam [rad]."""
        return math.radians(self.field_of_view_deg[0])

    @property
    def angle_increment(self) -> float:
        """Step between neighboring beams [rad]."""
        return math.radians(self.resolution_deg)

    @property
    def is_full_turn(self) -> bool:
        """Whether the last beam is the first one's neighbor."""
        first, last = self.field_of_view_deg
        return last - first > 360.0 - 1.5 * self.resolution_deg

    @property
    def beam_count(self) -> int:
        """Number of beams in one scan; a full turn does not repeat its first beam."""
        first, last = self.field_of_view_deg
        count = math.floor((last - first) / self.resolution_deg + 1e-6) + 1
        return count - 1 if (count - 1) * self.resolution_deg > 360.0 - 0.5 * self.resolution_deg else count

    def upright(self, bearings: FloatArray) -> FloatArray:
        """Bearings [rad] counter-clockwise seen from above, of those that the scanner reports."""
        return -bearings if self.upside_down else bearings

    @property
    def field_of_view(self) -> tuple[float, float]:
        """First and last bearing [rad], scanner frame, counter-clockwise seen from above, however it hangs."""
        first, last = np.sort(self.upright(np.radians(self.field_of_view_deg))).tolist()
        return first, last

    @property
    def blind_sectors(self) -> FloatArray:
        """(B, 2) first bearing and width of each blind sector [rad], scanner frame, upright; edges are blind."""
        return _sectors(np.sort(self.upright(np.radians(np.reshape(self.blind_sectors_deg, (-1, 2)))), axis=1))

    @property
    def reported_blind_sectors(self) -> FloatArray:
        """(B, 2) the same as the scanner reports bearings: mirrored where it hangs upside down."""
        return _sectors(np.radians(np.reshape(self.blind_sectors_deg, (-1, 2))))

    @property
    def views(self) -> FloatArray:
        """(V, 2) first and last bearing of each stretch of the field of view that is not blind [rad], upright."""
        blind = np.sort(self.upright(np.radians(np.reshape(self.blind_sectors_deg, (-1, 2)))), axis=1)
        edges = np.concatenate((self.field_of_view[:1], np.sort(blind, axis=0).ravel(), self.field_of_view[1:]))
        stretches = edges.reshape(-1, 2)
        return stretches[stretches[:, 1] > stretches[:, 0]]

    @property
    def beam_times(self) -> FloatArray:
        """When each beam is measured after the stamp of its scan: (B,) array [s], negative before it."""
        share = np.arange(self.beam_count) / max(self.beam_count - 1, 1)
        if self.sweep_direction < 0:
            share = 1.0 - share
        at_stamp = {StampOf.FIRST: 0.0, StampOf.MIDDLE: 0.5, StampOf.LAST: 1.0}[self.stamp_of]
        return self.sweep_duration * (share - at_stamp)

    @property
    def period_ns(self) -> int:
        """Time between scans [ns]."""
        return round(1e9 / self.rate)


def _sectors(ends: FloatArray) -> FloatArray:
    """(B, 2) first bearing and width of sectors given by both ends [rad]."""
    return np.stack((ends[:, 0] - _EDGE, ends[:, 1] - ends[:, 0] + 2.0 * _EDGE), axis=1)


def scan_moments(scanners: Sequence[Scanner], duration_ns: int) -> tuple[IntArray, IntArray]:
    """Stamps at which scanners scan, and which one does.

    Parameters
    ----------
    scanners : the first begins at once, the others each a share of their period later: those of one rate take turns.
    duration_ns : of the drive [ns].

    Returns
    -------
    stamps_ns, scanners : (K,) arrays in order of time; of equal stamps the first scanner comes first.
    """
    begins = [round(index * scanner.period_ns / len(scanners)) for index, scanner in enumerate(scanners)]
    stamps = [
        np.arange(begin, duration_ns + 1, scanner.period_ns, dtype=np.int64)
        for begin, scanner in zip(begins, scanners, strict=True)
    ]
    indices = np.repeat(np.arange(len(scanners)), [len(each) for each in stamps])
    together = np.concatenate(stamps)
    order = np.argsort(together, kind="stable")
    return together[order], indices[order]
