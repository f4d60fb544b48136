"""The reflector map: a mark and a name in the plan, cylinders and plates in 3D."""

from __future__ import annotations

import numpy as np
import trimesh
from viser import SceneApi, SceneNodeHandle

from commission.app import theme
from commission.app.drawing import lift
from commission.app.extent import extent_of
from commission.app.layers.base import BaseLayer
from commission.site.project import Project
from commission.site.reflectors import ReflectorKind

MOST_LABELS = 60
SHOWN_HEIGHT = 0.4
PLATE_THICKNESS = 0.02


class ReflectorLayer(BaseLayer):
    """Where the map says that reflectors are."""

    name = "Reflectors"
    legend = (theme.Legend("reflector (paper: dark blue)", theme.REFLECTOR, theme.Mark.DOT),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._project = Project()
        self._nodes: tuple[SceneNodeHandle, ...] = ()

    def show_site(self, project: Project) -> None:
        """Draw a mark at each reflector's center."""
        for node in self._nodes:
            node.remove()
        self._nodes = ()
        self._project = project
        reflectors = project.reflectors
        if not len(reflectors):
            return
        size = max(1.2 * extent_of(project).mark_size(), 2.0 * float(reflectors.radii.max()))
        mark = self.scene.add_point_cloud(
            "/reflectors/marks",
            lift(reflectors.centers, theme.Height.REFLECTOR),
            theme.REFLECTOR,
            point_size=size,
            point_shape="circle",
            point_shading="flat",
            precision="float32",
        )
        self._nodes = (mark,)

    def furnish(self, scene: SceneApi, *, three_d: bool) -> tuple[SceneNodeHandle, ...]:
        """Add bodies in 3D; they would hide the marks' surroundings in the plan."""
        return _bodies(scene, self._project) if three_d else ()

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the marks."""
        return self._nodes


class ReflectorNameLayer(BaseLayer):
    """Names of the reflectors, where they are few enough to be read."""

    name = "Reflector names"

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._nodes: tuple[SceneNodeHandle, ...] = ()

    def show_site(self, project: Project) -> None:
        """Write each name beside its reflector."""
        for node in self._nodes:
            node.remove()
        shown = project.reflectors.reflectors if len(project.reflectors) <= MOST_LABELS else ()
        offset = extent_of(project).mark_size()
        self._nodes = tuple(
            self.scene.add_label(
                f"/reflector_names/{index}",
                reflector.id,
                position=(reflector.x + offset, reflector.y + offset, theme.Height.LABEL),
                font_screen_scale=0.7,
                anchor="bottom-left",
            )
            for index, reflector in enumerate(shown)
        )

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the names."""
        return self._nodes


def _bodies(scene: SceneApi, project: Project) -> tuple[SceneNodeHandle, ...]:
    """Add all cylinders as one batch and all plates as another."""
    every = project.reflectors.reflectors
    nodes: list[SceneNodeHandle] = []
    unit_cylinder = trimesh.creation.cylinder(radius=1.0, height=1.0, sections=20)
    unit_box = trimesh.creation.box(extents=(1.0, 1.0, 1.0))
    for kind, mesh in ((ReflectorKind.CYLINDER, unit_cylinder), (ReflectorKind.FLAT, unit_box)):
        chosen = [r for r in every if r.kind is kind]
        if not chosen:
            continue
        round_one = kind is ReflectorKind.CYLINDER
        sizes = [
            (r.radius, r.radius, SHOWN_HEIGHT) if round_one else (PLATE_THICKNESS, 2 * r.radius, SHOWN_HEIGHT)
            for r in chosen
        ]
        headings = np.array([0.0 if round_one else r.heading for r in chosen])
        wxyzs = np.zeros((len(chosen), 4))
        wxyzs[:, 0], wxyzs[:, 3] = np.cos(0.5 * headings), np.sin(0.5 * headings)
        nodes.append(
            scene.add_batched_meshes_simple(
                f"/reflectors/bodies/{kind.value}",
                np.asarray(mesh.vertices, np.float32),
                np.asarray(mesh.faces, np.uint32),
                batched_wxyzs=wxyzs,
                batched_positions=np.array([(r.x, r.y, max(r.height, 0.5 * SHOWN_HEIGHT)) for r in chosen]),
                batched_scales=np.array(sizes),
                batched_colors=theme.REFLECTOR,
            )
        )
    return tuple(nodes)
