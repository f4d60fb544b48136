"""What tags contributed to a run, in numbers."""

from __future__ import annotations

import numpy as np

from commission.localization.run_columns import RunColumns
from commission.localization.tags import NIS, USE, TagUse
from commission.site.quantity import counted_text
from commission.studies.plausibility import Finding

Number = int | float | None
DEGREES_OF_FREEDOM = 3


def tag_figures(columns: RunColumns) -> dict[str, Number]:
    """Entries of `summary.json` about tags; none where the drive has no frames of a camera that looks for them.

    Returns
    -------
    entries : frames, and sightings by what became of them; share of the frames that saw no tag [0..1]; mean NIS of
        accepted sightings divided by their three degrees of freedom, and the same of those that were rejected as well:
        1 where all is as believed.
    """
    seen = columns.detected.tags
    if seen is None:
        return {}
    frames = int(np.count_nonzero(seen.is_frame))
    empty = int(np.count_nonzero(np.diff(seen.offsets)[seen.is_frame] == 0))
    use, nis = columns.tags[:, USE], columns.tags[:, NIS]
    accepted, rejected = use == TagUse.ACCEPTED, use == TagUse.REJECTED
    return {
        "tag_frames": frames,
        "tag_unseen_fraction": empty / frames,
        "tag_accepted": int(np.count_nonzero(accepted)),
        "tag_rejected": int(np.count_nonzero(rejected)),
        "tag_unknown": int(np.count_nonzero(use == TagUse.UNKNOWN)),
        "tag_nis_per_row_mean": _mean(nis[accepted]),
        "tag_nis_before_gate_per_row_mean": _mean(nis[accepted | rejected]),
    }


def _mean(nis: np.ndarray) -> float | None:
    """Mean NIS of a degree of freedom; None of nothing."""
    return float(nis.mean()) / DEGREES_OF_FREEDOM if len(nis) else None


def tag_findings(columns: RunColumns) -> tuple[Finding, ...]:
    """Say when a camera saw tags and none of them counted: without a word the run would look as if they did.

    Parameters
    ----------
    columns : the run; its first setup says what the site has.

    Returns
    -------
    findings : one or none.
    """
    seen, setup = columns.detected.tags, columns.segments[0].setup
    if seen is None or not len(seen.ids) or not setup.parameters.tag.enabled:
        return ()
    if not setup.tags:
        found = f"the recording holds {counted_text(len(seen.ids), 'sighting')} of tags, and the site has none"
        return (
            Finding(found=found, probably="they were not surveyed", remedy="enter them under tags: in project.yaml"),
        )
    if (columns.tags[:, USE] == TagUse.UNKNOWN).all():
        found = f"none of {len(seen.ids)} sightings is of a tag of the site"
        some = ", ".join(sorted({repr(str(each)) for each in seen.ids[:20]}))
        return (Finding(found=found, probably=f"their ids are written otherwise: {some}", remedy="compare with tags:"),)
    return ()
