"""Routes, stations, tags and zones as tables of one browser: a row selects what it is about and goes there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from viser import GuiApi

from commission.app.base.actions import Action
from commission.app.base.inputs import add_find, write_html
from commission.app.base.panel import BasePanel, Post
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.data_table import (
    DataTables,
    TableColumn,
    TableContent,
    TableRow,
    TableUse,
    columns_of,
    sorted_rows,
)
from commission.app.editing.editor import ControlPoint, Editor, PosedKey, PosedKind
from commission.app.editing.posed_actions import SelectPosed, SetPosed
from commission.app.editing.table_reducer import TableOrders
from commission.app.editing.zone_actions import SetZone, ShowZone
from commission.app.editing.zone_reducer import ShownZone
from commission.site.polygon import area
from commission.site.project import Project
from commission.site.quantity import counted_text
from commission.site.routes import Direction, Route
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
    *columns_of(Zone, fixed=("outline", "kinds"), titles={"name": "Name"})[:1],
    TableColumn(key="kinds", title="Corrected by", hint="What corrects the pose of a vehicle that is in it."),
    TableColumn(key="area", title="Area [m²]", hint="Floor inside of its corners.", is_number=True),
    TableColumn(key="corners", title="Corners", hint="Corners of its outline.", is_number=True),
)


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


def route_rows(project: Project, judged: Judged, selected: str = "") -> list[TableRow]:
    """Return a row of each route.

    Parameters
    ----------
    project : has them.
    judged : what is wrong with them.
    selected : name of the one that is selected; empty: none.
    """
    rows: list[TableRow] = []
    for route in project.routes:
        reverse = sum(segment.direction is Direction.REVERSE for segment in route.segments)
        length = sum(segment.spline().length for segment in route.segments)
        counts = (judged.violations[route.name], len(route.segments), reverse)
        cells = (route.name, OF_ROUTES[1].of_field(route), f"{length:.1f}", *map(str, counts))
        rows.append(TableRow(route.name, cells, route.name == selected, judged.tint(route.name)))
    return rows


def zone_rows(project: Project, selected: str = "") -> list[TableRow]:
    """Return a row of each zone.

    Parameters
    ----------
    project : has them.
    selected : name of the one that is shown; empty: none.
    """
    return [
        TableRow(
            zone.name,
            (zone.name, ", ".join(zone.kinds), f"{area(zone.outline):.1f}", str(len(zone.outline))),
            zone.name == selected,
        )
        for zone in project.zones
    ]


def rows_of(items: Sequence[Any], columns: Sequence[TableColumn], key: str, selected: str = "") -> list[TableRow]:
    """Return a row of each of some values whose columns are their fields.

    Parameters
    ----------
    items : the values.
    columns : of their table.
    key : field that tells them apart.
    selected : key of the one that is selected; empty: none.
    """
    return [
        TableRow(getattr(each, key), tuple(column.of_field(each) for column in columns), getattr(each, key) == selected)
        for each in items
    ]


class RouteTable(BasePanel):
    """The tables of one browser."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        self._browser = browser
        self._find = add_find(gui, post, "Part of the name of a route, a station, a tag or a zone.")
        self._count = gui.add_html("")
        self.tables = DataTables(
            gui,
            post,
            NAME,
            {
                "routes": _use(
                    OF_ROUTES,
                    lambda key: actions.SelectControlPoint(ControlPoint(key), fly=True),
                    lambda key, name, value: actions.SetRoute(name, value, key),
                ),
                "stations": _use_of(OF_STATIONS, PosedKind.STATION),
                "tags": _use_of(OF_TAGS, PosedKind.TAG),
                "zones": _use(OF_ZONES, ShowZone, lambda key, name, value: SetZone(name, value, key)),
            },
        )
        self._drawn: tuple[object, ...] = ()

    def draw_slowly(self, view: PageView) -> None:
        """Show routes, stations, tags and zones, each in their order."""
        project, editor = view.state.project, view.state.of_browser(self._browser, Editor)
        chosen = "" if editor.point is None else editor.point.route
        findings = view.part(ProblemsResult)
        drawn = (project.routes, project.stations, project.tags, project.zones, findings)
        orders = view.state.of_browser(self._browser, TableOrders)
        zone = view.state.of_browser(self._browser, ShownZone).name
        asked = (self._find.value, chosen, editor.posed, zone, orders)
        if self._drawn and self._drawn[-1] == asked and all(a is b for a, b in zip(self._drawn, drawn, strict=False)):
            return
        self._drawn = (*drawn, asked)
        listed = (
            ("routes", OF_ROUTES, route_rows(project, _judged(findings), chosen)),
            ("stations", OF_STATIONS, rows_of(project.stations, OF_STATIONS, "name", _name(editor, PosedKind.STATION))),
            ("tags", OF_TAGS, rows_of(project.tags, OF_TAGS, "id", _name(editor, PosedKind.TAG))),
            ("zones", OF_ZONES, zone_rows(project, zone)),
        )
        sought = self._find.value.strip().lower()
        tables: list[TableContent] = []
        for name, columns, rows in listed:
            found = [row for row in rows if sought in row.key.lower()]
            order = orders.of(name)
            shown = sorted_rows(found, columns, order)[:MOST_ROWS]
            more = f", the first {MOST_ROWS} of {len(found)}" if len(found) > MOST_ROWS else ""
            title = f"{name.capitalize()}{more}"
            if shown:
                tables.append(TableContent(name=name, title=title, columns=columns, rows=shown, order=order))
        counts = [counted_text(len(rows), name.removesuffix("s")) for name, _, rows in listed if rows]
        write_html(self._count, f"<div class='c-note' style='padding:2px 6px'>{', '.join(counts) or NONE}</div>")
        self.tables.show(tables)


def _judged(findings: ProblemsResult | None) -> Judged:
    found = [v for route in findings.by_route for v in route.violations] if findings is not None else []
    return Judged(Counter(each.route for each in found), frozenset(each.route for each in found if each.is_fatal))


def _name(editor: Editor, kind: PosedKind) -> str:
    """Name of the station or the tag that is selected; empty: none of that kind."""
    return editor.posed.name if editor.posed is not None and editor.posed.kind is kind else ""


def _use_of(columns: tuple[TableColumn, ...], kind: PosedKind) -> TableUse:
    """What can be done in the table of stations, or of tags."""
    return _use(
        columns,
        lambda key: SelectPosed(PosedKey(kind, key), fly=True),
        lambda key, name, value: SetPosed(kind, name, value, key),
    )


def _use(
    columns: tuple[TableColumn, ...], select: Callable[[str], Action], enter: Callable[[str, str, Any], Action]
) -> TableUse:
    """What can be done in a table of which one row can be selected."""
    return TableUse(columns=columns, select=lambda key, _how, _begin: select(key), enter=enter)
