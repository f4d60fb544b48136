"""Innovations of bearings that do not average out: white noise does, what is off and stays does not.

The covariance shrinks with every bearing as if its error were drawn anew. Where the mean innovation of a reflector
stays farther from zero than noise and considered constants explain, that is not so, and nobody drives by such a pose.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled_inline
from commission.geometry.arrays import FloatArray, read_only
from commission.localization.rejection import Evidence
from commission.site.parameters import BearingParameters, SupervisorParameters

WEIGHT, SUM, NOISE, KNOWN, SEEN, REACH, MET = range(7)
"""Columns of what is remembered of a reflector's bearings: see `remember`; when one was accepted last [s]."""
REMEMBERED = 7
FEWEST = 5.0
"""Weighted bearings of a reflector from which on their mean says something."""
HARMLESS = 0.25
"""Share of the supervisor's limits: what moves the bearing of a reflector by less stops nobody."""
CLEARED = 0.5
"""The rule holds until all is below this part of its limits: so the mode does not flicker."""


class LastingRule(NamedTuple):
    """Window and limits, for kernels."""

    window_s: float
    limit: float
    """Sigma up to which mean innovations are taken for chance; 0: all are."""
    lateral: float
    turned: float
    """A mean that moves its reflector sideways by less [m], and turns it by less [rad], is harmless."""


@dataclass(frozen=True, slots=True, eq=False)
class LastingInnovations:
    """What is remembered of reflectors, as a value between two cycles."""

    names: tuple[str, ...]
    """Ids of the reflectors of the map, by their numbers."""
    rows: FloatArray
    """(N, REMEMBERED) see `remember`; read-only."""

    def __eq__(self, other: object) -> bool:
        """Whether both say the same, to the last bit."""
        if not isinstance(other, LastingInnovations):
            return NotImplemented
        return self._bits() == other._bits()

    def __hash__(self) -> int:
        """Equal ones have the same."""
        return hash(self._bits())

    def _bits(self) -> tuple[object, ...]:
        return self.names, self.rows.tobytes()


def lasting_rule(given: BearingParameters, supervisor: SupervisorParameters) -> LastingRule:
    """Return window and limits for kernels; the rule is off where the supervisor is.

    Parameters
    ----------
    given : the parameters of bearings.
    supervisor : its limits.
    """
    limit = given.lasting_limit if supervisor.enabled else 0.0
    lateral, turned = HARMLESS * supervisor.position_limit, HARMLESS * supervisor.heading_limit
    return LastingRule(float(given.lasting_window), float(limit), float(lateral), float(turned))


def mean_rows(state: LastingInnovations | None, names: tuple[str, ...]) -> FloatArray:
    """(N, REMEMBERED) what is remembered, for the steps to write in: a copy, by the numbers of a map.

    Parameters
    ----------
    state : after the cycle before; None: nothing is remembered.
    names : ids of the reflectors of the map; one that was not there has nothing remembered of it.
    """
    rows = np.zeros((len(names), REMEMBERED))
    if state is None:
        return rows
    if state.names == names:
        rows[:] = state.rows
        return rows
    before = {name: number for number, name in enumerate(state.names)}
    for number, name in enumerate(names):
        if name in before:
            rows[number] = state.rows[before[name]]
    return rows


def lasting_innovations(rows: FloatArray, names: tuple[str, ...]) -> LastingInnovations | None:
    """Return what steps have left, as a value; None where nothing is remembered.

    Parameters
    ----------
    rows, names : as `mean_rows` gave and was given them.
    """
    return LastingInnovations(names, read_only(rows.copy())) if rows.any() else None


