"""What a recording holds, kind by kind: how many records, at which rate, over which time, with which values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray
from commission.site.quantity import PERCENT, PLAIN_DEGREES, counted_text, number_text
from commission.site.record_log import RecordLog
from commission.site.record_store import ScanStore

RATE_NS = 200_000_000
"""Time over which a speed is taken [ns]: rows that were stamped as they arrived lie unevenly, some close together."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """All records of one kind."""

    name: str
    """What they are."""
    records: int
    """How many."""
    begin_s: float
    """Time of the first one after the recording's first record [s]."""
    end_s: float
    """The same of the last one [s]."""
    rate: float
    """Records per second, by the median time between two; NaN of fewer than two."""
    longest_pause_s: float
    """Longest time between two [s]; NaN of fewer than two."""
    values: str
    """Ranges of what they measure, with units."""

    @property
    def text(self) -> str:
        """All of it in one line."""
        pace = f", {number_text(self.rate, 4)}/s, longest pause {number_text(self.longest_pause_s)} s"
        pace = "" if np.isnan(self.rate) else pace
        return f"{self.records} from {self.begin_s:.2f} to {self.end_s:.2f} s{pace}; {self.values}"


def channels(log: RecordLog) -> tuple[Channel, ...]:
    """Return what a recording holds, one entry for each kind of record that it has."""
    found: list[Channel] = []
    if len(log.odometry_stamps_ns):
        found.append(_channel(log, "odometry", log.odometry_stamps_ns, _odometry_values(log)))
    of_row = np.repeat(log.detection_scanners, np.diff(log.detection_offsets))
    for index, name in enumerate(log.scanners):
        stamps = log.detection_stamps_ns[log.detection_scanners == index]
        if len(stamps):
            seen = log.range_bearing[of_row == index]
            values = counted_text(len(seen), "reflector")
            if len(seen):
                values += f", {_spans(seen, ('range', 'bearing'), ('m', 'rad'))}"
            found.append(_channel(log, _called(log, "detections", name), stamps, values))
    for scans in log.scans:
        if len(scans):
            called = _called(log, "scans", log.scanners[scans.scanner])
            found.append(_channel(log, called, scans.stamps_ns, _scan_values(scans)))
    if len(log.tags):
        values = f"{counted_text(len(log.tags.ids), 'tag')} seen"
        if len(log.tags.ids):
            values += f", {_spans(log.tags.sightings[:, :3], ('x', 'y', 'theta'), ('m', 'm', 'rad'))}"
        found.append(_channel(log, "tags", log.tags.stamps_ns, values))
    if len(log.bearings):
        met = log.bearings.bearings[np.isfinite(log.bearings.bearings)]
        values = counted_text(len(met), "reflex", "reflexes")
        if len(met):
            values += f", {_spans(met[:, np.newaxis], ('bearing',), ('rad',))}"
        found.append(_channel(log, "bearings", log.bearings.stamps_ns, values))
    if len(log.reference_stamps_ns):
        values = _spans(log.reference_poses, ("x", "y", "theta"), ("m", "m", "rad"))
        found.append(_channel(log, "reference", log.reference_stamps_ns, values))
    return tuple(found)


def _called(log: RecordLog, kind: str, scanner: str) -> str:
    """What records of one scanner are called; its name matters where there are several."""
    return kind if len(log.scanners) == 1 else f"{kind} of {scanner}"


def _channel(log: RecordLog, name: str, stamps_ns: IntArray, values: str) -> Channel:
    zero = log.first_ns
    steps = np.diff(stamps_ns) * 1e-9
    positive = steps[steps > 0.0]
    return Channel(
        name=name,
        records=len(stamps_ns),
        begin_s=(int(stamps_ns[0]) - zero) * 1e-9,
        end_s=(int(stamps_ns[-1]) - zero) * 1e-9,
        rate=1.0 / float(np.median(positive)) if len(positive) else float("nan"),
        longest_pause_s=float(steps.max()) if len(steps) else float("nan"),
        values=values,
    )


def rates(stamps_ns: IntArray, amounts: FloatArray) -> FloatArray:
    """(M,) amount in a second, over the time that follows each row.

    Parameters
    ----------
    stamps_ns : (N,) stamps of rows, ascending [ns].
    amounts : (N,) what came since the row before [m] or [rad].

    Returns
    -------
    rates : one for each row from which on there is such a time; of a shorter recording the one over all of it; empty
        where no time passes.
    """
    if len(stamps_ns) < 2 or stamps_ns[-1] <= stamps_ns[0]:
        return np.empty(0)
    passed = np.cumsum(amounts)
    ends = np.searchsorted(stamps_ns, stamps_ns + RATE_NS)
    begins = np.flatnonzero(ends < len(stamps_ns))
    if not len(begins):
        begins, ends = np.array([0]), np.array([len(stamps_ns) - 1])
    ends = ends[begins]
    return (passed[ends] - passed[begins]) / ((stamps_ns[ends] - stamps_ns[begins]) * 1e-9)


def _odometry_values(log: RecordLog) -> str:
    ways = np.hypot(log.displacements[:, 0], log.displacements[:, 1])
    speeds = rates(log.odometry_stamps_ns, ways)
    turns = rates(log.odometry_stamps_ns, np.abs(log.displacements[:, 2]))
    if not len(speeds):
        return "no motion"
    way = float(ways.sum())
    fastest = f"speed up to {number_text(speeds.max())} m/s, turning up to {number_text(turns.max())} rad/s"
    return f"{way:.1f} m driven, {fastest}"


def _scan_values(scans: ScanStore) -> str:
    chosen = np.unique(np.linspace(0, len(scans.stamps_ns) - 1, 200).astype(int))
    some = scans.chosen(chosen)
    ranges = np.asarray(some.ranges, dtype=np.float64)
    hit = np.isfinite(ranges)
    parts = [
        f"{beams_in_words(scans.beams)} {PLAIN_DEGREES.text(np.median(np.abs(scans.angle_increment)), '.4g')} apart"
    ]
    if hit.any():
        parts.append(f"range {number_text(ranges[hit].min(), 4)} to {number_text(ranges[hit].max(), 4)} m")
    if some.intensities is not None and hit.any():
        strengths = np.asarray(some.intensities, dtype=np.float64)[hit]
        parts.append(f"intensity {number_text(strengths.min(), 4)} to {number_text(strengths.max(), 4)}")
    if some.reflector is not None:
        parts.append(f"{PERCENT.text(float(np.mean(some.reflector)), '.2g')} of the beams flagged as reflector")
    return ", ".join(parts)


def beams_in_words(beams: IntArray) -> str:
    """How many beams scans have: `541 beams`, `540 to 542 beams`."""
    fewest, most = int(beams.min()), int(beams.max())
    return counted_text(most, "beam") if fewest == most else f"{fewest} to {most} beams"


def _spans(values: FloatArray, names: tuple[str, ...], units: tuple[str, ...]) -> str:
    """Smallest and largest value of each column; NaN left out."""
    parts: list[str] = []
    for column, (name, unit) in enumerate(zip(names, units, strict=True)):
        known = values[:, column][np.isfinite(values[:, column])]
        parts.append(
            f"{name} {number_text(known.min(), 4)} to {number_text(known.max(), 4)} {unit}"
            if len(known)
            else f"{name} unknown"
        )
    return ", ".join(parts)
