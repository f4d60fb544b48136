"""Variants of the drive as the page's script lists them: settings that differ, figures, marks, and moments."""

from __future__ import annotations

import math
from typing import Any

from commission.app.run.charts import color_of
from commission.app.run.variant_reducer import LETTERS, VariantsState
from commission.studies.variant_settings import differing_settings
from commission.studies.variants import RULE, ComparedFigure, VariantsResult


def variants_message(compared: VariantsResult | None, state: VariantsState) -> dict[str, Any]:
    """Return the table for the script.

    Parameters
    ----------
    compared : the variants of the drive; none before one is kept.
    state : what is kept: what was forgotten since the comparison is left out.
    """
    letters = {each.letter for each in state.kept}
    message: dict[str, Any] = {"rule": RULE, "free": len(letters) < len(LETTERS), "names": [], "moments": []}
    if compared is None or not set(compared.inputs.names[1:]) & letters:
        return message
    names = compared.inputs.names
    shown = [index for index, name in enumerate(names) if index == 0 or name in letters]
    return message | {
        "names": [names[index] for index in shown],
        "colors": ["" if index == 0 else color_of(names[index]) for index in shown],
        "settings": [
            [setting.key, setting.label, [setting.texts[index] for index in shown]]
            for setting in differing_settings([compared.inputs.runs[index] for index in range(len(names))])
        ],
        "figures": [[row.figure.label, [_cell(row, index) for index in shown]] for row in compared.figures],
        "moments": [
            [round(moment.time, 4), str(moment)]
            for moment in compared.moments
            if {*moment.between} <= {names[index] for index in shown}
        ],
    }


def _cell(row: ComparedFigure, index: int) -> list[str]:
    """Text, how it stands to the first, and what a consistent filter shows."""
    expected = row.expected[index]
    return [
        row.figure.text(row.values[index]),
        row.verdicts[index].value,
        "" if math.isnan(expected) else row.figure.text(expected),
    ]
