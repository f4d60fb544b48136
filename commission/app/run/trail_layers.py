"""Where the vehicle has been: as estimated, in colors of how well detections fit, and as the reference says."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import polyline_segments, stroke_segments, thinned
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.app.run.state import RunState
from commission.app.run.trail_colors import COLORINGS, TrailBy, palette, pieces, values_of
from commission.app.run.variant_reducer import LETTERS
from commission.app.run.view import RunView

MOST_POINTS = 800


class TrailLayer(BaseLayer):
    """Trail of the estimate."""

    name = "Trail"
    group = LayerGroup.RUN
    rank = 210
    legend = (theme.Legend("trail of the estimate", theme.TRAIL, theme.Mark.LINE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._line = add_cased_lines(scene, "/run/trail", theme.TRAIL, 1.5)

    def draw_slowly(self, view: PageView) -> None:
        """Draw the whole trail."""
        run = view.part(RunView)
        if run is None:
            return
        places = thinned(run.result.columns.means[: run.lived, :2], MOST_POINTS)
        self._line.draw(polyline_segments(places, theme.Height.TRAIL), cased=view.floor_is_colored)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the line."""
        return self._line.nodes


class ConsistencyLayer(BaseLayer):
    """Trail in the colors of how well detections fit, where that is asked for."""

    name = "Trail by consistency"
    group = LayerGroup.RUN
    rank = 215

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._lines = tuple(
            add_cased_lines(scene, f"/run/consistency/{index}", color, 5.0) for index, color in enumerate(palette())
        )
        self._shown: object = None

    def draw_slowly(self, view: PageView) -> None:
        """Draw the trail up to now, in pieces of one color each."""
        run, by = view.part(RunView), view.state.part(RunState).trail_by
        lived = 0 if run is None or by is TrailBy.NOTHING else run.lived
        shown = (None if run is None else id(run.result), by, lived)
        if shown == self._shown:
            return
        self._shown = shown
        lines, classes = np.empty((0, 2, 2)), np.empty(0, np.int64)
        if run is not None and lived:
            found = COLORINGS[by].classes(values_of(by, run.result.recent)[:lived])
            lines, classes = pieces(run.result.columns.means[:lived, :2], found, MOST_POINTS)
        for index, node in enumerate(self._lines):
            chosen = lines[classes == index]
            if len(chosen) or len(node.points) > 1:
                node.points = stroke_segments(chosen, theme.Height.TRAIL)

    def is_used(self, view: PageView) -> bool:
        """Whether it is asked for."""
        return view.state.part(RunState).trail_by is not TrailBy.NOTHING

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the lines, one for each color."""
        return tuple(node for line in self._lines for node in line.nodes)


class VariantLayer(BaseLayer):
    """Trails of the variants."""

    name = "Trails of variants"
    group = LayerGroup.RUN
    rank = 212
    legend = tuple(
        theme.Legend(f"trail of variant {letter}", color, theme.Mark.LINE)
        for letter, color in zip(LETTERS, theme.VARIANTS, strict=True)
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._lines = {
            letter: add_cased_lines(scene, f"/run/variant/{letter}", color, 2.0)
            for letter, color in zip(LETTERS, theme.VARIANTS, strict=True)
        }

    def draw_slowly(self, view: PageView) -> None:
        """Draw the trails up to now."""
        run = view.part(RunView)
        kept = {} if run is None else {each.letter: each.run for each in run.kept}
        for letter, line in self._lines.items():
            places = np.empty((0, 2)) if letter not in kept or run is None else kept[letter].columns.means[: run.lived]
            if len(places) or len(line.points) > 1:
                line.points = polyline_segments(thinned(places[:, :2], MOST_POINTS), theme.Height.TRAIL)

    def is_used(self, view: PageView) -> bool:
        """Whether there is one."""
        run = view.part(RunView)
        return run is not None and bool(run.kept)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the lines, one for each letter."""
        return tuple(node for line in self._lines.values() for node in line.nodes)


class ReferenceLayer(BaseLayer):
    """Trail of the reference."""

    name = "Reference"
    group = LayerGroup.RUN
    rank = 220
    legend = (theme.Legend("reference (truth)", theme.REFERENCE, theme.Mark.LINE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._line = add_cased_lines(scene, "/run/reference", theme.REFERENCE, 3.0)

    def draw_slowly(self, view: PageView) -> None:
        """Draw the reference positions up to now."""
        run = view.part(RunView)
        if run is None:
            return
        known = np.flatnonzero(np.isfinite(run.result.errors[: run.lived, 0]))
        shown = run.result.reference_places(thinned(known, MOST_POINTS))
        self._line.draw(polyline_segments(shown, theme.Height.REFERENCE), cased=view.floor_is_colored)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the line."""
        return self._line.nodes
