"""Stations: a mark that points where the vehicle looks, its outline as it has to stand there, name and accuracy."""

from __future__ import annotations

import numpy as np
from viser import LabelHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import outline_segments
from commission.app.base.extent import extent_of
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.app.editing.name_places import NamePlace, station_names, station_text
from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.site.project import Project
from commission.site.stations import Station

MOST_LABELS = 60
MARK = np.array([(1.6, 0.0), (0.6, 1.0), (-1.0, 1.0), (-1.0, -1.0), (0.6, -1.0)])
"""Outline of the mark, in its own size; x points ahead."""
MARK_SIZE = 1.6
"""Size of the mark, in sizes of a mark on the floor."""


def station_marks(stations: tuple[Station, ...], size: float) -> FloatArray:
    """Return the (N, 5, 2) outlines of the marks of stations [m]; `size` is that of a mark on the floor [m]."""
    shape = MARK_SIZE * size * MARK
    marks = [se2.transform_points(station.pose, shape) for station in stations]
    return np.array(marks).reshape(-1, len(MARK), 2)


class StationLayer(BaseLayer):
    """All stations of the project."""

    name = "Stations"
    group = LayerGroup.SITE
    rank = 80
    reads: tuple[str, ...] = ("floor_map", "reflectors", "stations", "vehicle")
    legend = (theme.Legend("station, with its required accuracy", theme.STATION, theme.Mark.LINE),)

    def is_used(self, view: PageView) -> bool:
        """Whether the project has stations."""
        state = view.state
        return bool(state.project.stations)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._marks, self._outlines = (
            add_cased_lines(scene, f"/stations/{name}", theme.STATION, width)
            for name, width in (("marks", 2.0), ("outlines", 1.0))
        )
        self._labels: dict[str, LabelHandle] = {}

    def show_site(self, project: Project) -> None:
        """Draw every station; labels that stay are moved, not made anew."""
        size = extent_of(project).mark_size()
        outline = np.asarray(project.vehicle.outline, dtype=np.float64)
        outlines = [se2.transform_points(station.pose, outline) for station in project.stations]
        self._marks.points = outline_segments(station_marks(project.stations, size), theme.Height.REFERENCE)
        self._outlines.points = outline_segments(np.array(outlines), theme.Height.REFERENCE)
        shown = project.stations if len(project.stations) <= MOST_LABELS else ()
        for name in self._labels.keys() - {station.name for station in shown}:
            self._labels.pop(name).remove()
        for station, place in zip(shown, station_names(project) if shown else (), strict=True):
            self._write(station, place)

    def _write(self, station: Station, place: NamePlace) -> None:
        """Write name and accuracy beside a station."""
        position = (*place.at, theme.Height.LABEL)
        text = station_text(station)
        label = self._labels.get(station.name)
        if label is None:
            self._labels[station.name] = self.scene.add_label(
                f"/station_names/{station.name.encode().hex()}",
                text,
                position=position,
                font_screen_scale=0.7,
                anchor=place.anchor,
            )
        else:
            label.position, label.text, label.anchor = position, text, place.anchor

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return marks, outlines and names."""
        return *self._marks.nodes, *self._outlines.nodes, *self._labels.values()
