"""What the project is about, in numbers: hall, reflectors, routes, vehicle, scanners."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base.panel import BasePanel, escaped, table
from commission.app.base.view import PageView
from commission.site.project import Project
from commission.site.quantity import MILLIMETRES


def rows(project: Project) -> list[tuple[str, str]]:
    """Return what the panel shows, line by line."""
    floor_map = project.floor_map
    shown = [("Project", escaped(project.name))]
    if floor_map is None:
        shown.append(("Floor map", "none: an open field"))
    else:
        width, height = floor_map.size
        shown += [
            ("Floor map", f"{width:.1f} x {height:.1f} m"),
            ("Cell", MILLIMETRES.text(floor_map.resolution)),
        ]
    shown += [
        ("Reflectors", str(len(project.reflectors))),
        ("Routes", str(len(project.routes))),
        ("Vehicle", escaped(project.vehicle.kind)),
    ]
    for scanner in project.scanners:
        first, last = scanner.field_of_view_deg
        label = "Scanner" if len(project.scanners) == 1 else f"Scanner {escaped(scanner.name)}"
        seen = f"goniometer, {scanner.rate:g} turns/s" if scanner.is_goniometer else f"{scanner.beam_count} beams"
        shown.append((label, f"{seen}, {first:g} to {last:g}°"))
    return shown


def route_rows(project: Project) -> list[tuple[str, str]]:
    """Return name, length and speed of each route."""
    return [
        (escaped(route.name), f"{sum(s.spline().length for s in route.segments):.1f} m, {route.speed:g} m/s")
        for route in project.routes
    ]


class SitePanel(BasePanel):
    """Facts of the project."""

    def __init__(self, gui: GuiApi, project: Project) -> None:
        self._html = gui.add_html("")
        self._shown: Project | None = None
        self._routes = ""
        self._show(project)

    def draw_slowly(self, view: PageView) -> None:
        """Follow the project."""
        if view.state.project is not self._shown:
            self._show(view.state.project)

    def _show(self, project: Project) -> None:
        if self._shown is None or project.routes is not self._shown.routes:
            self._routes = table(route_rows(project))  # lengths of many curves take a while
        self._shown = project
        facts = f"<div style='padding:2px 6px'>{table(rows(project))}</div>"
        routes = f"<div style='padding:8px 6px 2px'><div class='c-note'>Routes</div>{self._routes}</div>"
        content = facts + (routes if project.routes else "")
        if self._html.content != content:
            self._html.content = content
