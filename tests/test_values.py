"""Rules that every value of the package keeps, whatever room it stands in."""

import dataclasses
import importlib
import inspect
import pkgutil
from collections.abc import Iterator

import commission

POSITIONAL = 4
"""Fields that a value may have and still be made by position: with more, nobody knows at the call which is which."""


def values() -> Iterator[type]:
    """Every dataclass of the package that has a constructor of its own fields."""
    for module in pkgutil.walk_packages(commission.__path__, "commission."):
        if module.name == "commission.__main__":
            continue
        for value in vars(importlib.import_module(module.name)).values():
            if (
                inspect.isclass(value)
                and value.__module__ == module.name
                and dataclasses.is_dataclass(value)
                and value.__dataclass_params__.init
            ):
                yield value


def test_a_value_of_more_than_four_fields_is_made_by_keyword():
    found = []
    for value in values():
        given = [field for field in dataclasses.fields(value) if field.init]
        if len(given) > POSITIONAL and not all(field.kw_only for field in given):
            found.append(f"{value.__module__}.{value.__qualname__}: {len(given)} fields; expected kw_only=True")
    assert not found, "\n".join(found)
