"""Zones: their outlines, their names, and what corrects the pose in them."""

from __future__ import annotations

import numpy as np
from viser import LabelHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import outline_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import NO_SEGMENTS, add_cased_lines
from commission.app.base.view import PageView
from commission.site.project import Project
from commission.site.zones import Zone

MOST_LABELS = 30


class ZoneLayer(BaseLayer):
    """All zones of the project."""

    name = "Zones"
    group = LayerGroup.SITE
    rank = 60
    reads: tuple[str, ...] = ("zones",)
    legend = (theme.Legend("zone, with what corrects the pose in it", theme.ZONE, theme.Mark.LINE),)

    def is_used(self, view: PageView) -> bool:
        """Whether the project has zones."""
        return bool(view.state.project.zones)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._outlines = add_cased_lines(scene, "/zones/outlines", theme.ZONE, 1.5)
        self._labels: dict[str, LabelHandle] = {}

    def show_site(self, project: Project) -> None:
        """Draw every zone; names that stay are moved, not made anew."""
        outlines = [
            outline_segments(np.array(zone.outline, dtype=np.float64)[np.newaxis], theme.Height.ROUTE)
            for zone in project.zones
        ]
        self._outlines.points = np.concatenate(outlines) if outlines else NO_SEGMENTS
        shown = project.zones[:MOST_LABELS]
        for name in self._labels.keys() - {zone.name for zone in shown}:
            self._labels.pop(name).remove()
        for zone in shown:
            self._write(zone)

    def _write(self, zone: Zone) -> None:
        """Write what it is called and what counts, inside of its upper left corner."""
        corners = np.array(zone.outline)
        position = (*corners[np.argmax(corners[:, 1] - corners[:, 0])].tolist(), theme.Height.LABEL)
        text = f"{zone.name}: {', '.join(zone.kinds)}"
        label = self._labels.get(zone.name)
        if label is None:
            self._labels[zone.name] = self.scene.add_label(
                f"/zone_names/{zone.name.encode().hex()}",
                text,
                position=position,
                font_screen_scale=0.7,
                anchor="top-left",
            )
        else:
            label.position, label.text = position, text

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return outlines and names."""
        return *self._outlines.nodes, *self._labels.values()
