"""The vehicle at its estimated pose: outline and heading in the plan, its body in 3D."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app import theme
from commission.app.drawing import NO_SEGMENTS, lift, outline_segments, yaw_quaternion
from commission.app.layers.base import BaseLayer
from commission.app.store import AppState
from commission.app.view import RunView
from commission.site.project import Project
from commission.site.vehicle import Vehicle

if TYPE_CHECKING:
    import trimesh

GROUND_CLEARANCE = 0.05


def heading_mark(outline: np.ndarray) -> np.ndarray:
    """Return the (3, 2, 2) strokes of an arrow from base towards the front [m], base frame."""
    tip = 0.85 * float(outline[:, 0].max())
    wing = 0.3 * tip
    return np.array([[(0, 0), (tip, 0)], [(tip, 0), (tip - wing, wing)], [(tip, 0), (tip - wing, -wing)]])


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
    reads: tuple[str, ...] = ("vehicle", "scanner")
    legend = (theme.Legend("vehicle (estimate)", theme.VEHICLE, theme.Mark.LINE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._project = Project()
        self._frame = scene.add_frame("/vehicle", show_axes=False, visible=False)
        self._lines = scene.add_line_segments(
            "/vehicle/outline", NO_SEGMENTS, theme.VEHICLE, thickness=2.0, thickness_units="screen"
        )
        self._scanner = scene.add_frame("/vehicle/scanner", axes_length=0.15, axes_radius=0.008, origin_radius=0.02)

    def show_site(self, project: Project) -> None:
        """Draw the outline and the scanner's place on the vehicle."""
        self._project = project
        outline = np.array(project.vehicle.outline)
        edges = outline_segments(outline[np.newaxis], theme.Height.VEHICLE)
        arrow = lift(heading_mark(outline).reshape(-1, 2), theme.Height.VEHICLE).reshape(-1, 2, 3)
        self._lines.points = np.concatenate([edges, arrow])
        x, y, heading = (float(value) for value in project.scanner.mounting)
        self._scanner.position = (x, y, theme.Height.VEHICLE)
        self._scanner.wxyz = yaw_quaternion(heading)
        self._scanner.axes_length = 0.3 * float(np.abs(outline).max())

    def draw(self, run: RunView, state: AppState) -> None:  # noqa: ARG002 - the protocol's
        """Move the vehicle to the estimated pose."""
        self._frame.visible = True
        self._frame.position = (float(run.pose[0]), float(run.pose[1]), 0.0)
        self._frame.wxyz = yaw_quaternion(float(run.pose[2]))

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
                color=(232, 150, 40),
                flat_shading=True,
            ),
        )

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the parts that hang on the vehicle's frame (which itself is hidden until a run exists)."""
        return self._lines, self._scanner
