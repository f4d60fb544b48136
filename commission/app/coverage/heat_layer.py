"""The heatmap of the step Plan: one small picture on the floor, and a mark where its values are read."""

from __future__ import annotations

from viser import ImageHandle, LabelHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.floor_picture import FloorPicture
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_floor_picture
from commission.app.base.view import PageView
from commission.app.coverage.scale import picture
from commission.app.coverage.settings import CoverageSettings
from commission.app.coverage.view import FloorReading, HeatView, coverage_of
from commission.app.coverage.words import value_text
from commission.planning.dilution import Measurement


class HeatLayer(BaseLayer):
    """Coverage of the floor."""

    name = "Heatmap"
    group = LayerGroup.PLAN
    rank = 20
    reads: tuple[str, ...] = ()

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._image: ImageHandle | None = None
        self._label: LabelHandle | None = None
        self._shown: tuple[HeatView | None, float] = (None, 0.0)
        self._read: tuple[FloorReading | None, HeatView | None] = (None, None)

    def draw(self, view: PageView) -> None:
        """Draw the picture anew where it or its opacity has changed."""
        found, state = coverage_of(view), view.state
        opacity, visible = state.part(FloorPicture).opacity, self.name not in state.hidden
        if (found.heat, opacity) != self._shown:
            before, self._shown = self._shown[0], (found.heat, opacity)
            self._draw(found.heat, before, opacity, visible=visible)
        if (found.reading, found.heat) != self._read:
            self._read = (found.reading, found.heat)
            self._write(found.reading, found.heat, state.part(CoverageSettings).measurement, visible=visible)

    def _draw(self, heat: HeatView | None, before: HeatView | None, opacity: float, *, visible: bool) -> None:
        """Exchange the picture's content, or the picture itself where its place is another one."""
        if self._image is not None and (heat is None or before is None or heat.lattice != before.lattice):
            self._image.remove()
            self._image = None
        if heat is None:
            return
        image = picture(heat.classes, heat.scale, opacity)
        if self._image is not None:
            self._image.image = image
            return
        lattice = heat.lattice
        self._image = add_floor_picture(self.scene, "/plan/heat", image, lattice, visible=visible)

    def _write(
        self, reading: FloorReading | None, heat: HeatView | None, measurement: Measurement, *, visible: bool
    ) -> None:
        """Write the value where the floor was clicked."""
        if self._label is not None:
            self._label.remove()
            self._label = None
        if reading is None or heat is None:
            return
        figure = heat.scale.figure
        text = value_text(figure, reading.values[figure], measurement) if reading.on_floor else "no floor here"
        self._label = self.scene.add_label(
            "/plan/reading",
            text,
            position=(*reading.place, theme.Height.LABEL),
            anchor="bottom-center",
            font_screen_scale=0.9,
            visible=visible,
        )

    def colors_floor(self, view: PageView) -> bool:
        """Whether there is a picture."""
        return coverage_of(view).heat is not None

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the picture and the value on it."""
        return tuple(node for node in (self._image, self._label) if node is not None)
