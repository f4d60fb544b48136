"""What is expected to happen along a route: stops and recoveries, stations met or not, wrong associations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from viser import LabelHandle, PointCloudHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import lift, thinned
from commission.app.base.extent import extent_of
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_points
from commission.app.base.view import PageView
from commission.app.prediction.view import RouteView
from commission.geometry.arrays import FloatArray
from commission.planning.route_prediction import RoutePrediction
from commission.site.project import Project
from commission.site.quantity import MILLIMETRES

MOST_RISKY = 600
MOST_LABELS = 40


@dataclass(frozen=True, slots=True)
class Event:
    """Something at one place of the route."""

    text: str
    """What it is; written beside it."""
    place: tuple[float, float]
    """Where [m]."""
    kind: theme.Color
    """Color of its mark."""


def place_at(prediction: RoutePrediction, metre: float) -> tuple[float, float]:
    """Return where the vehicle is at a metre of the way [m]."""
    drive = prediction.drive
    index = min(int(np.searchsorted(drive.metres, metre)), len(drive) - 1)
    return float(drive.poses[index, 0]), float(drive.poses[index, 1])


def events(route: RouteView) -> tuple[Event, ...]:
    """Return what happens along a route: where the supervisor stops and lets go on, and each station."""
    prediction = route.prediction
    stops = [(f"stops at {m:.0f} m", float(m), theme.OVER_LIMIT) for m in prediction.trips()]
    going_on = [(f"may go on at {m:.0f} m", float(m), theme.RECOVERY) for m in prediction.recoveries()]
    stations = [
        (
            f"{each.station}: {MILLIMETRES.number(each.expected, '.1f')} of {MILLIMETRES.text(each.required)}"
            f"{'' if each.is_met else ', not met'}",
            each.metre,
            theme.RECOVERY if each.is_met else theme.OVER_LIMIT,
        )
        for each in route.stations
    ]
    return tuple(Event(text, place_at(prediction, m), kind) for text, m, kind in (*stops, *going_on, *stations))


class EventLayer(BaseLayer):
    """Marks and names along the predicted route."""

    name = "Stops, stations, risks"
    group = LayerGroup.PLAN
    rank = 100
    reads: tuple[str, ...] = ("floor_map", "reflectors", "routes")
    legend = (
        theme.Legend("supervisor stops; station not met", theme.OVER_LIMIT, theme.Mark.DOT),
        theme.Legend("may go on; station met", theme.RECOVERY, theme.Mark.DOT),
        theme.Legend("wrong association possible", theme.RISK, theme.Mark.DOT),
    )

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._mark = 0.1
        self._shown: RouteView | None = None
        self._labels: tuple[LabelHandle, ...] = ()
        self._clouds: dict[theme.Color, PointCloudHandle] = {
            color: add_points(scene, f"/plan/events/{name}", color, 0.1)
            for name, color in (("risks", theme.RISK), ("going_on", theme.RECOVERY), ("stops", theme.OVER_LIMIT))
        }

    def show_site(self, project: Project) -> None:
        """Adapt the size of the marks to the site's."""
        self._mark = extent_of(project).mark_size()

    def draw(self, view: PageView) -> None:
        """Draw the marks anew where the prediction has changed."""
        route, state = view.part(RouteView), view.state
        if route is self._shown:
            return
        self._shown = route
        found = () if route is None else events(route)
        for color, cloud in self._clouds.items():
            places = np.array([event.place for event in found if event.kind == color]).reshape(-1, 2)
            if color == theme.RISK and route is not None:
                places = _risky(route)
            cloud.point_size = (1.0 if color == theme.RISK else 2.0) * self._mark
            cloud.points = lift(places, theme.Height.TRAIL)
        for label in self._labels:
            label.remove()
        self._labels = self._write(found[:MOST_LABELS], visible=self.name not in state.hidden)

    def _write(self, found: tuple[Event, ...], *, visible: bool) -> tuple[LabelHandle, ...]:
        return tuple(
            self.scene.add_label(
                f"/plan/events/label/{number}",
                event.text,
                position=(*event.place, theme.Height.LABEL),
                anchor="bottom-center",
                font_screen_scale=0.8,
                visible=visible,
            )
            for number, event in enumerate(found)
        )

    def is_used(self, view: PageView) -> bool:
        """Whether something happens on the route."""
        route = view.part(RouteView)
        return route is not None and bool(route.risks or route.stations or len(route.prediction.trips()))

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return marks and names."""
        return *self._clouds.values(), *self._labels


def _risky(route: RouteView) -> FloatArray:
    """(N, 2) places from which a reflector may be taken for another one [m]."""
    points = np.concatenate([np.empty((0, 2)), *(risk.points for risk in route.risks)])
    return thinned(points, MOST_RISKY)
