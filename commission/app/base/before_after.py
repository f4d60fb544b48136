"""What two layouts of reflectors come to, side by side, and which of the two is better. Pure: from values to HTML."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from commission.app.base.panel import escaped
from commission.planning.layout_figures import LayoutFigures, RouteFigures, StationFigures
from commission.site.quantity import DEGREES, MILLIMETRES


class ComparedLine(NamedTuple):
    """One figure of two layouts; without figures the heading of those that follow."""

    what: str
    now: str = ""
    then: str = ""
    gain: float = 0.0
    """How much better the second is; 0 or NaN: neither is."""


def before_after(
    before: LayoutFigures,
    after: LayoutFigures,
    heads: tuple[str, str] = ("now", "suggested"),
    more: Sequence[ComparedLine] = (),
) -> str:
    """Return a table of three columns: what it is, with its unit; the one layout; the other, colored where it differs.

    Parameters
    ----------
    before, after : of the same routes and stations.
    heads : what the two are called.
    more : lines that follow.
    """
    lines = [ComparedLine("Reflectors", str(before.reflectors), str(after.reflectors))]
    for one, other in zip(before.routes, after.routes, strict=True):
        lines += _of_route(one, other)
    for one, other in zip(before.stations, after.stations, strict=True):
        lines += _of_station(one, other)
    if before.places:
        lines += [
            ComparedLine("All routes, all places"),
            _count("Vital reflectors", before.stopping, after.stopping),
            _count(f"Ambiguous places, of {after.places}", before.ambiguous, after.ambiguous),
        ]
    return compared(heads, (*lines, *more))


def compared(heads: tuple[str, str], lines: Sequence[ComparedLine]) -> str:
    """Return lines as a table of three columns, as html.

    Parameters
    ----------
    heads : what the two sides are called.
    lines : in their order.
    """
    head = "".join(f"<td>{escaped(each)}</td>" for each in ("", *heads))
    return f"<table class='c-before-after'><tr>{head}</tr>{''.join(map(_row, lines))}</table>"


def _count(what: str, before: int, after: int) -> ComparedLine:
    """A number of things of which fewer are better."""
    return ComparedLine(what, str(before), str(after), float(before - after))


def _of_route(one: RouteFigures, other: RouteFigures) -> Iterator[ComparedLine]:
    """The worst of the route, with all reflectors and with any single one blocked."""
    yield ComparedLine(f"{one.name}: worst 2σ")
    for what, now, then in (("All there", one.intact, other.intact), ("Any one failing", one.failing, other.failing)):
        yield _sigma(f"{what} [{MILLIMETRES.unit}]", now.position, then.position)
        yield ComparedLine(
            f"{what} [{DEGREES.unit}]",
            DEGREES.number(now.heading, ".2f"),
            DEGREES.number(then.heading, ".2f"),
            now.heading - then.heading,
        )
    yield ComparedLine("Fewest in sight", str(one.visible), str(other.visible), gain=float(other.visible - one.visible))


def _of_station(one: StationFigures, other: StationFigures) -> Iterator[ComparedLine]:
    """The worst at the station, beside what it requires."""
    yield ComparedLine(f"{one.name}: 2σ, at most {MILLIMETRES.text(one.required, '.0f')}")
    yield _sigma(f"All there [{MILLIMETRES.unit}]", one.intact, other.intact)
    yield _sigma(f"Any one failing [{MILLIMETRES.unit}]", one.failing, other.failing)


def _sigma(what: str, now: float, then: float) -> ComparedLine:
    """A length of which less is better [m]."""
    return ComparedLine(what, MILLIMETRES.number(now, ".1f"), MILLIMETRES.number(then, ".1f"), now - then)


def _row(line: ComparedLine) -> str:
    """A row; what is written alike is no difference."""
    if not line.now:
        return f"<tr><td colspan='3'>{escaped(line.what)}</td></tr>"
    then = escaped(line.then)
    if line.now != line.then and line.gain and not math.isnan(line.gain):
        then = f"<i class='{'c-better' if line.gain > 0.0 else 'c-worse'}'>{then}</i>"
    return f"<tr><td>{escaped(line.what)}</td><td>{escaped(line.now)}</td><td>{then}</td></tr>"
