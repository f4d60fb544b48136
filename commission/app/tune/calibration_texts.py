"""A calibration in words and tables. Pure: from the view to HTML."""

from __future__ import annotations

import math

from commission.app.base.panel import escaped, table
from commission.app.tune.calibration_view import CalibrationView
from commission.site.quantity import counted_text, number_text
from commission.studies.calibration_values import CalibrationVerdict, Value
from commission.studies.calibration_words import label_of, stretches_of, text_of
from commission.studies.variant_figures import BY_KEY

GAINS = ("operational_fraction", "rejected_fraction", "nis_before_gate_mean", "position_rmse_m", "anees_position")
"""Figures of a run by which an acceptance is seen; those that need a reference only where there is one."""
HEADS = {
    CalibrationVerdict.NOT_SHOWN: "This drive cannot show",
    CalibrationVerdict.AGREES: "Agrees with the project",
    CalibrationVerdict.WORSE: "The other half of the drive gets worse by",
}
"""What is said of figures that are not proposed, in this order."""


def summary_text(found: CalibrationView) -> str:
    """Say how many figures are proposed and accepted."""
    count, accepted = len(found.proposed), sum(each.is_accepted for each in found.proposed)
    notes = [
        f"{counted_text(count, 'figure')} proposed, {accepted} accepted." if count else "The drive proposes nothing."
    ]
    if not found.is_of_drive:
        notes.append("Another drive is shown by now: calibrate again.")
    return _padded("".join(map(_note, notes)))


def figure_text(found: CalibrationView) -> str:
    """Return all that was found of the figure that is looked at; empty: there is none."""
    if found.chosen is None:
        return ""
    value, now = found.chosen.value, found.chosen.now
    rows = [
        ("Project said", text_of(value, value.before)),
        ("Drive says", text_of(value, value.proposed)),
        ("1-sigma of that", text_of(value, value.sigma)),
    ]
    if value.sigma > 0.0:
        rows.append(("Difference", f"{abs(value.proposed - value.before) / value.sigma:.1f} 1-sigma"))
    if now is not None and not found.chosen.is_accepted and not math.isclose(now, value.before):
        rows.append(("Project says now", text_of(value, now)))
    stretches = stretches_of(value)
    if stretches:
        rows.append(("Most is said by", stretches))
    head = f"<div style='font-weight:600'>{escaped(label_of(value.key))}</div>"
    told = table((escaped(name), escaped(content)) for name, content in rows)
    return _padded(head + told + (_note(_sentence(value.reason)) if value.reason else ""))


def gain_text(found: CalibrationView) -> str:
    """Return figures of the drive before and after the newest acceptance; empty: there is none, or it was undone."""
    before, after, key = found.asked.before, found.asked.shown, found.asked.accepted
    accepted = next((each for each in found.proposed if each.value.key == key and each.is_accepted), None)
    if before is None or after is None or accepted is None:
        return ""
    label = escaped(label_of(key))
    if after is before:
        return _padded(_note(f"{label_of(key)} is accepted: the drive is localized again."))
    rows = ""
    for figure in (BY_KEY[name] for name in GAINS):
        old, new = figure.value(before), figure.value(after)
        if math.isnan(old) or math.isnan(new):
            continue
        expected = math.nan if figure.expected is None else figure.expected(after)
        hint = "" if math.isnan(expected) else f" (consistent: {number_text(expected)})"
        cells = (f"{figure.label}{hint}", figure.text(old), figure.text(new))
        rows += "<tr>" + "".join(f"<td>{escaped(each)}</td>" for each in cells) + "</tr>"
    head = f"<tr><td>{label} accepted</td><td>before</td><td>now</td></tr>"
    return _padded(f"<table class='c-before-after'>{head}{rows}</table>")


def not_proposed_text(found: CalibrationView) -> str:
    """List what is not proposed, and why, and what else the drive shows."""
    parts: list[str] = []
    for verdict, head in HEADS.items():
        lines = [_other(each) for each in found.calibration.values if each.verdict is verdict]
        if lines:
            items = "".join(f"<li>{escaped(line)}</li>" for line in lines)
            parts.append(f"{_note(f'{head}:')}<ul class='c-list'>{items}</ul>")
    notes = "".join(f"<li>{escaped(_sentence(each))}</li>" for each in found.calibration.notes)
    return _padded("".join((*parts, _note("What else it shows:"), f"<ul class='c-list'>{notes}</ul>")))


def _other(value: Value) -> str:
    """A figure that is not proposed."""
    label = label_of(value.key)
    if value.verdict is CalibrationVerdict.NOT_SHOWN:
        return f"{label}: {value.reason}"
    told = f"{label}: {text_of(value, value.before)}, by the drive {text_of(value, value.proposed)}"
    return f"{told} ± {text_of(value, value.sigma)}" + (f"; {value.reason}" if value.reason else "")


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _note(text: str) -> str:
    return f"<div class='c-note'>{escaped(text)}</div>"


def _padded(content: str) -> str:
    return f"<div style='padding:2px 10px 4px 6px'>{content}</div>"
