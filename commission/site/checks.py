"""Range checks: of the fields of a value by what stands beside them, and of single numbers. Each says what it found."""

from __future__ import annotations

import math
import typing
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from commission.site.fields import described
from commission.site.quantity import Bounds, Choice, Quantity


def at_least(value: float, limit: float, name: str, unit: str = "") -> None:
    """Check `limit` <= `value` <= `quantity.LARGEST`.

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
    Bounds.at_least(limit).check(value, name, unit)


def above(value: float, limit: float, name: str, unit: str = "") -> None:
    """Check `limit` < `value` <= `quantity.LARGEST`.

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
    Bounds.above(limit).check(value, name, unit)


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
    Bounds.between(*limits).check(value, name, unit)


def check_fields(value: object, prefix: str = "") -> None:
    """Raise ValueError unless each number of a value is within its bounds and each word is one of its options.

    Parameters
    ----------
    value : a dataclass, from its `__post_init__`.
    prefix : what stands before the field's name in the message: `scanner.`.
    """
    for check in _checks(type(value)):
        content = getattr(value, check.name)
        # One comparison for the many numbers that are alone in their field: a drag checks thousands of them.
        if content is None or (type(content) is float and check.least <= content <= check.most):
            continue
        if check.options:
            if content not in check.options:
                options = " or ".join(repr(option) for option in check.options)
                raise ValueError(f"{prefix}{check.name} is {content!r}; expected {options}")
        else:
            _check_numbers(content, check.quantities, prefix + check.name)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Check:
    """What one field is checked for: the options of a word, or the bounds of its numbers."""

    name: str
    options: tuple[str, ...] = ()
    quantities: tuple[Quantity, ...] = ()
    least: float = math.inf
    """Smallest and largest number that is surely allowed: the bounds of the first quantity."""
    most: float = -math.inf


@cache
def _checks(kind: type) -> tuple[_Check, ...]:
    """Return what is checked of a dataclass, in the order of its fields."""
    found = []
    for name, descriptions in described(kind):
        first = descriptions[0]
        if isinstance(first, Choice) and first.options:
            found.append(_Check(name=name, options=first.options))
        elif isinstance(first, Quantity):
            bounds = first.bounds
            found.append(
                _Check(
                    name=name,
                    quantities=typing.cast("tuple[Quantity, ...]", descriptions),
                    least=math.nextafter(bounds.low, math.inf) if bounds.excludes_low else bounds.low,
                    most=math.nextafter(bounds.high, -math.inf) if bounds.excludes_high else bounds.high,
                )
            )
    return tuple(found)


def _check_numbers(content: Any, quantities: tuple[Quantity, ...], name: str) -> None:
    if isinstance(content, np.ndarray):
        if len(quantities) == 1 and (content.size == 0 or _within(content, quantities[0])):
            return
        content = content.tolist()
    if not isinstance(content, tuple | list):
        quantities[0].bounds.check(content, name, quantities[0].unit)
        return
    for index, element in enumerate(content):
        own = quantities if len(quantities) == 1 else quantities[index : index + 1]
        _check_numbers(element, own, f"{name}[{index}]")


def _within(numbers: np.ndarray[Any, Any], quantity: Quantity) -> bool:
    return float(numbers.min()) in quantity.bounds and float(numbers.max()) in quantity.bounds
