"""Units that a drawing may be made in: what it states ($INSUNITS), what its size suggests, and when the two disagree.

Sizes are judged as a person would: a hall measures five metres to a kilometre.
"""

from __future__ import annotations

from collections.abc import Iterable

from commission.site.quantity import number_text

UNITS = {
    "mm": 0.001,
    "cm": 0.01,
    "m": 1.0,
    "in": 0.0254,
    "ft": 0.3048,
    "yd": 0.9144,
    "us-ft": 1200.0 / 3937.0,
    "dm": 0.1,
    "km": 1000.0,
}
"""Metres in each unit that can be chosen; `us-ft` is the US survey foot."""

_STATED = {
    1: ("in", UNITS["in"]),
    2: ("ft", UNITS["ft"]),
    3: ("mi", 1609.344),
    4: ("mm", UNITS["mm"]),
    5: ("cm", UNITS["cm"]),
    6: ("m", 1.0),
    7: ("km", UNITS["km"]),
    8: ("uin", 0.0254e-6),
    9: ("mil", 0.0254e-3),
    10: ("yd", UNITS["yd"]),
    11: ("angstrom", 1e-10),
    12: ("nm", 1e-9),
    13: ("um", 1e-6),
    14: ("dm", UNITS["dm"]),
    15: ("dam", 10.0),
    16: ("hm", 100.0),
    17: ("Gm", 1e9),
    18: ("au", 149_597_870_700.0),
    19: ("ly", 9_460_730_472_580_800.0),
    20: ("pc", 3.0856775814913673e16),
    21: ("us-ft", UNITS["us-ft"]),
    22: ("us-in", 100.0 / 3937.0),
    23: ("us-yd", 3600.0 / 3937.0),
    24: ("us-mi", 6_336_000.0 / 3937.0),
}
"""$INSUNITS (DXF reference, header variables): name and metres of each unit; 0 names none."""

_SMALLEST_HALL, _LARGEST_HALL = 5.0, 1000.0
_DOUBTED = 3.0, 3000.0
"""A stated unit is doubted outside of these sizes [m]: a drawing may hold no more than a cell, or a whole plant."""
_USUAL = ("m", "mm", "cm")
"""What a drawing without a unit may be in, the likeliest first where several give a hall."""
_OTHERS = ("mm", "cm", "m", "in", "ft")

Size = tuple[float, float]


def stated_unit(code: int) -> tuple[str, float] | None:
    """Return name and metres of a unit by its $INSUNITS; none for 0 and for codes that do not exist."""
    return _STATED.get(code)


def is_hall(size: Size) -> bool:
    """Whether something of this size [m] may be a hall."""
    return _SMALLEST_HALL <= max(size) <= _LARGEST_HALL


def judged_unit(size: Size) -> str:
    """Return the unit that makes a drawing of this size [drawing units] a hall, the likeliest one where none does."""
    fitting = (unit for unit in _USUAL if is_hall(_scaled(size, UNITS[unit])))
    return next(fitting, "mm" if max(size) > _LARGEST_HALL else "m")


def doubts(size: Size, unit: str, metres: float, *, is_stated: bool) -> str:
    """Return what is to be said about a drawing's unit; empty where nothing is.

    Parameters
    ----------
    size : width and height [drawing units].
    unit, metres : the unit that is taken, and its length [m].
    is_stated : whether the drawing names it; otherwise it was judged by the size.
    """
    measures = _measures(size, metres)
    others = [
        f"{other} ({_measures(size, UNITS[other])})"
        for other in _OTHERS
        if other != unit and is_hall(_scaled(size, UNITS[other]))
    ]
    instead = f"; by --unit (on the page: Unit) it could be {_listed(others)}" if others else ""
    if not is_stated:
        doubt = "" if is_hall(_scaled(size, metres)) else ", which no hall does"
        judged = f"judged by its size it is drawn in {unit} and measures {measures}{doubt}"
        return f"the drawing names no unit; {judged}{instead}"
    if max(size) == 0.0 or _DOUBTED[0] <= max(_scaled(size, metres)) <= _DOUBTED[1]:
        return ""
    why = "; inches are what many programs leave where nobody chose" if unit == "in" else ""
    return f"the drawing says that its unit is {unit}, so it measures {measures}, which no hall does{why}{instead}"


def _scaled(size: Size, metres: float) -> Size:
    return size[0] * metres, size[1] * metres


def _measures(size: Size, metres: float) -> str:
    width, height = _scaled(size, metres)
    return f"{number_text(width, 4)} x {number_text(height, 4)} m"


def _listed(words: Iterable[str]) -> str:
    return " or ".join(words)
