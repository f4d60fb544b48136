"""What clocks of scanners and vehicle show, by when their records arrive at this computer: no motion is needed.

Arrival says by how much two clocks differ, up to the difference of the quickest ways that their records take, which is
not measurable here. It neither localizes nor sets anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray

FEWEST = 50
"""Arrivals below which nothing is said."""
SHORTEST_S = 2.0
"""Time of arrivals below which nothing is said [s]."""
BLOCKS = 20
"""Parts of that time whose quickest arrivals tell how surely the quickest one is known."""
LARGEST_DRIFT = 1e-3
"""Drift beyond which two clocks do not run at one speed [1]."""
FIRST_TICKS = 32
EARLY = 0.1
"""Share of a period by which an arrival may be earlier than the early ones, before it counts as the one before."""
MOST_GAP = 0.2
"""Share of a period within which three quarters of the arrivals of something even come: of chance, half as many."""


@dataclass(frozen=True, slots=True, kw_only=True)
class QuickestArrivals:
    """The quickest arrivals of one source: arrival = device time + offset + drift x (time since the first) + delay."""

    offset_ns: int
    """What is added to the device's time at the first arrival [ns]."""
    drift: float
    """How much faster this computer's clock goes [1]."""
    sigma: float
    """1-sigma of the offset in the middle [s]: by how differently the quickest arrivals of parts of the time came."""
    delay: float
    """Median of how much later than the quickest records arrive [s]."""
    middle_ns: int
    """Time of arrival in the middle [ns]."""
    at_middle_ns: int
    """What is added to the device's time there [ns]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ArrivalOffset:
    """What arrival says of one scanner's clock."""

    scanner: str
    """Name of the scanner."""
    clocks: float | None
    """What the scanner's own clock shows more than the vehicle's [s]; None where one of them says no time. The stamps
    of a live run have it taken out."""
    offset: float | None
    """How much later its scans are stamped than odometry, where one of both is stamped as it arrives and not as the
    quickest of its records would [s]; None where both say a time: what is left of their clocks only motion shows."""
    sigma: float
    """1-sigma of both [s]."""
    drift: float
    """How much slower the scanner's clock goes than the vehicle's [1]; 0 where one of them says no time."""

    def differs_from(self, allowed: float) -> bool:
        """Whether arrival says of a clock [s] that it is another one: by more than 2-sigma, and by a tenth of a ms."""
        return self.offset is not None and abs(self.offset - allowed) > max(2.0 * self.sigma, 1e-4)


def floor_of(device_ns: IntArray, arrived_ns: IntArray) -> QuickestArrivals | None:
    """Return the quickest arrivals of a source; None where there are too few.

    Parameters
    ----------
    device_ns : (N,) times by the device's clock [ns], ascending.
    arrived_ns : (N,) times of arrival [ns].

    Notes
    -----
    The line below all delays whose sum above it is least: an edge of their lower hull, the one over the mean of times
    (Moon, Skelly, Towsley: Estimation and removal of clock skew from network delay measurements, INFOCOM 1999).
    """
    if len(device_ns) < FEWEST or (arrived_ns[-1] - arrived_ns[0]) * 1e-9 < SHORTEST_S:
        return None
    first_ns, delay_ns = int(arrived_ns[0]), arrived_ns - device_ns
    lowest_ns = int(delay_ns.min())
    at = (device_ns - device_ns[0]).astype(np.float64) * 1e-9
    delays = (delay_ns - lowest_ns).astype(np.float64) * 1e-9
    drift, base = line_below(at, delays)
    if abs(drift) > LARGEST_DRIFT:
        drift, base = 0.0, 0.0
    above = delays - base - drift * at
    part = np.minimum((BLOCKS * at / max(float(at[-1]), 1e-9)).astype(np.int64), BLOCKS - 1)
    quickest = np.array([above[part == number].min() for number in np.unique(part)])
    middle = 0.5 * float(at[-1])
    return QuickestArrivals(
        offset_ns=lowest_ns + round(base * 1e9),
        drift=drift,
        # Half of the parts come within the median of the quickest: the quickest of all is surer than a part's.
        sigma=float(np.median(quickest)) / np.sqrt(len(quickest)),
        delay=float(np.median(above)),
        middle_ns=first_ns + round(middle * 1e9),
        at_middle_ns=lowest_ns + round((base + drift * middle) * 1e9),
    )


