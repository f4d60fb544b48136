"""Range checks: of the fields of a value by what stands beside them, and of single numbers. Each says what it found."""

from __future__ import annotations

import typing
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
    for name, descriptions in described(type(value)):
        content = getattr(value, name)
        if content is None:
            continue
        if isinstance(descriptions[0], Choice) and descriptions[0].options:
            if content not in descriptions[0].options:
                options = " or ".join(repr(option) for option in descriptions[0].options)
                raise ValueError(f"{prefix}{name} is {content!r}; expected {options}")
        elif isinstance(descriptions[0], Quantity):
            _check_numbers(content, typing.cast("tuple[Quantity, ...]", descriptions), prefix + name)


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
