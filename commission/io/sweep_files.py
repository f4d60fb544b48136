"""The result of a sweep as files: a table of all its values, and a picture of the curve or the heatmap."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from commission.geometry.arrays import FloatArray
from commission.io.atomic import write_text
from commission.site.quantity import number_text
from commission.studies.sweep import SweepResult

TABLE, PICTURE, SUMMARY = "sweep.csv", "sweep.png", "summary.json"
"""Names of the files."""
SIZE = (960, 600)
"""Width and height of the picture [pixels]."""
_LEFT, _RIGHT, _ABOVE, _BELOW = 110, 30, 50, 70
_INK, _AXIS, _LINE, _POINT, _PAPER = "#20242a", "#9aa0a8", "#1f6feb", "#d1242f", "#ffffff"
_LOW, _HIGH = np.array([247.0, 251.0, 255.0]), np.array([8.0, 48.0, 107.0])
"""Colors of the smallest and the largest value: light grows to dark evenly."""
_UNDEFINED = (205, 170, 170)


def write_sweep(folder: Path, result: SweepResult) -> None:
    """Write the table, the picture, and what was swept.

    Parameters
    ----------
    folder : exists.
    result : the sweep.
    """
    write_text(folder / TABLE, table_of(result))
    picture_of(result).save(folder / PICTURE)
    entries = {
        "figure": result.inputs.figure,
        "at_project": None if math.isnan(result.at_operating) else result.at_operating,
        "parameters": [
            {
                "key": axis.key,
                "from": float(axis.values[0]),
                "to": float(axis.values[-1]),
                "count": len(axis.values),
                "project": own,
            }
            for axis, own in zip(result.inputs.axes, result.operating, strict=True)
        ],
    }
    write_text(folder / SUMMARY, json.dumps(entries, indent=2) + "\n")


def table_of(result: SweepResult) -> str:
    """Return the table: a row for each place, parameters in SI units and radians, empty where undefined.

    Parameters
    ----------
    result : the sweep.
    """
    axes = result.inputs.axes
    rows = [",".join((*(axis.key for axis in axes), result.inputs.figure))]
    for place in np.ndindex(result.values.shape):
        numbers = [float(axis.values[index]) for axis, index in zip(axes, place, strict=True)]
        value = float(result.values[place])
        rows.append(",".join([*(f"{number:.9g}" for number in numbers), "" if math.isnan(value) else f"{value:.9g}"]))
    return "\n".join(rows) + "\n"


def picture_of(result: SweepResult) -> Image.Image:
    """Return a curve over one parameter or a heatmap over two, with the project's own values marked.

    Parameters
    ----------
    result : the sweep.
    """
    picture = Image.new("RGB", SIZE, _PAPER)
    pen, figure = ImageDraw.Draw(picture), result.figure
    unit = f" [{figure.shown.unit}]" if figure.shown.unit else ""
    pen.text((_LEFT, 12), f"{figure.label}{unit}; red: the project's own value", fill=_INK)
    values = np.asarray(figure.shown.of(result.values))
    if result.values.ndim == 1:
        _draw_curve(pen, result, values)
    else:
        _draw_heatmap(picture, pen, result, values)
    return picture


def _box() -> tuple[int, int, int, int]:
    """Left, upper, right and lower edge of the drawing [pixels]."""
    return _LEFT, _ABOVE, SIZE[0] - _RIGHT, SIZE[1] - _BELOW


def _bounds(values: FloatArray) -> tuple[float, float]:
    """Smallest and largest known value, never the same."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _ticks(pen: ImageDraw.ImageDraw, across: tuple[str, float, float], up: tuple[str, float, float]) -> None:
    """Write names and five numbers along both axes."""
    left, above, right, below = _box()
    for step in range(5):
        share = step / 4.0
        x, y = left + share * (right - left), below - share * (below - above)
        pen.line([(x, below), (x, below + 5)], fill=_AXIS)
        pen.text((x - 18, below + 9), number_text(across[1] + share * (across[2] - across[1]), 4), fill=_INK)
        pen.line([(left - 5, y), (left, y)], fill=_AXIS)
        pen.text((left - 62, y - 6), number_text(up[1] + share * (up[2] - up[1]), 4), fill=_INK)
    pen.text(((left + right) / 2 - 60, below + 36), across[0], fill=_INK)
    if up[0]:
        pen.text((left, above - 18), up[0], fill=_INK)
    pen.rectangle([left, above, right, below], outline=_AXIS)


