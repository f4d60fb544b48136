"""The world of a virtual drive: what of the project was true in it. An edit of any of it calls for another drive."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.run.actions import Source, VirtualDrive
from commission.site.disturbances import Disturbances
from commission.site.floor_map import FloorMap
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.routes import Route
from commission.site.scanner import Scanner
from commission.site.tags import Tag, TagCamera
from commission.site.vehicle import Vehicle
from commission.studies.inputs import StudyInput


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class World(StudyInput):
    """All that the records of a virtual drive depend on. Parameters and uncertainty are the localizer's belief."""

    drive: VirtualDrive
    """Route by name, seed and people."""
    route: Route
    """The route itself."""
    floor_map: FloorMap | None
    """Walls and free floor."""
    reflectors: ReflectorMap
    """What stands in the hall."""
    vehicle: Vehicle
    """Wheels and outline."""
    scanners: tuple[Scanner, ...]
    """The laser scanners."""
    tags: tuple[Tag, ...]
    """Marks that the camera reads."""
    tag_camera: TagCamera
    """That camera."""
    disturbances: Disturbances
    """People, faults, true noise and constant errors."""

    @staticmethod
    def of(project: Project, source: Source | None) -> World | None:
        """Return the world that a source would be driven in; None where it is a recording, or its route is gone."""
        if not isinstance(source, VirtualDrive):
            return None
        route = next((each for each in project.routes if each.name == source.route), None)
        if route is None:
            return None
        return World(
            drive=source,
            route=route,
            floor_map=project.floor_map,
            reflectors=project.reflectors,
            vehicle=project.vehicle,
            scanners=project.scanners,
            tags=project.tags,
            tag_camera=project.tag_camera,
            disturbances=project.disturbances,
        )
