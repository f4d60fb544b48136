"""What bearings of a goniometer contributed to a run, in numbers."""

from __future__ import annotations

import numpy as np

from commission.localization.bearings import LASTING, NIS, OFF, REFLECTOR, USE, BearingUse
from commission.localization.estimate import Mode
from commission.localization.run_columns import RunColumns
from commission.site.quantity import DEGREES, PERCENT, counted_text
from commission.studies.plausibility import Finding

Number = int | float | None
FEWEST_JUDGED = 50
"""Bearings from which on a share of them says something."""
LARGEST_REJECTED, LARGEST_NIS = 0.05, 2.0
"""Share of rejected bearings, and mean NIS, beyond which the filter takes them for better than they are."""


def bearing_figures(columns: RunColumns) -> dict[str, Number]:
    """Entries of `summary.json` about bearings alone; none where the drive has no reflexes of a goniometer.

    Returns
    -------
    entries : reflexes by what became of them, turns that met no reflector; mean NIS of accepted bearings, of one degree
        of freedom, and the same with those that were rejected and held against a reflector: 1 where all is as believed.
    """
    met = columns.detected.bearings
    if met is None:
        return {}
    turns = int(np.count_nonzero(np.isnan(met.bearings)))
    use, nis = columns.bearings[:, USE], columns.bearings[:, NIS]
    accepted, rejected = use == BearingUse.ACCEPTED, use == BearingUse.REJECTED
    return {
        "bearings": len(met.bearings) - turns,
        "bearing_turns_without_any": turns,
        "bearing_accepted": int(np.count_nonzero(accepted)),
        "bearing_rejected": int(np.count_nonzero(rejected)),
        "bearing_unknown": int(np.count_nonzero(use == BearingUse.UNKNOWN)),
        "bearing_nis_mean": _mean(nis[accepted]),
        "bearing_nis_before_gate_mean": _mean(nis[(accepted | rejected) & np.isfinite(nis)]),
        "bearing_lasting_fraction": float(columns.bearings[:, LASTING].mean()) if len(columns.bearings) else None,
    }


def leaning(columns: RunColumns, first: int, last: int) -> tuple[tuple[str, float], ...]:
    """Mean innovation of the accepted bearings of each reflector, over some reflexes.

    Parameters
    ----------
    columns : the run.
    first, last : rows of the reflexes, the last one excluded; of one setup.

    Returns
    -------
    reflectors : id and mean [rad] less the median of all, which is the heading; the largest first.
    """
    rows = columns.bearings[first:last]
    rows = rows[rows[:, USE] == BearingUse.ACCEPTED]
    if not len(rows):
        return ()
    met = columns.detected.bearings
    cycle = 0 if met is None else int(np.searchsorted(met.numbers - met.first, max(last - 1, 0), side="right")) - 1
    reflectors = columns.segment(cycle).setup.reflectors.reflectors
    numbers = np.unique(rows[:, REFLECTOR]).astype(np.int64)
    means = np.array([rows[rows[:, REFLECTOR] == number, OFF].mean() for number in numbers])
    means -= np.median(means)
    order = np.argsort(-np.abs(means), kind="stable")
    return tuple((reflectors[numbers[index]].id, float(means[index])) for index in order.tolist())


def _mean(nis: np.ndarray) -> float | None:
    """Mean NIS; None of nothing."""
    return float(nis.mean()) if len(nis) else None


def bearing_findings(columns: RunColumns) -> tuple[Finding, ...]:
    """Say when a goniometer met reflectors and no bearing counted: without a word the run would look as if they did.

    Parameters
    ----------
    columns : the run; its first setup says what the vehicle has.

    Returns
    -------
    findings : one or none.
    """
    met, setup = columns.detected.bearings, columns.segments[0].setup
    if met is None or not np.isfinite(met.bearings).any() or not setup.parameters.bearing.enabled:
        return ()
    count = int(np.count_nonzero(np.isfinite(met.bearings)))
    if setup.bearing_model is None:
        found = f"the recording holds {counted_text(count, 'bearing')} of a goniometer, and the vehicle has none"
        remedy = "give one of its scanners `kind: goniometer` in project.yaml"
        return (Finding(found=found, probably="the scanner is entered as a laser", remedy=remedy),)
    names = sorted({name for name in met.reflectors if name})
    known = {each.id for each in setup.reflectors.reflectors}
    if names and not known.intersection(names):
        found = f"none of {count} bearings is of a reflector of the map"
        probably = f"their ids are written otherwise: {', '.join(map(repr, names[:3]))}"
        return (Finding(found=found, probably=probably, remedy="compare with reflectors.csv"),)
    return (*_not_found(columns), *_lasting(columns), *_disagreeing(columns))


def _not_found(columns: RunColumns) -> tuple[Finding, ...]:
    """Say that bearings alone find no pose, where a vehicle waits for one that was not told it."""
    if not (columns.modes == Mode.INITIALIZING).all() or not (columns.bearings[:, USE] == BearingUse.NONE).all():
        return ()
    return (
        Finding(
            found="the vehicle was not told where it is, and bearings alone do not find its pose",
            probably="it has no laser that measures ranges, or that sees too little, and no tag in sight",
            remedy="say where it begins: --initial-pose X,Y,THETA, or a reference in the recording",
        ),
    )


def _lasting(columns: RunColumns) -> tuple[Finding, ...]:
    """Say when innovations that do not average out stopped the vehicle, and whose they are."""
    flagged = np.flatnonzero(columns.bearings[:, LASTING])
    if not len(flagged):
        return ()
    worst = leaning(columns, 0, int(flagged[0]) + 1)[:2]
    whose = " and ".join(f"{name} ({DEGREES.text(off, '+.2f')})" for name, off in worst)
    share = PERCENT.text(len(flagged) / len(columns.bearings), "3.1f")
    return (
        Finding(
            found=f"bearings are off and stay off, most those of {whose}: not operational at {share} of the reflexes",
            probably="reflectors stand elsewhere than in the map, or the goniometer is off in some directions",
            remedy="survey these reflectors, or say how far off they may be (sigma in reflectors.csv, uncertainty)",
        ),
    )


def _disagreeing(columns: RunColumns) -> tuple[Finding, ...]:
    """Say when bearings are farther off than the filter takes them to be."""
    figures = bearing_figures(columns)
    accepted, rejected = figures["bearing_accepted"] or 0, figures["bearing_rejected"] or 0
    nis = figures["bearing_nis_before_gate_mean"]
    if accepted + rejected < FEWEST_JUDGED:
        return ()
    share = rejected / (accepted + rejected)
    if share <= LARGEST_REJECTED and (nis is None or nis <= LARGEST_NIS):
        return ()
    fits = "" if nis is None else f", and their NIS is {nis:.1f} where 1 is expected"
    probably = "goniometer, mounting or map are off by more than the project says, or other things shine"
    remedy = "enter what is known of them (bearing_sigma_deg, uncertainty, sigma in reflectors.csv)"
    return (
        Finding(
            found=f"{PERCENT.text(share, '.1f')} of the bearings are rejected{fits}", probably=probably, remedy=remedy
        ),
    )
