"""The map's frame moved and turned onto the plant's: two points whose plant coordinates are known say how.

A map keeps its scale: where the two distances differ the points are met halfway, and the difference is told.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from commission.errors import UsageError
from commission.geometry import se2
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray
from commission.site.disturbances import Disturbances
from commission.site.floor_map import FloorMap
from commission.site.layout_brief import LayoutBrief, Rectangle, Spot
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route
from commission.site.stations import Station
from commission.site.tags import Tag
from commission.site.zones import Zone

DOUBTFUL = 0.002
"""Difference of the two distances, as a share, from which the points should be looked at: 20 mm on 10 m."""
WRONG = 0.02
"""Difference of the two distances, as a share, that no building has: a wrong point, number or scale."""
NEAREST = 0.1
"""Two points closer than this say nothing about a direction [m]."""


@dataclass(frozen=True, slots=True)
class KnownPoint:
    """A point of the map whose plant coordinates are known."""

    at: tuple[float, float]
    """Where it lies in the map [m, m]."""
    plant: tuple[float, float]
    """Where it lies in the plant's coordinate system [m, m]."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """How a map is moved and turned."""

    T_plant_map: FloatArray
    """(3,) pose of the map's frame in the plant's [m, m, rad]."""
    on_map: float
    """Distance between the two points on the map [m]."""
    in_plant: float
    """The same in the plant [m]."""

    @property
    def residual(self) -> float:
        """By how much the plant's distance is longer than the map's [m]; each point is missed by half of it."""
        return self.in_plant - self.on_map

    @property
    def share(self) -> float:
        """The residual as a share of the distance, without sign."""
        return abs(self.residual) / self.in_plant


def align(a: KnownPoint, b: KnownPoint) -> Alignment:
    """Find how to move and turn the map so that two points come to lie where they do in the plant.

    Parameters
    ----------
    a, b : the points. Where their distances differ, the middles coincide and so do the directions.

    Raises
    ------
    UsageError
        the points are too close to each other, on the map or in the plant.
    """
    on_map, in_plant = (np.subtract(end, start) for start, end in ((a.at, b.at), (a.plant, b.plant)))
    distances = float(np.hypot(*on_map)), float(np.hypot(*in_plant))
    for distance, where in zip(distances, ("on the map", "in the plant"), strict=True):
        if not NEAREST <= distance < math.inf:
            raise UsageError(
                f"A and B are {distance:.3f} m apart {where}; expected {NEAREST:g} m or more, better far more"
            )
    turn = wrap_scalar(math.atan2(in_plant[1], in_plant[0]) - math.atan2(on_map[1], on_map[0]))
    middle_map, middle_plant = (0.5 * np.add(start, end) for start, end in ((a.at, b.at), (a.plant, b.plant)))
    x, y = middle_plant - se2.transform_points(np.array([0.0, 0.0, turn]), middle_map)
    return Alignment(np.array([x, y, turn]), *distances)


def with_moved_map(floor_map: FloorMap, T_plant_map: FloatArray) -> FloorMap:
    """Return the map in the plant's frame; its cells are the same."""
    return replace(floor_map, origin=se2.compose(T_plant_map, floor_map.origin))


def aligned(project: Project, alignment: Alignment, *, everything: bool) -> Project:
    """Move and turn the floor map.

    Parameters
    ----------
    project : the site.
    alignment : how.
    everything : whether what was placed on the map goes with it: reflectors (locked ones, too: they stay where they are
        on the map), tags, zones, routes, stations, where virtual drives are disturbed, and where new reflectors may
        stand. Otherwise they are in the plant's coordinates already.

    Raises
    ------
    UsageError
        the two distances differ by more than `WRONG`, or there is no map.
    """
    if alignment.share > WRONG:
        raise UsageError(
            f"A and B are {alignment.on_map:.3f} m apart on the map and {alignment.in_plant:.3f} m in the plant, "
            f"{100.0 * alignment.share:.1f} % more or less; expected at most {100.0 * WRONG:g} %"
        )
    if project.floor_map is None:
        raise UsageError("the project has no floor map to move; expected one")
    return moved_onto(project, alignment.T_plant_map, everything=everything)


