"""Which values a person can give to a widget: what viser's page itself would send, and nothing else.

viser casts what comes and keeps it; a whole number beyond 64 bits could then not be sent to any browser ever again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import viser

from commission.app.base.wire import shown

LONGEST_LINE = 1_000
"""Letters of a text field; a path has at most 4,096, and nobody types one that long."""
LONGEST_TEXT = 1_000_000
"""Letters of a field of several lines: a table of some 20,000 reflectors."""
INT64 = range(-(2**63), 2**63)
ROUNDING = 1e-9
"""Share by which a float may lie beyond a bound: a slider's last step is a sum of floats."""


def problem_with(widget: object, value: object) -> str | None:
    """Say why a person cannot have given a widget this value; None when it is all right.

    The text says what was found and what is expected, and names no widget.
    """
    for kind, check in _CHECKS:
        if isinstance(widget, kind):
            return check(widget, value)
    return f"found {shown(value)}; expected nothing: it cannot be changed"


def _number_problem(value: object, like: object) -> str | None:
    """Say why something is no number of the kind that stands in the widget."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"found {shown(value)}; expected a number"
    if not math.isfinite(value):
        return f"found {shown(value)}; expected a finite number"
    if isinstance(like, int) and (value != int(value) or int(value) not in INT64):
        return f"found {shown(value)}; expected a whole number of at most 64 bits"
    return None


def _bounds_problem(value: float, low: float | None, high: float | None) -> str | None:
    """Say which bound a number exceeds."""
    # Of each bound its own: a large one at one end would let too much pass the other.
    if (low is None or value >= low - _slack(low)) and (high is None or value <= high + _slack(high)):
        return None
    if high is None:
        return f"found {shown(value)}; expected at least {low:g}"
    return f"found {shown(value)}; expected {'at most' if low is None else f'{low:g} to'} {high:g}"


def _slack(bound: float) -> float:
    return ROUNDING * max(abs(bound), 1.0)


def _check_number(widget: Any, value: Any) -> str | None:
    return _number_problem(value, widget.value) or _bounds_problem(value, widget.min, widget.max)


def _check_numbers(widget: Any, value: Any) -> str | None:
    """As many numbers as there are now, each within its bounds; one bound for all, or one for each."""
    now = widget.value
    if not isinstance(value, list | tuple) or len(value) != len(now):
        return f"found {shown(value)}; expected {len(now)} numbers"
    lows, highs = (_each(bound, len(now)) for bound in (widget.min, widget.max))
    each = zip(value, now, lows, highs, strict=True)
    problems = (_number_problem(new, old) or _bounds_problem(new, low, high) for new, old, low, high in each)
    return next((problem for problem in problems if problem), None)


def _each(bound: float | Sequence[float] | None, count: int) -> Sequence[float | None]:
    return bound if isinstance(bound, Sequence) else (bound,) * count


def _check_color(widget: Any, value: Any) -> str | None:
    now = widget.value
    if not isinstance(value, list | tuple) or len(value) != len(now):
        return f"found {shown(value)}; expected {len(now)} numbers from 0 to 255"
    problems = (_number_problem(new, 0) or _bounds_problem(new, 0, 255) for new in value)
    return next((problem for problem in problems if problem), None)


def _check_text(widget: Any, value: Any) -> str | None:
    if not isinstance(value, str):
        return f"found {shown(value)}; expected text"
    longest = LONGEST_TEXT if widget.multiline else LONGEST_LINE
    if len(value) > longest:
        return f"found more than {longest:,} letters; expected at most as many"  # the page cuts what is far longer
    allowed = "\t\n\r" if widget.multiline else "\t"
    odd = next((letter for letter in value if (letter < " " or letter == "\x7f") and letter not in allowed), None)
    return None if odd is None else f"found the control character {odd!r}; expected text"


def _check_switch(_widget: Any, value: Any) -> str | None:
    return None if isinstance(value, bool) else f"found {shown(value)}; expected true or false"


def _check_press(_widget: Any, value: Any) -> str | None:
    return None if value is True else f"found {shown(value)}; expected true"


def _check_choice(widget: Any, value: Any) -> str | None:
    # `in` would take 1 for True, and a list is as good as none.
    known = isinstance(value, str) and value in widget.options
    return None if known else f"found {shown(value)}; expected one of the choices shown"


_CHECKS: tuple[tuple[type, Callable[[Any, Any], str | None]], ...] = (
    (viser.GuiButtonHandle, _check_press),
    (viser.GuiButtonGroupHandle, _check_choice),
    (viser.GuiDropdownHandle, _check_choice),
    (viser.GuiCheckboxHandle, _check_switch),
    (viser.GuiNumberHandle, _check_number),
    (viser.GuiSliderHandle, _check_number),
    (viser.GuiMultiSliderHandle, _check_numbers),
    (viser.GuiVector2Handle, _check_numbers),
    (viser.GuiVector3Handle, _check_numbers),
    (viser.GuiRgbHandle, _check_color),
    (viser.GuiRgbaHandle, _check_color),
    (viser.GuiTextHandle, _check_text),
)