def _draw_curve(pen: ImageDraw.ImageDraw, result: SweepResult, values: FloatArray) -> None:
    left, above, right, below = _box()
    (axis,), figure = result.inputs.axes, result.figure
    start, end = float(axis.values[0]), float(axis.values[-1])
    low, high = _bounds(np.append(values, figure.shown.of(result.at_operating)))

    def place(parameter: float, value: float) -> tuple[float, float]:
        return (
            left + (parameter - start) / (end - start) * (right - left),
            below - (value - low) / (high - low) * (below - above),
        )

    points = [place(float(x), float(y)) if math.isfinite(y) else None for x, y in zip(axis.values, values, strict=True)]
    for one, other in itertools.pairwise(points):
        if one is not None and other is not None:
            pen.line([one, other], fill=_LINE, width=2)
    for point in points:
        if point is not None:
            pen.ellipse([point[0] - 2, point[1] - 2, point[0] + 2, point[1] + 2], fill=_LINE)
    own = result.operating[0]
    if min(start, end) <= own <= max(start, end) and math.isfinite(result.at_operating):
        x, y = place(own, float(figure.shown.of(result.at_operating)))
        pen.ellipse([x - 6, y - 6, x + 6, y + 6], outline=_POINT, width=3)
    _ticks(pen, (axis.key, start, end), ("", low, high))


def _draw_heatmap(picture: Image.Image, pen: ImageDraw.ImageDraw, result: SweepResult, values: FloatArray) -> None:
    left, above, right, below = _box()
    right -= 110
    low, high = _bounds(values)
    shares = np.clip((values - low) / (high - low), 0.0, 1.0)[..., np.newaxis]
    colors = np.where(np.isfinite(shares), _LOW + shares * (_HIGH - _LOW), np.array(_UNDEFINED))
    # First axis to the right, second one up.
    cells = Image.fromarray(np.transpose(colors, (1, 0, 2))[::-1].astype(np.uint8))
    picture.paste(cells.resize((right - left, below - above), Image.Resampling.NEAREST), (left, above))
    ends = [(float(axis.values[0]), float(axis.values[-1])) for axis in result.inputs.axes]
    at = []
    for (start, end), own, count in zip(ends, result.operating, values.shape, strict=True):
        # Each value is the middle of its cell.
        at.append(((own - start) / (end - start) * (count - 1) + 0.5) / count)
    if all(0.0 <= share <= 1.0 for share in at):
        x, y = left + at[0] * (right - left), below - at[1] * (below - above)
        pen.ellipse([x - 6, y - 6, x + 6, y + 6], outline=_POINT, width=3)
    for step in range(100):
        color = tuple(int(each) for each in _LOW + step / 99.0 * (_HIGH - _LOW))
        y = below - (step + 1) / 100.0 * (below - above)
        pen.rectangle([right + 30, y, right + 50, y + (below - above) / 100.0], fill=color)
    pen.text((right + 56, above), number_text(high, 4), fill=_INK)
    pen.text((right + 56, below - 12), number_text(low, 4), fill=_INK)
    for number, (start, end) in enumerate(ends):
        name = result.inputs.axes[number].key
        if number == 0:
            pen.text((left, below + 9), number_text(start, 4), fill=_INK)
            pen.text((right - 40, below + 9), number_text(end, 4), fill=_INK)
            pen.text(((left + right) / 2 - 60, below + 36), name, fill=_INK)
        else:
            pen.text((left - 62, below - 12), number_text(start, 4), fill=_INK)
            pen.text((left - 62, above), number_text(end, 4), fill=_INK)
            pen.text((left, above - 18), f"up: {name}", fill=_INK)
