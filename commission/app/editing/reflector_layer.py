"""The reflector map: a mark and a name in the plan, cylinders and plates in 3D."""

from __future__ import annotations

import numpy as np
from viser import LabelHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import lift, outline_segments, rings, stroke_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines, add_marks
from commission.app.editing.name_places import reflector_names
from commission.geometry.arrays import FloatArray
from commission.site.project import Project
from commission.site.reflectors import ReflectorKind, ReflectorMap

MOST_LABELS = 60
SHOWN_HEIGHT = 0.4
PLATE_THICKNESS = 0.02


class ReflectorLayer(BaseLayer):
    """Where the map says that reflectors are."""

    name = "Reflectors"
    group = LayerGroup.SITE
    rank = 120
    reads: tuple[str, ...] = ("floor_map", "reflectors", "routes")
    legend = (theme.Legend("reflector (paper: dark blue)", theme.REFLECTOR, theme.Mark.DOT),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._project = Project()
        self._casing = add_marks(scene, "/reflectors/casing", theme.CASING, 10)
        self._marks = add_marks(scene, "/reflectors/marks", theme.REFLECTOR, 6)
        self._shapes = add_cased_lines(scene, "/reflectors/shapes", theme.REFLECTOR, 1.5)

    def show_site(self, project: Project) -> None:
        """Draw a dot at each reflector's center, and around it the reflector as large as it is."""
        self._project = project
        reflectors = project.reflectors
        self._casing.points = lift(reflectors.centers, theme.Height.TRAIL)
        self._marks.points = lift(reflectors.centers, theme.Height.REFLECTOR)
        round_ones, plates = rings(reflectors.centers, reflectors.radii)[~reflectors.is_flat], _plates(reflectors)
        segments = (
            outline_segments(round_ones, theme.Height.REFLECTOR),
            stroke_segments(plates, theme.Height.REFLECTOR),
        )
        self._shapes.points = np.concatenate(segments)

    def furnish(self, scene: SceneApi, *, three_d: bool) -> tuple[SceneNodeHandle, ...]:
        """Add bodies in 3D; they would hide the marks' surroundings in the plan."""
        return _bodies(scene, self._project) if three_d else ()

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the dots, what is dark around them, and the shapes."""
        return self._casing, self._marks, *self._shapes.nodes


class ReflectorNameLayer(BaseLayer):
    """Names of the reflectors, where they are few enough to be read."""

    name = "Reflector names"
    group = LayerGroup.SITE
    rank = 140
    reads: tuple[str, ...] = ("floor_map", "reflectors", "routes", "stations")

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._labels: dict[str, LabelHandle] = {}

    def show_site(self, project: Project) -> None:
        """Write each name beside its reflector; labels that stay are moved, not made anew."""
        shown = project.reflectors.reflectors if len(project.reflectors) <= MOST_LABELS else ()
        names = {reflector.id for reflector in shown}
        for name in [name for name in self._labels if name not in names]:
            self._labels.pop(name).remove()
        for reflector, place in zip(shown, reflector_names(project, shown), strict=True):
            position = (*place.at, theme.Height.LABEL)
            label = self._labels.get(reflector.id)
            if label is not None:
                label.position = position
                if label.anchor != place.anchor:
                    label.anchor = place.anchor
                continue
            self._labels[reflector.id] = self.scene.add_label(
                f"/reflector_names/{reflector.id.encode().hex()}",
                reflector.id,
                position=position,
                font_screen_scale=0.7,
                anchor=place.anchor,
            )

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the names."""
        return tuple(self._labels.values())


def _plates(reflectors: ReflectorMap) -> FloatArray:
    """(N, 2, 2) both ends of each plate [m]."""
    flat = reflectors.is_flat
    along = reflectors.headings[flat] + 0.5 * np.pi
    half = reflectors.radii[flat, np.newaxis] * np.stack([np.cos(along), np.sin(along)], axis=1)
    return np.stack([reflectors.centers[flat] - half, reflectors.centers[flat] + half], axis=1)


def _bodies(scene: SceneApi, project: Project) -> tuple[SceneNodeHandle, ...]:
    """Add all cylinders as one batch and all plates as another."""
    import trimesh

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
            (r.reckoned_radius, r.reckoned_radius, SHOWN_HEIGHT)
            if round_one
            else (PLATE_THICKNESS, 2 * r.reckoned_radius, SHOWN_HEIGHT)
            for r in chosen
        ]
        headings = np.array([0.0 if round_one else r.heading or 0.0 for r in chosen])
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
