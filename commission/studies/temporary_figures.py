"""What temporary landmarks contributed to a run, in numbers."""

from __future__ import annotations

import numpy as np

from commission.localization.run_columns import RunColumns
from commission.localization.temporary_model import BORN, CORNERS, DOUBTFUL, FORGOTTEN, KNOWN, MATCHED, NIS_SUM, REELS
from commission.studies.plausibility import Finding

Number = int | float | None
DEGREES_OF_FREEDOM = 2


def temporary_figures(columns: RunColumns) -> dict[str, Number]:
    """Entries of `summary.json` about temporary landmarks; none where they are not looked at.

    Returns
    -------
    entries : reels and corners seen; sightings of landmarks; sightings where a landmark is that they do not fit;
        landmarks born and forgotten; landmarks known in a cycle, on average and at most; share of the cycles that saw
        none that was known [0..1]; mean NIS of a sighting's two degrees of freedom, 1 where all is as believed.
    """
    figures = columns.temporary
    if not len(figures):
        return {}
    matched = float(figures[:, MATCHED].sum())
    return {
        "temporary_reels": int(figures[:, REELS].sum()),
        "temporary_corners": int(figures[:, CORNERS].sum()),
        "temporary_matched": int(matched),
        "temporary_doubtful": int(figures[:, DOUBTFUL].sum()),
        "temporary_born": int(figures[:, BORN].sum()),
        "temporary_forgotten": int(figures[:, FORGOTTEN].sum()),
        "temporary_known_mean": float(figures[:, KNOWN].mean()),
        "temporary_known_max": int(figures[:, KNOWN].max()),
        "temporary_unseen_fraction": float(np.mean(figures[:, MATCHED] == 0.0)),
        "temporary_nis_per_row_mean": float(figures[:, NIS_SUM].sum()) / (DEGREES_OF_FREEDOM * matched)
        if matched
        else None,
    }


def temporary_findings(columns: RunColumns) -> tuple[Finding, ...]:
    """Say when temporary landmarks are to be used and no scan showed any: else the run would look as if they counted.

    Parameters
    ----------
    columns : the run; its first setup says whether they are to be used.

    Returns
    -------
    findings : one or none.
    """
    figures, setup = columns.temporary, columns.segments[0].setup
    if not len(figures) or setup.temporary is None or setup.temporary.most == 0:
        return ()
    if figures[:, BORN].any():
        return ()
    if not (figures[:, REELS] + figures[:, CORNERS]).any():
        found = "temporary landmarks are to be used and no scan shows a reel or a corner"
        probably = "the recording holds no whole scans, or nothing of that size stands there"
        return (Finding(found=found, probably=probably, remedy="record scans, or look at temporary.least_radius"),)
    found = "reels or corners were seen, and none often enough in one place to become a landmark"
    probably = "what is seen moves, or too few beams meet it"
    return (Finding(found=found, probably=probably, remedy="look at temporary.confirmations and fewest_points"),)
