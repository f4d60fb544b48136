"""Logs of CARMEN (carmen.sourceforge.net/logger_playback.html): a line of text for each scan, pose or motion.

Its stamps are seconds as text, twice in each line: when it was sent, and when it was written. Either may be constant or
start again; which one is read, and what was mended, is told.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from commission.errors import FileFormatError, UsageError
from commission.geometry.arrays import FloatArray, Growing, IntArray
from commission.io.reading import cannot_read
from commission.io.recordings.channels import NO_OPTIONS, ChannelOptions
from commission.io.recordings.collector import Collector, MotionKind
from commission.io.recordings.whole import WholeRecording
from commission.site.record_log import RecordLog
from commission.site.records import Scan
from commission.site.scanner import ONLY_NAME

_FRONT = ("ROBOTLASER1", "RAWLASER1", "FLASER")
_REAR = ("ROBOTLASER2", "RAWLASER2", "RLASER")
_OLD = ("FLASER", "RLASER")
_ODOMETRY, _TRUE = "ODOM", "TRUEPOS"
_KNOWN = (*_FRONT, *_REAR, _ODOMETRY, _TRUE)
_LINE_LIMIT = 2_000_000
"""Bytes of a line: 100,000 beams."""
_LOOKED_AT = 65_536
_NO_RETURN = 81.0
"""Range from which the old messages mean that nothing came back [m]: a SICK LMS says 81.83 or 81.91."""
_WRAPS_S = (10_000.0, 2.0**32 * 1e-6, 2.0**32 * 1e-3)
"""Where stamps start again [s]: those with four digits before the point, and counters of 32 bits."""
_LATEST_S = 4.0e9


@dataclass(frozen=True, slots=True)
class _Line:
    """A message, and its place in the file."""

    number: int
    """Line, from 1 on."""
    kind: str
    """Name of the message."""
    words: list[str]
    """Everything behind the name but host and stamps."""
    stamps_s: tuple[float, float]
    """When it was sent, and when it was written [s]."""


class CarmenLog(WholeRecording):
    """A log of CARMEN; opening it looks at its stamps.

    Parameters
    ----------
    path : where it is.
    options : must say nothing: the messages say what they are.

    Raises
    ------
    FileFormatError
        it cannot be read, or has no message that is read.
    UsageError
        topics are named.
    """

    def __init__(self, path: Path, options: ChannelOptions = NO_OPTIONS) -> None:
        if options != NO_OPTIONS:
            raise UsageError(f"{path} is a CARMEN log; expected --channel and --wheels for recordings with topics only")
        self.path = path
        self._cut: str | None = None
        counts: Counter[str] = Counter()
        stamps: Growing[np.float64] = Growing(np.float64, 2)
        self._unstamped: int | None = None
        """First line without both of its stamps: it ends early, or is none of CARMEN."""
        for line in self._lines():
            counts[line.kind] += 1
            stamps.append(np.array([line.stamps_s]))
            if self._unstamped is None and not np.isfinite(line.stamps_s).any():
                self._unstamped = line.number
        self._chosen = [next((kind for kind in kinds if counts[kind]), None) for kinds in (_FRONT, _REAR)]
        if not counts:
            raise FileFormatError(path, "", "has no message that is read", f"one of: {', '.join(_KNOWN)}")
        lasers = [kind for kind in self._chosen if kind is not None]
        self.scanners: tuple[str, ...] = ("front", "rear") if len(lasers) > 1 else (ONLY_NAME,)
        self._lasers = {kind: index for index, kind in enumerate(lasers)}
        self._has_odometry, self._has_truth = counts[_ODOMETRY] > 0, counts[_TRUE] > 0
        self._stamps_ns, self._notes = self._clock(stamps.array())

    @staticmethod
    def recognizes(path: Path) -> bool:
        """Whether a path is such a log, by its first lines."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            begin = file.read(_LOOKED_AT)
        if b"\0" in begin:
            return False
        words = [line.split(None, 2)[:2] for line in begin.decode("latin-1").splitlines()]
        return any(pair[0] in _KNOWN and len(pair) > 1 and _is_number(pair[1]) for pair in words if pair)

    def load(self) -> RecordLog:
        """Read everything into columns; raises FileFormatError."""
        collector = Collector(self.path, self.scanners, MotionKind.POSES)
        try:
            for line, stamp in zip(self._lines(), self._stamps_ns.tolist(), strict=True):
                try:
                    self._take(collector, line, stamp)
                except (ValueError, IndexError, OverflowError) as error:
                    found = f"is no {line.kind} ({error})"
                    raise FileFormatError(self.path, f"line {line.number}", found, "the numbers of CARMEN") from error
            return collector.log([*self._notes, *([] if self._cut is None else [self._cut])])
        finally:
            collector.close()

    def _take(self, collector: Collector, line: _Line, stamp_ns: int) -> None:
        """Hand a message to the collector."""
        if line.kind == _ODOMETRY:
            collector.add_motion(stamp_ns, _numbers(line.words, 0, 3).tolist())
        elif line.kind == _TRUE:
            x, y, theta = _numbers(line.words, 0, 3).tolist()
            collector.add_reference(stamp_ns, x, y, theta)
        elif line.kind in self._lasers:
            scan, pose = _scan(line, stamp_ns, self._lasers[line.kind])
            collector.add_scan(scan)
            if scan.intensities is None:
                collector.told[f"scans of {line.kind} have no intensities: no reflector can be seen in them"] += 1
            # The second scanner's poses say the same as the first one's.
            if not self._has_odometry and pose is not None and self._lasers[line.kind] == 0:
                collector.add_motion(stamp_ns, pose.tolist())
        else:
            collector.told[f"messages {line.kind} are left out: another one says the same"] += 1

    def _clock(self, stamps_s: FloatArray) -> tuple[IntArray, list[str]]:
        """(N,) stamp of each message [ns], and what is to be told; raises FileFormatError where there are none."""
        columns = [_continued(column) for column in stamps_s.T]
        usable = [np.isfinite(column).all() and np.ptp(column) > 0.0 for column, _ in columns]
        if not any(usable):
            if len(stamps_s) == 1 and np.isfinite(stamps_s).any():
                first = float(stamps_s[np.isfinite(stamps_s)][0])
                return np.array([round(first * 1e9)]), []
            has_all = bool(np.isfinite(stamps_s).all())
            where = "" if self._unstamped is None else f"line {self._unstamped}"
            found = (
                "has one stamp in all its lines" if has_all else "has no stamp" if where else "has lines without one"
            )
            raise FileFormatError(self.path, where, found, "times at the end of each line [s]")
        # Sent comes before written: the writer is late by the network. A clock of few steps is none.
        steps = [len(np.unique(column)) if good else 0 for (column, _), good in zip(columns, usable, strict=True)]
        chosen = 0 if steps[0] * 2 >= steps[1] else 1
        column, wraps = columns[chosen]
        name = ("when a message was sent", "when it was written")[chosen]
        notes = [f"stamps are those of {name}"]
        if chosen == 1:
            notes.append(
                f"{len(column)} stamps of when a message was sent are constant, or take {steps[0]} values only"
            )
        notes += [f"{wraps} times the stamps start again; they are continued"] if wraps else []
        if not (np.abs(column) < _LATEST_S).all():
            raise FileFormatError(self.path, "", f"has stamps of {np.abs(column).max():.3g} s", "seconds since 1970")
        return np.rint(column * 1e9).astype(np.int64), notes

    def _lines(self) -> Iterator[_Line]:
        """Messages that are read, in the order of the file; one that is cut at the end of the file is left out."""
        try:
            with self.path.open("rb") as file:
                number = 0
                while data := file.readline(_LINE_LIMIT):
                    number += 1
                    if len(data) == _LINE_LIMIT:
                        found = f"is longer than {_LINE_LIMIT} bytes"
                        raise FileFormatError(self.path, f"line {number}", found, "a message of CARMEN")
                    words = data.decode("latin-1").split()
                    if not data.endswith(b"\n"):
                        # Its last number may have lost digits, so that nobody knows whether it is whole.
                        self._cut = (
                            f"line {number}, the last one, has no end: the log was cut there, and it is left out"
                        )
                    elif words and words[0] in _KNOWN:
                        yield _line(number, words)
        except OSError as error:
            raise cannot_read(self.path, error) from error


