"""A figure of a calibration in words: what people call it, its change with as many digits as its 1-sigma allows.

Page and commands say the same; nothing is estimated in here.
"""

from __future__ import annotations

import math

from commission.site.fields import field_info
from commission.site.parameters import Parameters
from commission.studies.calibration_values import Value

MOST_DECIMALS = 5


def label_of(key: str) -> str:
    """Return what people call a figure.

    Parameters
    ----------
    key : see `Value.key`.
    """
    group, _, name = key.partition(".")
    if group == "reflectors":
        of, _, axis = name.rpartition(".")
        return f"{of}: {axis}"
    if group == "scanners":
        for field, words in (("clock_offset", "clock offset"), *((f"mounting.{a}", f"mounting {a}") for a in AXES)):
            if name.endswith(f".{field}"):
                return f"{name.removesuffix(f'.{field}')}: {words}"
    label = field_info(Parameters(), key).label
    return f"Odometry noise: {label.lower()}" if group == "odometry" and "_per_sqrt_" in name else label


AXES = ("x", "y", "heading")
"""Of a mounting."""


def decimals_of(value: Value) -> int:
    """Return the decimals by which a figure is written: two digits of its 1-sigma, in the unit that people read."""
    sigma = abs(value.shown.of(value.sigma))
    if not (math.isfinite(sigma) and sigma > 0.0):
        return 2
    return min(max(1 - math.floor(math.log10(sigma)), 0), MOST_DECIMALS)


def text_of(value: Value, content: float) -> str:
    """Return a value of a figure with its unit, `16.24 mm`.

    Parameters
    ----------
    value : the figure.
    content : what it is, SI units and radians.
    """
    return value.shown.text(content, f".{decimals_of(value)}f")


def change_of(value: Value) -> str:
    """Return how a figure changes and how sure that is: `30.00 → 16.24 ± 0.40 mm`."""
    form = f".{decimals_of(value)}f"
    before, after = (value.shown.number(each, form) for each in (value.before, value.proposed))
    return f"{before} → {after} ± {value.shown.text(value.sigma, form)}"


def stretches_of(value: Value) -> str:
    """Return which stretches of the drive say most of a figure: `12–24 s, 60–72 s`; empty: the whole drive alike."""
    return ", ".join(f"{begin:.0f}–{end:.0f} s" for begin, end in value.stretches)
