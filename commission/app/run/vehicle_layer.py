"""The vehicle at its estimated pose: outline, heading and what its scanners see in the plan, its body in 3D.

Before anything drives it stands at the start of the first route, so that what is edited of it is seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from viser import FrameHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import heading_mark, outline_segments, stroke_segments, yaw_quaternion
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines, add_lines
from commission.app.base.view import PageView
from commission.app.run.view import RunView
from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.site.project import Project
from commission.site.scanner import Scanner
from commission.site.vehicle import Vehicle
from commission.studies.start import route_start

if TYPE_CHECKING:
    import trimesh

GROUND_CLEARANCE = 0.05
NEAR_FAN = 2.0
"""Radius of the fan that shows the field of view beside the vehicle, in sizes of the vehicle."""
ARC_STEP_DEG = 3.0


def reach_of(scanner: Scanner) -> float:
    """Return how far a scanner sees reflectors [m]."""
    return min(scanner.range[1], scanner.reflector_range)


def fan(scanner: Scanner, radius: float) -> np.ndarray:
    """Return the (N, 2, 2) strokes of a field of view [m], base frame: arcs, a gap for each blind sector, and edges."""
    strokes = []
    for first, last in scanner.views.tolist():
        count = max(2, int(np.degrees(last - first) / ARC_STEP_DEG) + 1)
        bearings = np.linspace(first, last, count)
        arc = radius * np.stack((np.cos(bearings), np.sin(bearings)), axis=1)
        # Where a full turn ends, it begins again: that is no edge.
        is_edge = [not scanner.is_full_turn or end not in scanner.field_of_view for end in (first, last)]
        edges = [np.zeros((int(is_there), 2)) for is_there in is_edge]
        points = se2.transform_points(scanner.mounting, np.concatenate((edges[0], arc, edges[1])))
        strokes.append(np.stack((points[:-1], points[1:]), axis=1))
    return np.concatenate(strokes)


def body(vehicle: Vehicle) -> trimesh.Trimesh:
    """Return the outline extruded to the vehicle's height, with a beacon where the front is."""
    from trimesh.creation import extrude_triangulation

    outline = np.array(vehicle.outline)
    fan = np.array([(0, i, i + 1) for i in range(1, len(outline) - 1)])
    hull = extrude_triangulation(outline, fan, vehicle.height - GROUND_CLEARANCE)
    hull.apply_translation([0.0, 0.0, GROUND_CLEARANCE])
    return hull


class VehicleLayer(BaseLayer):
    """The vehicle."""

    name = "Vehicle"
    group = LayerGroup.RUN
    rank = 190
    reads: tuple[str, ...] = ("vehicle", "scanners", "routes")
    legend = (
        theme.Legend("vehicle; before a run at the start", theme.VEHICLE, theme.Mark.LINE),
        theme.Legend("field of view, reach for reflectors", theme.FIELD, theme.Mark.LINE),
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._project = Project()
        self._frame = scene.add_frame("/vehicle", show_axes=False, visible=False)
        self._casing = add_lines(scene, "/vehicle/around", theme.CASING, 5.0)
        self._lines = add_lines(scene, "/vehicle/outline", theme.VEHICLE, 2.0)
        self._near, self._far = (
            add_cased_lines(scene, f"/vehicle/field/{name}", color, 1.0)
            for name, color in (("near", theme.FIELD), ("far", theme.FAR_FIELD))
        )
        self._drives = False
        self._scene = scene
        self._scanners: list[FrameHandle] = []

    def show_site(self, project: Project) -> None:
        """Draw the outline, and place and field of view of each scanner."""
        self._project = project
        outline = np.array(project.vehicle.outline)
        for node, height in ((self._lines, theme.Height.VEHICLE), (self._casing, theme.Height.AROUND_VEHICLE)):
            sides = outline_segments(outline[np.newaxis], height)
            node.points = np.concatenate([sides, stroke_segments(heading_mark(outline), height)])
        size = float(np.abs(outline).max())
        self._place_scanners(project.scanners, 0.3 * size)
        near = [fan(scanner, NEAR_FAN * size) for scanner in project.scanners]
        far = [fan(scanner, reach_of(scanner)) for scanner in project.scanners]
        for lines, fans in ((self._near, near), (self._far, far)):
            lines.points = stroke_segments(np.concatenate(fans), theme.Height.ROUTE)
        if not self._drives:
            self._wait(project)

    def _place_scanners(self, scanners: Sequence[Scanner], length: float) -> None:
        """Put axes of a length [m] where each scanner is mounted."""
        for index in range(len(self._scanners), len(scanners)):
            name = f"/vehicle/scanner/{index}"
            frame = self._scene.add_frame(name, axes_radius=0.008, origin_radius=0.02, visible=self._lines.visible)
            self._scanners.append(frame)
        while len(self._scanners) > len(scanners):
            self._scanners.pop().remove()
        for frame, scanner in zip(self._scanners, scanners, strict=True):
            x, y, heading = (float(value) for value in scanner.mounting)
            frame.position, frame.wxyz = (x, y, theme.Height.VEHICLE), yaw_quaternion(heading)
            frame.axes_length = length

    def _wait(self, project: Project) -> None:
        """Stand at the start of the first route; without one there is no place to stand at."""
        self._frame.visible = bool(project.routes)
        if project.routes:
            self._put(np.array(route_start(project.routes[0])))

    def _put(self, pose: FloatArray) -> None:
        self._frame.position = (float(pose[0]), float(pose[1]), 0.0)
        self._frame.wxyz = yaw_quaternion(float(pose[2]))

    def draw(self, view: PageView) -> None:
        """Move the vehicle to the estimated pose."""
        run = view.part(RunView)
        if run is None:
            return
        if not self._drives:
            self._drives = self._frame.visible = True
        self._put(run.pose)

    def furnish(self, scene: SceneApi, *, three_d: bool) -> tuple[SceneNodeHandle, ...]:
        """Add the body in 3D; in the plan it would hide what lies under the vehicle."""
        if not three_d:
            return ()
        hull = body(self._project.vehicle)
        return (
            scene.add_mesh_simple(
                "/vehicle/body",
                np.asarray(hull.vertices, np.float32),
                np.asarray(hull.faces, np.uint32),
                color=theme.TRUCK,
                flat_shading=True,
            ),
        )

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the parts that hang on the vehicle's frame (which itself is hidden without a run or a route)."""
        return self._casing, self._lines, *self._scanners, *self._near.nodes, *self._far.nodes