def _line(number: int, words: list[str]) -> _Line:
    """Split a message: the last three words are a stamp, the host, and a stamp; both stamps NaN where they are none."""
    ends = words[-3:] if len(words) >= 5 else ["", "", ""]
    sent, written = (float(word) if _is_number(word) else math.nan for word in (ends[0], ends[2]))
    return _Line(number, words[0], words[1:-3], (sent, written))


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False


def _numbers(words: list[str], begin: int, count: int) -> FloatArray:
    """(count,) numbers; raises ValueError where there are fewer."""
    if count < 0 or len(words) < begin + count:
        raise ValueError(f"it has {len(words)} numbers where {begin + count} are said")
    return np.array(words[begin : begin + count], dtype=np.float64)


def _count(words: list[str], place: int) -> int:
    """How many numbers follow; raises ValueError."""
    count = int(words[place])
    if not 0 <= count <= len(words):
        raise ValueError(f"it says {count} numbers, and has {len(words)}")
    return count


def _scan(line: _Line, stamp_ns: int, scanner: int) -> tuple[Scan, FloatArray | None]:
    """Return the scan of a message, and the pose of the vehicle by its odometry; None where it has none."""
    words = line.words
    if line.kind in _OLD:
        count = _count(words, 0)
        ranges = _numbers(words, 1, count)
        # An even number of beams leaves out the last one of the half turn.
        begin, step, farthest = -0.5 * math.pi, math.pi / max(count - count % 2, 1), _NO_RETURN
        return _made(stamp_ns, scanner, (begin, step, farthest), ranges, None), _numbers(words, 1 + count + 3, 3)
    _, begin, _, step, farthest = _numbers(words, 0, 5).tolist()
    count = _count(words, 7)
    ranges = _numbers(words, 8, count)
    rest = words[8 + count :]
    strengths = int(rest[0]) if rest and rest[0].isdigit() else -1
    is_raw = line.kind.startswith("RAW")
    # Older logs have the pose of the laser right behind the ranges; behind it stand 8 or 9 more numbers.
    if not is_raw and len(rest) - 1 - strengths not in (10, 11):
        strengths = -1
    remissions = _numbers(rest, 1, strengths) if strengths == count > 0 else None
    pose = None if is_raw else _numbers(rest, 1 + strengths + 3, 3)
    return _made(stamp_ns, scanner, (begin, step, farthest), ranges, remissions), pose


