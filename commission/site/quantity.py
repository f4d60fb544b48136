"""What a value is, said once beside its field: label, unit, unit on the page, bounds, step. Not the value itself.

`speed: Annotated[float, Quantity(label="Speed", unit="m/s", bounds=Bounds.between(0.01, 5.0))]` is all that checks,
comments in files, help of commands and widgets need to know; `fields` reads it. The hint is the docstring below.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, TypeAlias, overload

if TYPE_CHECKING:  # commands read units from here, and their help does not wait for numpy
    from commission.geometry.arrays import FloatArray

LARGEST = 1e9
"""No length, angle, speed or sigma that anybody means is larger; squares and products of much larger ones overflow."""
FARTHEST = 1e7
"""Largest coordinate [m]: any national grid fits, and no square of it overflows."""
STAMP_LIMIT = 2**62
"""Stamps [ns] are smaller, and larger than its negative: the difference of any two fits into 64 bits."""
AS_IN_A_FILE = 5.5e-6
"""Share by which a number in a file differs from the one that was meant: half of the last of six digits, and a bit."""
UNREADABLE = 1e15
"""Numbers from here on are written with an exponent: nobody counts so many digits."""
SIGNIFICANT = 6
"""Digits in a file of what has no fixed number of decimals: a sigma, a speed, a probability."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """Between which numbers a value lies."""

    low: float = -LARGEST
    """Smallest number."""
    high: float = LARGEST
    """Largest number."""
    excludes_low: bool = False
    """Whether `low` itself is too small."""
    excludes_high: bool = False
    """Whether `high` itself is too large."""

    @classmethod
    def above(cls, low: float) -> Bounds:
        """More than `low`."""
        return cls(low, excludes_low=True)

    @classmethod
    def at_least(cls, low: float) -> Bounds:
        """`low` or more."""
        return cls(low)

    @classmethod
    def between(cls, low: float, high: float) -> Bounds:
        """From `low` to `high`, both allowed."""
        return cls(low, high)

    @classmethod
    def inside(cls, low: float, high: float) -> Bounds:
        """More than `low` and less than `high`."""
        return cls(low, high, excludes_low=True, excludes_high=True)

    def __contains__(self, value: float) -> bool:
        """Whether a number is allowed; NaN never is."""
        above = value > self.low if self.excludes_low else value >= self.low
        return above and (value < self.high if self.excludes_high else value <= self.high)

    def check(self, value: float, name: str, unit: str = "") -> None:
        """Refuse a value that is not allowed, NaN included.

        Parameters
        ----------
        value : what was found.
        name : what the message calls it.
        unit : unit of the value and of the bounds.

        Raises
        ------
        ValueError
            says what was found and what is expected.
        """
        if value not in self:
            raise ValueError(f"{name} is {value:g}; expected {self.expected(value, unit)}")

    def expected(self, value: float, unit: str = "", scale: float = 1.0) -> str:
        """Words for what is expected instead of a value that is not allowed.

        Parameters
        ----------
        value : what was found, in the unit of the bounds.
        unit : what the words are in.
        scale : number of these in one unit of the bounds.
        """
        if self.high == LARGEST and value > LARGEST:
            return f"at most {_with_unit(LARGEST * scale, unit)}"
        return self.words(unit, scale)

    def words(self, unit: str = "", scale: float = 1.0) -> str:
        """All that is allowed, in words: `more than 0 m`, `0 to 1`; `scale` leads to another unit."""
        low, high = f"{self.low * scale:g}", _with_unit(self.high * scale, unit)
        if self.low == -LARGEST and self.high == LARGEST:
            return "a finite number"
        if self.high == LARGEST:
            low = _with_unit(self.low * scale, unit)
            return f"more than {low}" if self.excludes_low else f"{low} or more"
        if self.low == -LARGEST:
            return f"{'less than' if self.excludes_high else 'at most'} {high}"
        if not self.excludes_low and not self.excludes_high:
            return f"{low} to {high}"
        first = f"more than {low}" if self.excludes_low else f"{low} or more"
        return f"{first} and {'less than' if self.excludes_high else 'at most'} {high}"


POSITIVE = Bounds.above(0.0)
NOT_NEGATIVE = Bounds.at_least(0.0)
SHARE = Bounds.between(0.0, 1.0)
COORDINATE = Bounds.between(-FARTHEST, FARTHEST)


@dataclass(frozen=True, slots=True)
class Shown:
    """Unit in which people read a quantity."""

    unit: str
    """How it is written; empty: none."""
    scale: float
    """Number of these in one unit of the file."""

    @overload
    def of(self, value: float) -> float: ...
    @overload
    def of(self, value: FloatArray) -> FloatArray: ...
    def of(self, value: float | FloatArray) -> float | FloatArray:
        """Return the number, or the numbers, that people read for a value in the unit of code and files."""
        return value * self.scale

    def text(self, value: float, form: str = ".0f") -> str:
        """Return a value as it is written: number and unit.

        Parameters
        ----------
        value : in the unit of code and files.
        form : how Python formats the number: `.1f`, `.4g`.
        """
        return joined(self.number(value, form), self.unit)

    def number(self, value: float, form: str = ".0f") -> str:
        """Return a value as it is written where the unit stands elsewhere: no minus before a zero."""
        written = _formatted(value * self.scale, form)
        return written.replace("-", "") if float(written) == 0.0 and "+" not in form else written

    def against(self, value: float, limit: float, forms: tuple[str, str] = (".1f", ".0f")) -> str:
        """Return a value and its limit, `12.3 / 60 mm`.

        Parameters
        ----------
        value, limit : in the unit of code and files.
        forms : how Python formats the one and the other.
        """
        return f"{self.number(value, forms[0])} / {self.text(limit, forms[1])}"


MILLIMETRES = Shown("mm", 1000.0)
DEGREES = Shown("°", math.degrees(1.0))
PLAIN_DEGREES = Shown("deg", math.degrees(1.0))
"""Of what commands print and files say: characters that every terminal has."""
MILLISECONDS = Shown("ms", 1000.0)
PERCENT = Shown("%", 100.0)
AS_DEGREES = Shown("°", 1.0)
"""Of a field whose name ends in `_deg`."""
BARE = Shown("", 1.0)
"""Of a unit that the label says already."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """A number with its unit; in a list it is said of each number of it."""

    label: str
    """What people call it, short enough to stand beside a widget."""
    unit: str = ""
    """Its unit in code and files; empty: a count or a ratio."""
    shown: Shown | None = None
    """Its unit on the page; none: the same."""
    bounds: Bounds = Bounds()
    """Which numbers are allowed."""
    step: float = 0.001
    """Step of its widget, in the page's unit; texts have its decimals."""
    slider: tuple[float, float] | None = None
    """Ends of its slider in the page's unit, a value beyond moves them; none: it is typed."""
    is_tail: bool = False
    """Whether its slider is logarithmic in what is missing to 1: of a probability near 1."""
    entry: tuple[float, float] | None = None
    """What may be typed on the page, in its unit; none: what the bounds allow."""
    decimals: int | None = None
    """Decimals in files that people read; none: six significant digits."""
    none: str = ""
    """Word on the page for a value that is None; empty: the page has no way to enter that."""

    @property
    def shown_unit(self) -> str:
        """Unit on the page."""
        return self.unit if self.shown is None else self.shown.unit

    @property
    def scale(self) -> float:
        """Number on the page for one unit of the file."""
        return 1.0 if self.shown is None else self.shown.scale

    @property
    def title(self) -> str:
        """Label with the unit of the page."""
        return f"{self.label} [{self.shown_unit}]" if self.shown_unit else self.label

    def on_page(self, value: float) -> float:
        """Return a value in the page's unit: with the decimals of its step where that is the same, else six digits.

        A file has six digits of radians, of which 3 degrees would be 3.00001.
        """
        if isinstance(value, int) and self.scale == 1.0:
            return value
        number = float(value) * self.scale
        plain = round(number, decimals_of(self.step))
        return plain if math.isclose(plain, number, rel_tol=AS_IN_A_FILE) else float(f"{number:.6g}")

    def of_page(self, number: float) -> float:
        """Return what a number on the page means."""
        return number / self.scale

    def text(self, value: float) -> str:
        """Return a value as the page writes it: number, with the decimals of its step, and unit."""
        return joined(f"{value * self.scale:z.{decimals_of(self.step)}f}", self.shown_unit)

    def change_text(self, before: float, after: float) -> str:
        """Return how a value changes, `1.250 → 1.275 m`; empty: by less than the last digit."""
        old, new = (f"{value * self.scale:z.{decimals_of(self.step)}f}" for value in (before, after))
        return "" if old == new else f"{old} → {joined(new, self.shown_unit)}"

    def brief(self, value: float) -> str:
        """Return a value as the page writes it where room is scarce: with no digit that says nothing."""
        return joined(self.digits(value), self.shown_unit)

    def digits(self, value: float) -> str:
        """Return the number that the page shows for a value, with no digit that says nothing and none lost."""
        return f"{self.on_page(value):z.11g}"

    def limits(self) -> str:
        """Say in the page's unit what may be entered, on a slider what lies between its ends; empty: any number."""
        if ends := self.slider or self.entry:
            low, high = ends
            return f"{low:g} to {_with_unit(high, self.shown_unit)}"
        if self.bounds.low in (-LARGEST, -FARTHEST) and self.bounds.high in (LARGEST, FARTHEST):
            return ""
        return self.bounds.words(self.shown_unit, self.scale)

    def refusal(self, value: float) -> str:
        """Say in the page's unit why a value is not allowed; empty when it is."""
        if value in self.bounds:
            return ""
        expected = self.bounds.expected(value, self.shown_unit, self.scale)
        return f"{self.label} is {_with_unit(value * self.scale, self.shown_unit)}; expected {expected}"

    def in_file(self, value: float) -> float:
        """Return a value rounded for a file; twice is the same as once, and the result is allowed if the value is."""
        if isinstance(value, int) or not math.isfinite(value):
            return value
        # Adding zero turns -0.0 into 0.0.
        rounded = float(f"{value:.{SIGNIFICANT}g}") if self.decimals is None else round(float(value), self.decimals)
        return rounded + 0.0 if rounded in self.bounds else value