@compiled_inline
def remember(  # noqa: PLR0917 - a bearing, number by number
    row: FloatArray,
    stamp_ns: int,
    innovation: float,
    variance: float,
    noise: float,
    constant: float,
    distance: float,
    rule: LastingRule,
) -> None:
    """Add an accepted bearing to what is remembered of its reflector.

    Parameters
    ----------
    row : (REMEMBERED,) of the reflector, in and out, but for `MET`: sum of weights l, of l times the innovation [rad],
        of l^2 times what is new in it each time [rad^2], of l times what constants make of it [rad^2]; stamp [s],
        distance [m].
    stamp_ns : of the bearing [ns].
    innovation, variance : measured less expected [rad], and its variance S [rad^2].
    noise : the part R of S that is drawn anew each time [rad^2].
    constant : variance that considered constants alone would give it [rad^2]: K.
    distance : from the goniometer to the reflector [m].
    rule : window.

    Notes
    -----
    l = exp(-age / window) R / S. Innovations of a filter that is right are white (Kailath 1968), but for constants, so
    that m = sum l v / sum l has the variance sum l^2 (S - K) / (sum l)^2 + sum l K / sum l, taking constants for wholly
    correlated over the window (by Jensen's inequality). R / S, so that what was met while the pose was not known yet
    says little.
    """
    seconds, counts = stamp_ns * 1e-9, noise / variance
    kept = math.exp(-(seconds - row[SEEN]) / rule.window_s) if row[WEIGHT] > 0.0 else 0.0
    row[WEIGHT] = kept * row[WEIGHT] + counts
    row[SUM] = kept * row[SUM] + counts * innovation
    row[NOISE] = kept * kept * row[NOISE] + counts * counts * max(variance - constant, noise)
    row[KNOWN] = kept * row[KNOWN] + counts * constant
    row[SEEN], row[REACH] = seconds, distance


@compiled_inline
def lasts(rows: FloatArray, stamp_ns: int, before: bool, rule: LastingRule) -> bool:
    """Whether innovations of the reflectors that were met of late do not average out.

    Parameters
    ----------
    rows : (N, REMEMBERED) of all reflectors.
    stamp_ns : of now [ns].
    before : whether they did not until now: then what is left must fall well below the limit.
    rule : window and limits.

    Notes
    -----
    T = sum (m_i - m)^2 / var m_i, m being their weighted mean: what turns all bearings alike is the heading of vehicle
    or mounting, and contradicts nothing. T is chi-square with n - 1 degrees of freedom; beyond the quantile of `limit`
    sigma (Wilson, Hilferty 1931) innovations last, where some |m_i - m| is not harmless.
    """
    count, total, middle = 0, 0.0, 0.0
    now = stamp_ns * 1e-9
    for row in rows:
        if _counts(row, now, rule):
            weight = row[WEIGHT] * row[WEIGHT] / (row[NOISE] + row[WEIGHT] * row[KNOWN])
            count, total, middle = count + 1, total + weight, middle + weight * row[SUM] / row[WEIGHT]
    if count < 2:
        return False
    middle /= total
    found, harmless, share = 0.0, True, CLEARED if before else 1.0
    for row in rows:
        if _counts(row, now, rule):
            off = row[SUM] / row[WEIGHT] - middle
            found += off * off * row[WEIGHT] * row[WEIGHT] / (row[NOISE] + row[WEIGHT] * row[KNOWN])
            far = abs(off) * row[REACH] > share * rule.lateral or abs(off) > share * rule.turned
            harmless = harmless and not far
    ninth = 2.0 / (9.0 * (count - 1))
    limit = (count - 1) * (1.0 - ninth + rule.limit * math.sqrt(ninth)) ** 3
    return not harmless and found > share * limit


@compiled_inline
def _counts(row: FloatArray, now: float, rule: LastingRule) -> bool:
    """Whether a reflector was met of late, and often enough.

    Notes
    -----
    No formula: a comparison.
    """
    return row[WEIGHT] >= FEWEST and now - row[SEEN] <= rule.window_s


@compiled_inline
def with_lasting(evidence: Evidence, lasting: bool) -> Evidence:
    """Evidence with what innovations say that do not average out.

    Parameters
    ----------
    evidence : otherwise.
    lasting : whether there are such.

    Notes
    -----
    No formula: a copy.
    """
    return Evidence(
        evidence.stamp_ns,
        evidence.near_accepted,
        evidence.near_rejected,
        evidence.accepted,
        evidence.rejected,
        evidence.confirmed,
        evidence.against,
        lasting,
    )
