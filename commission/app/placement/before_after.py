"""What the present reflectors come to and what the suggested ones, side by side. Pure: from values to HTML."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from commission.app.base.panel import escaped
from commission.planning.layout_figures import LayoutFigures, RouteFigures, StationFigures
from commission.site.quantity import DEGREES, MILLIMETRES


class ComparedLine(NamedTuple):
    """One figure of two layouts; without figures the heading of those that follow."""

    what: str
    now: str = ""
    then: str = ""


def before_after(before: LayoutFigures, after: LayoutFigures) -> str:
    """Return a table of three columns: what it is, with its unit; now; as suggested.

    Parameters
    ----------
    before, after : of the same routes and stations.
    """
    lines = [ComparedLine("Reflectors", str(before.reflectors), str(after.reflectors))]
    for one, other in zip(before.routes, after.routes, strict=True):
        lines += _of_route(one, other)
    for one, other in zip(before.stations, after.stations, strict=True):
        lines += _of_station(one, other)
    lines += [
        ComparedLine("All routes, all places"),
        ComparedLine("Stop if one fails", str(before.stopping), str(after.stopping)),
        ComparedLine(f"Ambiguous, of {after.places}", str(before.ambiguous), str(after.ambiguous)),
    ]
    head = "<tr><td></td><td>now</td><td>suggested</td></tr>"
    return f"<table class='c-before-after'>{head}{''.join(map(_row, lines))}</table>"


def _of_route(one: RouteFigures, other: RouteFigures) -> Iterator[ComparedLine]:
    """The worst of the route, with all reflectors and with any single one blocked."""

    def both(what: str, pairs: tuple[tuple[float, float], tuple[float, float]]) -> ComparedLine:
        (position, heading), (position_then, heading_then) = pairs
        return ComparedLine(what, _two(position, heading), _two(position_then, heading_then))

    yield ComparedLine(f"{one.name}: worst 2σ")
    intact = ((one.intact.position, one.intact.heading), (other.intact.position, other.intact.heading))
    failing = ((one.failing.position, one.failing.heading), (other.failing.position, other.failing.heading))
    yield both(f"All there [{MILLIMETRES.unit}, {DEGREES.unit}]", intact)
    yield both(f"Any one failing [{MILLIMETRES.unit}, {DEGREES.unit}]", failing)
    yield ComparedLine("Fewest in sight", str(one.visible), str(other.visible))


def _of_station(one: StationFigures, other: StationFigures) -> Iterator[ComparedLine]:
    """The worst at the station, beside what it requires."""
    yield ComparedLine(f"{one.name}: 2σ, at most {MILLIMETRES.text(one.required, '.0f')}")
    for what, now, then in (
        ("All there", one.intact, other.intact),
        ("Any one failing", one.failing, other.failing),
    ):
        yield ComparedLine(
            f"{what} [{MILLIMETRES.unit}]", MILLIMETRES.number(now, ".1f"), MILLIMETRES.number(then, ".1f")
        )


def _two(position: float, heading: float) -> str:
    return f"{MILLIMETRES.number(position, '.1f')}, {DEGREES.number(heading, '.2f')}"


def _row(line: ComparedLine) -> str:
    if not line.now:
        return f"<tr><td colspan='3'>{escaped(line.what)}</td></tr>"
    return f"<tr><td>{escaped(line.what)}</td><td>{escaped(line.now)}</td><td>{escaped(line.then)}</td></tr>"
