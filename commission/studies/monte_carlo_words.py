"""What a Monte-Carlo study has found, in lines for a person. Nothing is computed that the result does not say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.site.quantity import MILLIMETRES, PERCENT, counted_text
from commission.studies.monte_carlo_figures import QUANTILES, MonteCarloResult


def told(result: MonteCarloResult) -> list[str]:
    """Lines that tell a person what was found.

    Parameters
    ----------
    result : all drives.
    """
    inputs, diagram = result.inputs, result.stanford
    availability = result.column("operational_fraction")
    means = "beam by beam" if inputs.by_beams else "from shadow maps"
    lines = [
        f"Drives       {len(result.drives)} of {result.column('duration').sum() / 3600.0:.2f} h, {means}, "
        f"seed {inputs.seed}",
        f"Available    {PERCENT.of(result.availability):.3f} {PERCENT.unit} of the cycles; worst drive "
        f"{PERCENT.of(availability.min()):.2f} {PERCENT.unit}, "
        f"{counted_text(int(np.count_nonzero(availability == 1.0)), 'drive')} without any stop",
        f"Stops        {int(result.column('fail_episodes').sum())}, the longest of "
        f"{result.column('longest_fail').max():.1f} s; lost "
        f"{counted_text(int(np.count_nonzero(result.column('lost_fraction'))), 'drive')}",
        f"Error        {_listed(result.error_quantiles)}",
        f"Operational  {_listed(result.operational_error_quantiles)}",
        f"ANEES        {result.anees:.2f}, of the position {result.anees_position:.2f} (1 is consistent)",
    ]
    lines += [f"Note         {each}" for each in result.notes]
    if diagram is None:
        return lines
    verdicts = diagram.verdicts
    return [
        *lines,
        f"Stanford     {_share(verdicts.nominal, verdicts.total)} nominal, "
        f"{_share(verdicts.false_alarm, verdicts.total)} false alarm, {_share(verdicts.true_alarm, verdicts.total)} "
        f"true alarm, {_share(verdicts.misleading, verdicts.total)} misleading, "
        f"{_share(verdicts.hazardous, verdicts.total)} hazardously misleading",
        f"Danger       {verdicts.hazardous} of {verdicts.total} cycles operational with an error beyond "
        f"{MILLIMETRES.text(diagram.limit)}, in {result.hazardous_drives} of {len(result.drives)} drives (with 95 % "
        f"confidence fewer than {PERCENT.of(result.hazardous_bound):.2g} {PERCENT.unit} of all drives)",
    ]


def _share(part: int, total: int) -> str:
    return f"{PERCENT.of(part / total):.3f} {PERCENT.unit}"


def _listed(quantiles: Sequence[float] | FloatArray) -> str:
    """Quantiles in millimetres."""
    names = [f"{PERCENT.of(share):g} {PERCENT.unit}" if share < 1.0 else "all" for share in QUANTILES]
    return ", ".join(
        f"{name} within {MILLIMETRES.text(value, '.1f')}"
        for name, value in zip(names, np.asarray(quantiles).tolist(), strict=True)
    )