X = Quantity(label="x", unit="m", bounds=COORDINATE, decimals=4)
Y = Quantity(label="y", unit="m", bounds=COORDINATE, decimals=4)


@dataclass(frozen=True, slots=True)
class Switch:
    """What is on or off."""

    label: str
    """What people call it."""


@dataclass(frozen=True, slots=True)
class Choice:
    """One of several words."""

    label: str
    """What people call it."""
    options: tuple[str, ...] = ()
    """The words; empty: those of the field's enumeration."""


@dataclass(frozen=True, slots=True)
class Words:
    """Free text."""

    label: str
    """What people call it."""


@dataclass(frozen=True, slots=True)
class Group:
    """Values that belong together, under one heading."""

    label: str
    """The heading."""


Description: TypeAlias = Quantity | Switch | Choice | Words | Group
"""What stands beside a field that the engineer edits."""


def decimals_of(step: float) -> int:
    """Decimals that a step has: 3 for 0.005, none for 20."""
    exponent = Decimal(repr(step)).normalize().as_tuple().exponent
    return max(0, -exponent) if isinstance(exponent, int) else 0


def number_text(value: float, digits: int = 3) -> str:
    """Return a number with so many digits, or with all before its point where those are more: never 1.37e+04.

    Parameters
    ----------
    value : any number.
    digits : that are told.
    """
    short = f"{value:.{digits}g}"
    return f"{value:.0f}" if 10.0**digits <= abs(float(short)) < UNREADABLE else short


def counted_text(count: int, one: str, several: str = "") -> str:
    """Return how many there are of something: `1 route`, `2 routes`.

    Parameters
    ----------
    count : how many.
    one : what one of them is called.
    several : what several are called; empty: with an s at its end.
    """
    return f"{count} {one if count == 1 else several or one + 's'}"


def _formatted(number: float, form: str) -> str:
    """A number in a form of Python's; `.4g` means four digits, without an exponent where it is large."""
    return number_text(number, int(form[1:-1])) if form.endswith("g") and form.startswith(".") else f"{number:{form}}"


def _with_unit(number: float, unit: str) -> str:
    return joined(f"{number:g}", unit)


def joined(number: str, unit: str) -> str:
    """Return number and unit, with the blank that stands between all but a degree sign."""
    return f"{number}{unit}" if unit == "°" else f"{number} {unit}".rstrip()
