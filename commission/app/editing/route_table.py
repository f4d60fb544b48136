"""All routes, stations and tags as a table of one browser. A row selects what it is about and goes there."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from viser import GuiApi, GuiTabHandle

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.inputs import add_find
from commission.app.base.panel import BasePanel, Post
from commission.app.base.rows import Rows
from commission.app.base.view import PageView
from commission.app.editing import actions
from commission.app.editing.editor import ControlPoint, Editor, PosedKey, PosedKind
from commission.app.editing.posed_actions import SelectPosed
from commission.site.project import Project
from commission.site.quantity import DEGREES
from commission.site.routes import Direction, Route
from commission.site.stations import ACCURACY, Station
from commission.site.tags import Tag
from commission.studies.problems import ProblemsResult

MOST_ROWS = 60
"""Rows that are shown; the others are found by a part of their name."""


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table."""

    text: str
    """What it says."""
    route: str = ""
    """Name of the route that it is about; empty: none."""
    posed: PosedKey | None = None
    """The station or the tag that it is about."""


def route_row(route: Route, violations: int) -> Row:
    """Return a route on one line."""
    speeds = sorted({route.speed_of(segment) for segment in route.segments})
    speed = f"{speeds[0]:g}" + (f" to {speeds[-1]:g}" if len(speeds) > 1 else "")
    reverse = sum(segment.direction is Direction.REVERSE for segment in route.segments)
    parts = [f"{speed} m/s", *([f"{reverse} of {len(route.segments)} reverse"] if reverse else [])]
    if violations:
        parts.append(f"{violations} violation{'s' if violations > 1 else ''}")
    return Row(f"{route.name}   {'  '.join(parts)}", route=route.name)


def station_row(station: Station) -> Row:
    """Return a station on one line."""
    return Row(
        f"{station.name}   {ACCURACY.brief(station.required_accuracy)}  {station.x:.2f}  {station.y:.2f} m",
        posed=PosedKey(PosedKind.STATION, station.name),
    )


def tag_row(tag: Tag) -> Row:
    """Return a tag on one line."""
    name = f"tag, no id ({tag.id})" if tag.anonymous else f"tag {tag.id}"
    place = f"{tag.x:.2f}  {tag.y:.2f} m  {DEGREES.text(tag.heading, '.1f')}"
    return Row(f"{name}   {place}", posed=PosedKey(PosedKind.TAG, tag.id))


def rows(project: Project, violations: Counter[str], sought: str) -> list[Row]:
    """Return the table's lines: routes, stations, then tags, whose names contain what is sought.

    Parameters
    ----------
    project : has them.
    violations : number of each route, by its name.
    sought : in lower case; empty: all.
    """
    routes = [route_row(route, violations[route.name]) for route in project.routes if sought in route.name.lower()]
    stations = [station_row(station) for station in project.stations if sought in station.name.lower()]
    return routes + stations + [tag_row(tag) for tag in project.tags if sought in f"tag {tag.id}".lower()]


class RouteTable(BasePanel):
    """The table of one browser."""

    def __init__(self, gui: GuiApi, post: Post, browser: int, tab: GuiTabHandle) -> None:
        self._browser = browser
        self._find = add_find(gui, post, "Part of the name of a route, a station or a tag.")
        self._count = gui.add_html("")
        self._shown: list[Row] = []
        self._rows = Rows(gui, tab, post, self._selecting)
        self._drawn: tuple[object, ...] = ()

    def draw_slowly(self, view: PageView) -> None:
        """Show routes, stations and tags in the order of the project."""
        project, editor = view.state.project, view.state.of_browser(self._browser, Editor)
        chosen = "" if editor.point is None else editor.point.route
        findings = view.part(ProblemsResult)
        drawn = (project.routes, project.stations, project.tags, findings)
        asked = (self._find.value, chosen, editor.posed)
        if self._drawn and self._drawn[-1] == asked and all(a is b for a, b in zip(self._drawn, drawn, strict=False)):
            return
        self._drawn = (*drawn, asked)
        violated = [v for route in findings.by_route for v in route.violations] if findings is not None else []
        violations = Counter(violation.route for violation in violated)
        found = rows(project, violations, self._find.value.strip().lower())
        self._shown = found[:MOST_ROWS]
        more = f", the first {MOST_ROWS} shown" if len(found) > MOST_ROWS else ""
        tags = f", {len(project.tags)} tags" if project.tags else ""
        self._count.content = (
            f"<div class='c-note' style='padding:2px 6px'>{len(project.routes)} routes, "
            f"{len(project.stations)} stations{tags}{more}</div>"
        )
        fatal = {violation.route for violation in violated if violation.is_fatal}
        self._rows.show([(row.text, _color(row, chosen, editor, violations, fatal)) for row in self._shown])

    def _selecting(self, index: int) -> page_actions.Action:
        """Return the action of a row; the table may have become shorter since it was drawn."""
        if index >= len(self._shown):
            return page_actions.Report("this row is gone", failed=False)
        row = self._shown[index]
        if row.posed is not None:
            return SelectPosed(row.posed, fly=True)
        return actions.SelectControlPoint(ControlPoint(row.route), fly=True)


def _color(row: Row, route: str, editor: Editor, violations: Counter[str], fatal: set[str]) -> theme.Color:
    if row.posed == editor.posed if row.posed is not None else row.route == route:
        return theme.SELECTED_LINE
    if row.route in fatal:
        return theme.ERROR_LINE
    return theme.WARNING_LINE if violations[row.route] else theme.LINE
