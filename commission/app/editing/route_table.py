"""Routes, stations, tags, zones and scanners as tables of one browser: a row selects its thing and goes there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from viser import GuiApi

from commission.app.base.actions import Action
from commission.app.base.inputs import add_find, write_html
from commission.app.base.panel import BasePanel, Post
from commission.app.base.view import PageView
from commission.app.editing.actions import SelectControlPoint
from commission.app.editing.data_table import (
    ALL,
    NO,
    YES,
    CellKind,
    DataTables,
    TableColumn,
    TableContent,
    TableRow,
    TableUse,
    between,
    columns_of,
    shared_cells,
    sorted_rows,
)
from commission.app.editing.editor import ControlPoint, PosedKey, PosedKind
from commission.app.editing.posed_actions import SelectPosed
from commission.app.editing.scanner_fields import DIRECTIONS
from commission.app.editing.several import COUNTS, SEVERAL
from commission.app.editing.table_actions import ChooseRows, SetRows
from commission.app.editing.table_reducer import TableOrders
from commission.app.editing.typed_lists import list_text
from commission.app.editing.zone_actions import ShowZone
from commission.app.editing.zone_fields import KINDS as KINDS_IN_ZONES
from commission.site.polygon import area
from commission.site.project import Project
from commission.site.quantity import counted_text
from commission.site.routes import Direction, Route
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.tags import Tag
from commission.site.zones import Zone
from commission.studies.problems import ProblemsResult

MOST_ROWS = 60
"""Rows of a table that are shown; the others are found by a part of their name."""
NAME = "routes"
NONE = "No route, station, tag or zone yet: the tools at the floor's edge make them."

OF_ROUTES = (
    *columns_of(Route, titles={"name": "Name"}),
    TableColumn(key="length", title="Length [m]", hint="Arc length of all its segments.", is_number=True),
    TableColumn(
        key="violations",
        title="Violations",
        hint="Places where the vehicle cannot drive it, or has too little room.",
        is_number=True,
    ),
    TableColumn(key="segments", title="Segments", hint="Curves that are driven without a stop.", is_number=True),
    TableColumn(key="reverse", title="Reverse", hint="Segments that are driven in reverse.", is_number=True),
)
OF_STATIONS = tuple(columns_of(Station, titles={"name": "Name"}))
OF_TAGS = tuple(columns_of(Tag, titles={"id": "Id", "heading": "Heading"}))
OF_ZONES = (
    *columns_of(Zone, titles={"name": "Name"})[:1],
    *(
        TableColumn(key=COUNTS + kind, title=label, hint=hint, kind=CellKind.SWITCH)
        for kind, (label, hint) in KINDS_IN_ZONES.items()
    ),
    *(column for column in columns_of(Zone) if column.key == "outline"),
    TableColumn(key="area", title="Area [m²]", hint="Floor inside of its corners.", is_number=True),
)
OF_SCANNERS = tuple(
    replace(column, kind=CellKind.CHOICE, options=tuple(DIRECTIONS.values()), words=DIRECTIONS, is_number=False)
    if column.key == "sweep_direction"
    else column
    for column in columns_of(Scanner)
)


USES: Mapping[str, tuple[tuple[TableColumn, ...], Callable[[str], Action]]] = {
    "routes": (OF_ROUTES, lambda key: SelectControlPoint(ControlPoint(key), fly=True)),
    "stations": (OF_STATIONS, lambda key: SelectPosed(PosedKey(PosedKind.STATION, key), fly=True)),
    "tags": (OF_TAGS, lambda key: SelectPosed(PosedKey(PosedKind.TAG, key), fly=True)),
    "zones": (OF_ZONES, ShowZone),
    "scanners": (OF_SCANNERS, lambda key: ChooseRows("scanners", (key,))),
}
"""Columns of each table, and how one of its rows is selected alone."""


@dataclass(frozen=True, slots=True)
class Judged:
    """What is wrong with the routes."""

    violations: Counter[str]
    """Number of each route, by its name."""
    fatal: frozenset[str] = frozenset()
    """Names of those that cannot be driven."""

    def tint(self, route: str) -> Literal["", "warning", "error"]:
        """Return how a route stands in the table."""
        return "error" if route in self.fatal else "warning" if self.violations[route] else ""


def route_rows(project: Project, judged: Judged, selected: Collection[str] = ()) -> list[TableRow]:
    """Return a row of each route.

    Parameters
    ----------
    project : has them.
    judged : what is wrong with them.
    selected : names of those that are selected.
    """
    rows: list[TableRow] = []
    for route in project.routes:
        reverse = sum(segment.direction is Direction.REVERSE for segment in route.segments)
        length = sum(segment.spline().length for segment in route.segments)
        counts = (judged.violations[route.name], len(route.segments), reverse)
        cells = (route.name, OF_ROUTES[1].of_field(route), f"{length:.1f}", *map(str, counts))
        rows.append(TableRow(route.name, cells, route.name in selected, judged.tint(route.name)))
    return rows


def zone_rows(project: Project, selected: Collection[str] = ()) -> list[TableRow]:
    """Return a row of each zone.

    Parameters
    ----------
    project : has them.
    selected : names of those that are selected.
    """
    rows: list[TableRow] = []
    for zone in project.zones:
        counts = (YES if kind in zone.kinds else NO for kind in KINDS_IN_ZONES)
        cells = (zone.name, *counts, list_text(zone.outline), f"{area(zone.outline):.1f}")
        rows.append(TableRow(zone.name, cells, zone.name in selected))
    return rows


def rows_of(
    items: Sequence[Any], columns: Sequence[TableColumn], key: str, selected: Collection[str] = ()
) -> list[TableRow]:
    """Return a row of each of some values whose columns are their fields.

    Parameters
    ----------
    items : the values.
    columns : of their table.
    key : field that tells them apart.
    selected : keys of those that are selected.
    """
    return [
        TableRow(getattr(each, key), tuple(column.of_field(each) for column in columns), getattr(each, key) in selected)
        for each in items
    ]


class RouteTable(BasePanel):
    """The tables of one browser."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        self._find = add_find(gui, post, "Part of the name of a route, a station, a tag or a zone.")
        self._count = gui.add_html("")
        uses = {name: self._use(name, columns, select) for name, (columns, select) in USES.items()}
        self.tables = DataTables(gui, post, NAME, uses)
        self._drawn: tuple[object, ...] = ()

    def draw_slowly(self, view: PageView) -> None:
        """Show routes, stations, tags and zones, each in their order."""
        project = view.state.project
        findings = view.part(ProblemsResult)
        drawn = (project.routes, project.stations, project.tags, project.zones, project.scanners, findings)
        orders = view.state.of_browser(self._browser, TableOrders)
        chosen = {name: several.chosen(view.state, self._browser) for name, several in SEVERAL.items()}
        asked = (self._find.value, chosen, orders)
        if self._drawn and self._drawn[-1] == asked and all(a is b for a, b in zip(self._drawn, drawn, strict=False)):
            return
        self._drawn = (*drawn, asked)
        listed = {
            "routes": route_rows(project, _judged(findings), chosen["routes"]),
            "stations": rows_of(project.stations, OF_STATIONS, "name", chosen["stations"]),
            "tags": rows_of(project.tags, OF_TAGS, "id", chosen["tags"]),
            "zones": zone_rows(project, chosen["zones"]),
            "scanners": rows_of(project.scanners, OF_SCANNERS, "name", chosen["scanners"]),
        }
        sought = self._find.value.strip().lower()
        tables: list[TableContent] = []
        for name, rows in listed.items():
            columns, order = USES[name][0], orders.of(name)
            found = [row for row in rows if sought in row.key.lower()]
            shown = sorted_rows(found, columns, order)[:MOST_ROWS]
            more = f", the first {MOST_ROWS} of {len(found)}" if len(found) > MOST_ROWS else ""
            title = f"{name.capitalize()}{more}"
            every = shared_cells(rows, columns, SEVERAL[name].alone)
            if shown:
                tables.append(
                    TableContent(
                        name=name,
                        title=title,
                        columns=columns,
                        rows=shown,
                        order=order,
                        every=every,
                        chosen=len(chosen[name]),
                    )
                )
        counts = [
            counted_text(len(rows), SEVERAL[name].kind) for name, rows in listed.items() if rows and name != "scanners"
        ]
        write_html(self._count, f"<div class='c-note' style='padding:2px 6px'>{', '.join(counts) or NONE}</div>")
        self.tables.show(tables)

    def _use(self, name: str, columns: tuple[TableColumn, ...], select: Callable[[str], Action]) -> TableUse:
        """Return what can be done in one of the tables."""

        def selecting(key: str, how: str, begin: str) -> Action:
            if how == "only":
                return select(key)
            keys = [row.key for table in self.tables.shown if table.name == name for row in table.rows]
            return ChooseRows(name, (key,) if how == "toggle" else between(keys, begin, key), toggle=how == "toggle")

        def enter(key: str, field: str, value: Any) -> Action:
            return SetRows(name, field, value) if key == ALL else SEVERAL[name].setting(field, value, key)

        return TableUse(columns=columns, select=selecting, enter=enter)


def _judged(findings: ProblemsResult | None) -> Judged:
    found = [v for route in findings.by_route for v in route.violations] if findings is not None else []
    return Judged(Counter(each.route for each in found), frozenset(each.route for each in found if each.is_fatal))
