"""What a person can ask about layouts that are compared, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.app.base.inputs import Setting


@dataclass(frozen=True, slots=True)
class KeepLayout(Action):
    """Keep the reflectors as they stand now, beside what is tried next."""


@dataclass(frozen=True, slots=True)
class ForgetLayout(Action):
    """Forget a kept layout."""

    number: int
    """Which one."""


@dataclass(frozen=True, slots=True)
class SwitchLayout(Action):
    """Put a kept layout up; the one of now is kept, unless it is already."""

    number: int
    """Which one."""


@dataclass(frozen=True, slots=True)
class SetComparison(Action):
    """Change what is compared, or what the floor shows of it."""

    name: str
    """Field of `LayoutsState`."""
    value: Setting
    """New value."""