def ticks_of(arrived_ns: IntArray) -> IntArray | None:
    """Return the times at which something even must have been measured [ns]: of a device that says no time.

    Parameters
    ----------
    arrived_ns : (N,) times of arrival [ns], ascending.

    Returns
    -------
    ticks_ns : (N,) whole numbers of its period; None where the arrivals are not those of something even.
    """
    if len(arrived_ns) < FEWEST:
        return None
    at = (arrived_ns - arrived_ns[0]).astype(np.float64)
    period, base, numbers = float(np.median(np.diff(at))), 0.0, np.zeros(1)
    if period <= 0.0:
        return None
    # Of few arrivals the period is known well enough to number twice as many.
    count = FIRST_TICKS
    while True:
        count = min(count, len(at))
        numbers = _distinct(np.floor((at[:count] - base) / period + EARLY))
        half = count // 2
        apart = numbers[half : 2 * half] - numbers[:half]
        if not (apart > 0.0).all():
            return None
        period = float(np.median((at[half : 2 * half] - at[:half]) / apart))
        base = float(np.quantile(at[:count] - numbers * period, 0.1))
        if count == len(at):
            break
        count *= 2
    left = (at - base) / period - numbers
    if float(np.quantile(np.abs(left - np.median(left)), 0.75)) > MOST_GAP or (np.diff(numbers) < 1).mean() > MOST_GAP:
        return None
    return (numbers * period).astype(np.int64)


def _distinct(numbers: FloatArray) -> FloatArray:
    """Return numbers of which each is before the next one: of two alike, the first arrived late."""
    rows = np.arange(len(numbers), dtype=np.float64)
    return np.minimum.accumulate((numbers - rows)[::-1])[::-1] + rows


def arrival_offset(
    scanner: str, scans: tuple[IntArray | None, IntArray], odometry: tuple[IntArray | None, IntArray]
) -> ArrivalOffset | None:
    """Return what arrival says of a scanner's clock; None where too little has arrived, or nothing even.

    Parameters
    ----------
    scanner : its name.
    scans, odometry : times by the device's clock, None where it says none, and times of arrival [ns].
    """
    floors: list[QuickestArrivals] = []
    for device_ns, arrived_ns in (scans, odometry):
        times = ticks_of(arrived_ns) if device_ns is None else device_ns
        floor = None if times is None else floor_of(times, arrived_ns)
        if floor is None:
            return None
        floors.append(floor)
    seen, driven = floors
    both = scans[0] is not None and odometry[0] is not None
    # Stamps of a source that says no time are late by its delays; those of the others are placed by the quickest.
    late = [0.0 if of[0] is not None else floor.delay for of, floor in zip((scans, odometry), floors, strict=True)]
    apart_ns = driven.at_middle_ns - seen.at_middle_ns
    apart_ns += round((driven.drift) * (seen.middle_ns - driven.middle_ns))
    return ArrivalOffset(
        scanner=scanner,
        clocks=apart_ns * 1e-9 if both else None,
        offset=None if both else late[0] - late[1],
        sigma=float(np.hypot(seen.sigma, driven.sigma)),
        drift=seen.drift - driven.drift if both else 0.0,
    )


def line_below(at: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Return slope and height at 0 of the line below all points that is nearest to them in the sum.

    Parameters
    ----------
    at : (N,) times, ascending.
    values : (N,) what is above the line.
    """
    x, y, hull = at.tolist(), values.tolist(), list[int]()
    for index in range(len(x)):
        if hull and x[index] <= x[hull[-1]]:
            if y[index] >= y[hull[-1]]:
                continue
            hull.pop()
        while len(hull) > 1 and _turns_right(x, y, (hull[-2], hull[-1], index)):
            hull.pop()
        hull.append(index)
    if len(hull) < 2:
        return 0.0, float(values.min(initial=0.0))
    mean = float(at.mean())
    edge = min(max(int(np.searchsorted(at[hull], mean)), 1), len(hull) - 1)
    left, right = hull[edge - 1], hull[edge]
    slope = float((values[right] - values[left]) / (at[right] - at[left]))
    return slope, float(values[left] - slope * at[left])


def _turns_right(at: Sequence[float], values: Sequence[float], points: tuple[int, int, int]) -> bool:
    """Whether the middle one of three points is not below the line through the others."""
    a, b, c = points
    return (at[b] - at[a]) * (values[c] - values[a]) <= (values[b] - values[a]) * (at[c] - at[a])
