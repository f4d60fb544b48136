"""What the project is about, in numbers: hall, reflectors, routes, vehicle, scanner."""

from __future__ import annotations

from viser import GuiApi

from commission.app.panels.base import BasePanel, escaped, table
from commission.site.project import Project


def rows(project: Project) -> list[tuple[str, str]]:
    """Return what the panel shows, line by line."""
    floor_map, scanner = project.floor_map, project.scanner
    first, last = scanner.field_of_view_deg
    shown = [("Project", escaped(project.name))]
    if floor_map is None:
        shown.append(("Floor map", "none: an open field"))
    else:
        width, height = floor_map.size
        shown += [
            ("Floor map", f"{width:.1f} x {height:.1f} m"),
            ("Cell", f"{floor_map.resolution * 1000:.0f} mm"),
        ]
    shown += [
        ("Reflectors", str(len(project.reflectors))),
        ("Routes", str(len(project.routes))),
        ("Vehicle", escaped(project.vehicle.kind)),
        ("Field of view", f"{first:g} to {last:g} °"),
        ("Beams", f"{scanner.beam_count}, every {scanner.resolution_deg:g} °"),
        ("Scans", f"{scanner.rate:g} per second"),
        ("Range", f"{scanner.range[0]:g} to {scanner.range[1]:g} m"),
        ("Reflectors seen to", f"{scanner.reflector_range:g} m"),
    ]
    return shown


class SitePanel(BasePanel):
    """Facts of the project."""

    def __init__(self, gui: GuiApi, project: Project) -> None:
        gui.add_html(f"<div style='padding:2px 6px'>{table(rows(project))}</div>")
        if project.routes:
            lengths = [
                (escaped(route.name), f"{sum(s.spline().length for s in route.segments):.1f} m, {route.speed:g} m/s")
                for route in project.routes
            ]
            gui.add_html(f"<div style='padding:8px 6px 2px'><div class='c-note'>Routes</div>{table(lengths)}</div>")
