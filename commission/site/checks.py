"""Range checks shared by the values of a site, and the hint of a field. Each check says what was found and expected."""

from __future__ import annotations

import ast
import functools
import inspect
import itertools
import textwrap

FARTHEST = 1e7
"""Largest coordinate [m]: any national grid fits, and no square of it overflows."""
LARGEST = 1e9
"""No length, angle, speed or sigma that anybody means is larger; squares and products of much larger ones overflow."""
STAMP_LIMIT = 2**62
"""Stamps [ns] are smaller, and larger than its negative: the difference of any two fits into 64 bits."""


def at_least(value: float, limit: float, name: str, unit: str = "") -> None:
    """Check `limit` <= `value` <= LARGEST.

    Parameters
    ----------
    value : what was found.
    limit : smallest value.
    name : what the message calls it.
    unit : what the message adds to the limit.

    Raises
    ------
    ValueError
        otherwise; NaN is refused, too.
    """
    if value > LARGEST:
        raise ValueError(f"{name} is {value:g}; expected at most {LARGEST:g}{unit and ' ' + unit}")
    if not value >= limit:
        raise ValueError(f"{name} is {value:g}; expected {limit:g}{unit and ' ' + unit} or more")


def above(value: float, limit: float, name: str, unit: str = "") -> None:
    """Check `limit` < `value` <= LARGEST.

    Parameters
    ----------
    value : what was found.
    limit : what it must exceed.
    name : what the message calls it.
    unit : what the message adds to the limit.

    Raises
    ------
    ValueError
        otherwise; NaN is refused, too.
    """
    if value > LARGEST:
        raise ValueError(f"{name} is {value:g}; expected at most {LARGEST:g}{unit and ' ' + unit}")
    if not value > limit:
        raise ValueError(f"{name} is {value:g}; expected more than {limit:g}{unit and ' ' + unit}")


def between(value: float, limits: tuple[float, float], name: str, unit: str = "") -> None:
    """Check limits[0] <= `value` <= limits[1].

    Parameters
    ----------
    value : what was found.
    limits : smallest and largest value.
    name : what the message calls it.
    unit : what the message adds to the limit.

    Raises
    ------
    ValueError
        otherwise; NaN is refused, too.
    """
    low, high = limits
    if not (low <= value <= high):
        raise ValueError(f"{name} is {value:g}; expected {low:g} to {high:g}{unit and ' ' + unit}")


@functools.cache
def field_hints(cls: type) -> dict[str, str]:
    """Docstring under each field of a dataclass, by the field's name: help of commands and widgets, written once."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(cls)))
    body = next(node for node in tree.body if isinstance(node, ast.ClassDef)).body
    hints: dict[str, str] = {}
    for statement, following in itertools.pairwise(body):
        if (
            isinstance(statement, ast.AnnAssign)
            and isinstance(statement.target, ast.Name)
            and isinstance(following, ast.Expr)
            and isinstance(following.value, ast.Constant)
            and isinstance(following.value.value, str)
        ):
            hints[statement.target.id] = " ".join(following.value.value.split())
    return hints
