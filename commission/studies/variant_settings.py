"""Which parameters variants differ in, as the page and files write them. Nothing is compared but settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from commission.site.fields import field_info, get_field, walk_fields
from commission.site.parameters import Parameters
from commission.site.uncertainty import Uncertainty
from commission.studies.run import RunResult


@dataclass(frozen=True, slots=True)
class DifferingSetting:
    """One setting in which V variants are not the same."""

    key: str
    """Its dotted name: `association.gate_probability`, `uncertainty.survey`."""
    label: str
    """What people call it."""
    texts: tuple[str, ...]
    """(V) its value in each, in the page's unit."""


def differing_settings(runs: Sequence[RunResult]) -> tuple[DifferingSetting, ...]:
    """Return the parameters and uncertainties in which runs differ; of each run those that it ends with.

    Parameters
    ----------
    runs : the variants.
    """
    setups = [run.inputs.segments[-1].setup for run in runs]
    values: list[tuple[str, type, list[Any]]] = [
        ("", Parameters, [setup.parameters for setup in setups]),
        ("uncertainty.", Uncertainty, [setup.uncertainty for setup in setups]),
    ]
    found = []
    for prefix, kind, each in values:
        for name, _ in walk_fields(kind):
            contents = [get_field(value, name) for value in each]
            if any(content != contents[0] for content in contents):
                texts = tuple(written(value, name) for value in each)
                found.append(DifferingSetting(prefix + name, field_info(each[0], name).label, texts))
    return tuple(found)


def written(value: object, name: str) -> str:
    """Return a field of parameters or uncertainty as a person reads it.

    Parameters
    ----------
    value : the parameters or the uncertainty.
    name : dotted name of the field.
    """
    quantity, content = field_info(value, name).quantity, get_field(value, name)
    if isinstance(content, bool):
        return "on" if content else "off"
    if quantity is None or not isinstance(content, int | float):
        return str(content)
    return quantity.brief(content)
