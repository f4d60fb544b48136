"""What the residuals of a drive say, in lines for a person. Nothing is computed that the study does not hold."""

from __future__ import annotations

import math

import numpy as np

from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT, Shown
from commission.studies.residual_study import EDGES, Relation, ResidualStudy

TOO_FAR = 1.15
"""A 1-sigma that residuals need more or less of by no more than this fits."""
TOO_UNLIKE = 1.4
"""Share by which a mean squared distance may differ from 2 before it is told."""
ALIKE = 1.0 / math.e
"""Correlation from which on residuals are no longer called alike."""
OF_SPREAD, OF_CHANCE = 0.3, 4.0
"""Bins of a relation differ where their means lie apart by this share of the spread, and this often by chance."""
MOST_ALIKE = 10.0
"""Scans that count as one at most where relations are judged."""
KINDS: tuple[tuple[str, Shown], ...] = (("range", MILLIMETRES), ("bearing", DEGREES))
"""What is measured, and its unit."""


def residual_lines(study: ResidualStudy) -> tuple[str, ...]:
    """Say what stands out: sizes, likeness in time, and what residuals go with, a line each.

    Parameters
    ----------
    study : of a drive.
    """
    if not study.total:
        return ("no detection has a reflector: nothing can be said of residuals",)
    return (*_sizes(study), *_in_time(study), *_relations(study), *_beams(study))


def _sizes(study: ResidualStudy) -> list[str]:
    lines: list[str] = []
    for axis, ((name, _), factor) in enumerate(zip(KINDS, study.factors.tolist(), strict=True)):
        if math.isnan(factor):
            continue
        if factor > TOO_FAR:
            lines.append(f"your {name} sigma is {factor:.1f} times too small")
        elif factor * TOO_FAR >= 1.0:
            lines.append(f"your {name} sigma fits")
        elif correlation_time(study, axis) > 0.0:
            lines.append(
                f"detections of one scan scatter {1.0 / max(factor, 1e-3):.1f} times less than your {name} sigma says; "
                "as they are alike in time, leave it: a calibration says what the localizer needs"
            )
        else:
            lines.append(f"your {name} sigma is {1.0 / max(factor, 1e-3):.1f} times too large")
    if not 2.0 / TOO_UNLIKE <= study.mean <= 2.0 * TOO_UNLIKE:
        more = "surer of its pose than it should be" if study.mean > 2.0 else "less sure of its pose than it could be"
        lines.append(f"squared distances are {study.mean:.1f} on average, 2 is consistent: the filter is {more}")
    expected = math.exp(-0.5 * float(EDGES[-1]))
    beyond = study.beyond / study.total
    if beyond > 3.0 * expected + 3.0 * math.sqrt(expected / study.total):
        lines.append(
            f"{PERCENT.text(beyond, '.1f')} of the detections have a squared distance beyond {EDGES[-1]:.0f}, of a "
            f"consistent filter {PERCENT.text(expected, '.2f')}: false ones, or a reflector that stands elsewhere"
        )
    return lines


def correlation_time(study: ResidualStudy, axis: int) -> float:
    """Time over which residuals of one reflector are alike [s]; 0: they are not, NaN: too few.

    Parameters
    ----------
    study : of a drive.
    axis : 0 of ranges, 1 of bearings.
    """
    rhos = study.correlations[:, axis]
    if not len(rhos):
        return math.nan
    apart = np.flatnonzero(~(rhos > ALIKE))
    if not len(apart):
        return float(study.lags[-1])
    return 0.0 if apart[0] == 0 else float(study.lags[apart[0]])


def _in_time(study: ResidualStudy) -> list[str]:
    lines: list[str] = []
    for axis, (name, _) in enumerate(KINDS):
        seconds = correlation_time(study, axis)
        if seconds > 0.0:
            more = "more than " if seconds >= study.lags[-1] else ""
            lines.append(
                f"{name} residuals of one reflector are alike for {more}{seconds:.1f} s, not white: the filter is too "
                "sure unless its sigma allows for that"
            )
    return lines


def stands_out(study: ResidualStudy, relation: Relation, axis: int) -> bool:
    """Whether residuals differ between the bins of a relation by more than chance, and by enough to matter.

    Parameters
    ----------
    study : of a drive.
    relation : one of its relations.
    axis : 0 of ranges, 1 of bearings.
    """
    means, spreads = relation.means[:, axis], relation.spreads[:, axis]
    first = float(study.lags[0]) if len(study.lags) else math.inf
    # What residuals go with makes them alike in time itself.
    alike = min(float(np.nan_to_num(correlation_time(study, axis))) / first, MOST_ALIKE)
    errors = spreads / np.sqrt(np.maximum(relation.counts / (1.0 + 2.0 * alike), 1.0))
    apart = float(means.max() - means.min())
    chance = float(np.hypot(errors[means.argmax()], errors[means.argmin()]))
    return apart > max(OF_SPREAD * float(np.median(spreads)), OF_CHANCE * chance)


def _relations(study: ResidualStudy) -> list[str]:
    lines: list[str] = []
    for relation in study.relations:
        for axis, (name, shown) in enumerate(KINDS):
            if not stands_out(study, relation, axis):
                continue
            ends = sorted((int(relation.means[:, axis].argmin()), int(relation.means[:, axis].argmax())))
            told = ", ".join(
                f"{shown.text(float(relation.means[end, axis]), '+.1f' if axis == 0 else '+.2f')} at "
                f"{relation.shown.text(float(relation.places[end]), '.3g')}"
                for end in ends
            )
            lines.append(f"{name} residuals go with {relation.name}: {told}")
    return lines


def _beams(study: ResidualStudy) -> list[str]:
    if study.beams is None:
        return []
    weights = study.beams.counts
    ratio = float((study.beams.beams * weights).sum() / (study.beams.expected * weights).sum())
    if 1.0 / TOO_FAR <= ratio <= TOO_FAR:
        return [f"clusters have as many beams as expected ({ratio:.2f} times)"]
    return [f"clusters have {ratio:.2f} times the beams that are expected: look at radius, threshold and beam window"]
