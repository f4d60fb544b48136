"""What contours of the floor map contributed to a run, in numbers."""

from __future__ import annotations

import numpy as np

from commission.localization.contour import COST, LEARNED_DEPTH, MATCHED, NIS, POINTS, ROWS, USE, ContourUse
from commission.localization.run_columns import RunColumns
from commission.studies.plausibility import Finding

Number = int | float | None


def contour_figures(columns: RunColumns) -> dict[str, Number]:
    """Entries of `summary.json` about contours; none where they are not looked at.

    Returns
    -------
    entries : cycles by what became of their contours; share of the beams that were matched and mean cost of a beam
        [0..1] in the cycles that looked at them; mean NIS of a row of accepted matches, 1 where all is as believed;
        how far behind the drawn walls beams end [m], as it was known at the end.
    """
    figures = columns.contours
    if not len(figures):
        return {}
    use = figures[:, USE]
    looked, accepted = figures[use != ContourUse.NONE], figures[use == ContourUse.ACCEPTED]
    beams, rows = float(looked[:, POINTS].sum()), float(accepted[:, ROWS].sum())
    return {
        "contour_accepted": len(accepted),
        "contour_rejected": int(np.count_nonzero(use == ContourUse.REJECTED)),
        "contour_unmatched": int(np.count_nonzero(use == ContourUse.UNMATCHED)),
        "contour_contradicted": int(np.count_nonzero(use == ContourUse.CONTRADICTED)),
        "contour_matched_fraction": float(looked[:, MATCHED].sum()) / beams if beams else None,
        "contour_cost_mean": float(looked[:, COST].mean()) if len(looked) else None,
        "contour_nis_per_row_mean": float(accepted[:, NIS].sum()) / rows if rows else None,
        "contour_depth": float(accepted[-1, LEARNED_DEPTH]) if len(accepted) else None,
    }


def contour_findings(columns: RunColumns) -> tuple[Finding, ...]:
    """Say when contours are to be matched and no scan was: without a word the run would look as if they counted.

    Parameters
    ----------
    columns : the run; its first setup says whether contours are to be matched.

    Returns
    -------
    findings : one or none.
    """
    setup = columns.segments[0].setup
    if not setup.parameters.contour.enabled or (columns.contours[:, USE] != ContourUse.NONE).any():
        return ()
    if setup.floor is None:
        probably, remedy = "the project has no floor map", "load one with walls, or set contour.enabled=false"
    elif setup.zones:
        probably = "zones leave contours out wherever the drive went, or the recording holds no whole scans"
        remedy = "look at the zones of the site, or record scans"
    else:
        probably, remedy = "the recording holds no whole scans", "record them, or set contour.enabled=false"
    found = "contours are to be matched and none of the scans was"
    return (Finding(found=found, probably=probably, remedy=remedy),)