def _made(
    stamp_ns: int,
    scanner: int,
    angles: tuple[float, float, float],
    ranges: FloatArray,
    remissions: FloatArray | None,
) -> Scan:
    """Scan of a message; what reaches the last of `angles`, the largest range, has met nothing."""
    begin, step, farthest = angles
    if not (abs(begin) <= 4.0 * math.pi and 0.0 < abs(step) <= math.pi):
        raise ValueError(f"its beams begin at {begin:g} rad, {step:g} rad apart")
    with np.errstate(over="ignore"):
        seen: NDArray[np.float32] = ranges.astype(np.float32)
        strengths = None if remissions is None else remissions.astype(np.float32)
    seen[~((ranges > 0.0) & (ranges < (farthest if farthest > 0.0 else math.inf)))] = np.nan
    return Scan(
        stamp_ns=stamp_ns,
        ranges=seen,
        angle_min=begin,
        angle_increment=step,
        intensities=strengths,
        scanner=scanner,
    )


def _continued(stamps_s: FloatArray) -> tuple[FloatArray, int]:
    """Stamps that go on where a clock starts again, and how often it does."""
    if len(stamps_s) < 2 or not np.isfinite(stamps_s).all():
        return stamps_s, 0
    steps, added = np.diff(stamps_s), np.zeros(len(stamps_s))
    wraps = 0
    for period in _WRAPS_S:
        # From the last tenth of the period into its first one.
        again = (steps < -0.8 * period) & (stamps_s[:-1] < 1.001 * period) & (stamps_s[1:] >= 0.0)
        again &= (stamps_s[:-1] > 0.9 * period) & (stamps_s[1:] < 0.1 * period)
        if float(stamps_s.max()) < 1.001 * period and again.any():
            # A line that was written late comes back from behind the start.
            back = (steps > 0.8 * period) & (stamps_s[1:] > 0.9 * period) & (stamps_s[:-1] < 0.1 * period)
            added[1:] += period * np.cumsum(again.astype(np.float64) - (back & (np.cumsum(again) > 0)))
            wraps += int(again.sum())
            break
    return stamps_s + added, wraps