def moved_onto(project: Project, T: FloatArray, *, everything: bool) -> Project:
    """Move and turn the floor map, where there is one, and what is on it.

    Parameters
    ----------
    project : the site.
    T : (3,) `T_plant_map`: pose of the map's frame in the plant's [m, m, rad].
    everything : as in `aligned`.
    """
    floor_map = project.floor_map
    moved = replace(project, floor_map=None if floor_map is None else with_moved_map(floor_map, T))
    if not everything:
        return moved
    return replace(
        moved,
        reflectors=ReflectorMap(tuple(_reflector(r, T) for r in project.reflectors.reflectors)),
        tags=tuple(_tag(tag, T) for tag in project.tags),
        zones=tuple(_zone(zone, T) for zone in project.zones),
        routes=tuple(_route(route, T) for route in project.routes),
        stations=tuple(_station(station, T) for station in project.stations),
        disturbances=_disturbances(project.disturbances, T),
        layout=_layout(project.layout, T),
    )


def _reflector(reflector: Reflector, T: FloatArray) -> Reflector:
    x, y, heading = se2.compose(T, np.array([reflector.x, reflector.y, reflector.heading or 0.0]))
    return replace(reflector, x=float(x), y=float(y), heading=None if reflector.heading is None else float(heading))


def _tag(tag: Tag, T: FloatArray) -> Tag:
    x, y, heading = se2.compose(T, tag.pose)
    return replace(tag, x=float(x), y=float(y), heading=float(heading))


def _zone(zone: Zone, T: FloatArray) -> Zone:
    corners = se2.transform_points(T, np.array(zone.outline)).tolist()
    return replace(zone, outline=tuple((x, y) for x, y in corners))


def _station(station: Station, T: FloatArray) -> Station:
    x, y, heading = se2.compose(T, station.pose)
    return replace(station, x=float(x), y=float(y), heading=float(heading))


def _route(route: Route, T: FloatArray) -> Route:
    segments = (replace(s, control_points=se2.transform_points(T, s.control_points)) for s in route.segments)
    return replace(route, segments=tuple(segments))


def _disturbances(disturbances: Disturbances, T: FloatArray) -> Disturbances:
    def place(x: float, y: float, prefix: str = "") -> dict[str, float]:
        moved = se2.transform_points(T, np.array([x, y]))
        return {f"{prefix}x": float(moved[0]), f"{prefix}y": float(moved[1])}

    return replace(
        disturbances,
        shiny_objects=tuple(replace(each, **place(each.x, each.y)) for each in disturbances.shiny_objects),
        tilted_stretches=tuple(replace(each, **place(each.x, each.y)) for each in disturbances.tilted_stretches),
        reels=tuple(
            replace(each, **place(each.x, each.y), **place(each.to_x, each.to_y, "to_")) for each in disturbances.reels
        ),
    )


def _layout(layout: LayoutBrief, T: FloatArray) -> LayoutBrief:
    """Areas and spots; a rectangle that is turned becomes the smallest upright one around it."""

    def area(rectangle: Rectangle) -> Rectangle:
        x_a, y_a, x_b, y_b = rectangle
        corners = se2.transform_points(T, np.array([(x_a, y_a), (x_b, y_a), (x_b, y_b), (x_a, y_b)]))
        (x_low, y_low), (x_high, y_high) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return x_low, y_low, x_high, y_high

    def spot(place: Spot) -> Spot:
        moved = se2.compose(T, np.array([*place, 0.0][:3]))
        return tuple(moved.tolist()[: len(place)])

    candidates, demands = layout.candidates, layout.demands
    heights = (
        each if each.area is None else replace(each, area=area(each.area)) for each in candidates.allowed_heights
    )
    return replace(
        layout,
        candidates=replace(candidates, keep_out=tuple(map(area, candidates.keep_out)), allowed_heights=tuple(heights)),
        demands=replace(demands, unambiguous_spots=tuple(map(spot, demands.unambiguous_spots))),
    )
