"""Random valid projects for property tests."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from commission.site.disturbances import (
    ConstantErrors,
    CoveredPeriod,
    Disturbances,
    ScannerError,
    ShinyObject,
    TiltedStretch,
    WheelNoise,
)
from commission.site.floor_map import FREE, OCCUPIED, UNKNOWN, FloorMap
from commission.site.layout_brief import AllowedHeights, CandidateOptions, Demands, LayoutBrief
from commission.site.parameters import (
    AssociationParameters,
    DetectorParameters,
    ObservationParameters,
    OdometryParameters,
    Parameters,
    SupervisorParameters,
)
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Direction, Route, Segment
from commission.site.scanner import Scanner, StampOf
from commission.site.stations import Station
from commission.site.tags import Tag, TagCamera
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle, Vehicle
from commission.site.zones import ObservationKind, Zone

METRES = st.floats(-1e4, 1e4)
SPEED = st.floats(0.001, 100.0)
POSITIVE = st.floats(1e-6, 1e3)
NAME = st.text(st.characters(blacklist_categories=("Cs",)), min_size=1, max_size=12)
POINT = st.tuples(METRES, METRES)
LENGTHS = st.lists(st.floats(0.1, 1e4), min_size=3, max_size=9)
# Corners around the base one after the other: an outline that crosses itself is none.
OUTLINE = LENGTHS.map(
    lambda lengths: tuple(
        (length * math.cos(2.0 * math.pi * i / len(lengths)), length * math.sin(2.0 * math.pi * i / len(lengths)))
        for i, length in enumerate(lengths)
    )
)
ARM = st.floats(-50.0, 50.0)


def vehicles() -> st.SearchStrategy[Vehicle]:
    return st.one_of(
        st.builds(DifferentialVehicle, wheel_separation=POSITIVE, outline=OUTLINE),
        st.builds(TricycleVehicle, wheelbase=POSITIVE, max_steering_deg=st.floats(1.0, 90.0), outline=OUTLINE),
        st.builds(
            OmnidirectionalVehicle,
            wheel_angles_deg=st.lists(st.integers(0, 359).map(float), min_size=3, max_size=6, unique=True).map(tuple),
            wheel_radius=POSITIVE,
            center_distance=POSITIVE,
            outline=OUTLINE,
        ),
    )


def scanners() -> st.SearchStrategy[Scanner]:
    return st.builds(
        Scanner,
        mounting=st.tuples(ARM, ARM, st.floats(-math.pi, math.pi)).map(np.array),
        field_of_view_deg=st.tuples(st.floats(-180.0, -1.0), st.floats(1.0, 180.0)),
        resolution_deg=st.floats(0.05, 2.0),
        rate=st.floats(1.0, 100.0),
        range_sigma=st.floats(0.0, 0.1),
        name=st.sampled_from(["front left", "rear-right", "Front Left", "2"]),
        upside_down=st.booleans(),
        blind_sectors_deg=st.sampled_from([(), ((-0.75, 0.25),), ((-0.9, -0.5), (-0.5, 0.125))]),
        beam_aperture=st.floats(0.0, 0.1),
        detection_rates=st.sampled_from([(), ((5.0, 0.8),), ((0.0, 1.0), (5.25, 0.8125), (15.0, 0.0))]),
        sweep_duration=st.floats(0.0, 0.009),
        sweep_direction=st.sampled_from([1, -1]),
        stamp_of=st.sampled_from(StampOf),
        clock_offset=st.floats(-1.0, 1.0),
    )


@st.composite
def segments(draw: st.DrawFn) -> Segment:
    degree = draw(st.integers(1, 4))
    points = draw(st.lists(POINT, min_size=degree + 1, max_size=degree + 4, unique=True))
    weights = draw(st.none() | st.lists(st.floats(0.1, 10.0), min_size=len(points), max_size=len(points)))
    knots = None
    if draw(st.booleans()):
        inner = np.linspace(0.0, 1.0, len(points) - degree + 1)[1:-1] ** 1.5
        knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    return Segment(
        control_points=np.array(points),
        direction=draw(st.sampled_from(Direction)),
        degree=degree,
        knots=knots,
        weights=None if weights is None else np.array(weights),
        speed=draw(st.none() | SPEED),
    )


def stations() -> st.SearchStrategy[Station]:
    heading, accuracy = st.floats(-math.pi, math.pi), st.floats(0.001, 10.0)
    return st.builds(Station, name=NAME, x=METRES, y=METRES, heading=heading, required_accuracy=accuracy)


def zones() -> st.SearchStrategy[Zone]:
    kinds = st.lists(st.sampled_from(ObservationKind), min_size=1, unique=True).map(tuple)
    return st.builds(Zone, name=NAME.filter(str.strip), outline=OUTLINE, kinds=kinds)


def tags() -> st.SearchStrategy[Tag]:
    heading = st.floats(-math.pi, math.pi)
    return st.builds(Tag, id=st.integers(0, 99).map(str), x=METRES, y=METRES, heading=heading, anonymous=st.booleans())


def parameters() -> st.SearchStrategy[Parameters]:
    sigma = st.floats(0.0, 1.0)
    return st.builds(
        Parameters,
        observation=st.builds(ObservationParameters, range_sigma=POSITIVE, bearing_sigma=POSITIVE),
        odometry=st.builds(OdometryParameters, forward_per_sqrt_m=sigma, heading_per_sqrt_s=sigma),
        detector=st.builds(
            DetectorParameters,
            enabled=st.booleans(),
            min_model_error=st.integers(0, 9),
            center=st.sampled_from(["circle", "central_beam"]),
        ),
        association=st.builds(AssociationParameters, gate_probability=st.floats(0.01, 0.99)),
        supervisor=st.builds(SupervisorParameters, position_limit=POSITIVE, recovery_ratio=st.floats(1.0, 9.0)),
    )


def disturbances() -> st.SearchStrategy[Disturbances]:
    small = st.floats(0.0, 0.1)
    return st.builds(
        Disturbances,
        people=st.integers(0, 99),
        shiny_objects=st.lists(st.builds(ShinyObject, x=METRES, y=METRES), max_size=2).map(tuple),
        tilted_stretches=st.lists(st.builds(TiltedStretch, x=METRES, y=METRES, radius=POSITIVE), max_size=2).map(tuple),
        covered=st.lists(st.builds(CoveredPeriod, start=POSITIVE, duration=POSITIVE), max_size=2).map(tuple),
        dropped_scans=st.floats(0.0, 1.0),
        wheels=st.builds(WheelNoise, forward_per_sqrt_m=st.floats(0.0, 1.0), heading_per_sqrt_s=st.floats(0.0, 1.0)),
        constants=st.builds(
            ConstantErrors,
            survey_factor=st.floats(0.0, 9.0),
            mounting_sigma=st.tuples(small, small, small),
            scanners=st.lists(st.builds(ScannerError, scanner=NAME, range_bias=small), max_size=2).map(tuple),
        ),
    )


def layouts() -> st.SearchStrategy[LayoutBrief]:
    area = st.tuples(METRES, METRES, METRES, METRES)
    heights = st.builds(AllowedHeights, lowest=st.floats(0.0, 1.0), highest=st.floats(1.0, 3.0), area=st.none() | area)
    spots = st.lists(POINT | st.tuples(METRES, METRES, st.floats(-math.pi, math.pi)), max_size=2).map(tuple)
    return st.builds(
        LayoutBrief,
        demands=st.builds(
            Demands,
            visible=st.integers(1, 9),
            survive_failure=st.booleans(),
            position_limit=st.none() | POSITIVE,
            pairs_differ=st.just(0.0) | POSITIVE,
            wall_reach=st.just(0.0) | POSITIVE,
            unambiguous_spots=spots,
        ),
        candidates=st.builds(
            CandidateOptions,
            radius=POSITIVE,
            keep_out=st.lists(area, max_size=2).map(tuple),
            allowed_heights=st.lists(heights, max_size=2).map(tuple),
        ),
        ignored_routes=st.lists(NAME, max_size=2).map(tuple),
    )


def floor_maps() -> st.SearchStrategy[FloorMap]:
    cells = hnp.arrays(np.int8, (4, 5), elements=st.sampled_from([FREE, OCCUPIED, UNKNOWN]))
    origin = st.tuples(METRES, METRES, st.floats(-3.0, 3.0)).map(np.array)
    return st.builds(FloorMap, cells=cells, resolution=st.floats(1e-3, 1.0), origin=origin)


def projects() -> st.SearchStrategy[Project]:
    route = st.builds(Route, name=NAME, segments=segments().map(lambda s: (s,)), speed=SPEED)
    reflectors = st.lists(st.builds(Reflector, id=st.integers(0, 99).map(str), x=METRES, y=METRES), max_size=3)
    return st.builds(
        Project,
        name=st.text(st.characters(blacklist_categories=("Cs",)), max_size=12),
        floor_map=st.none() | floor_maps(),
        reflectors=reflectors.filter(lambda rs: len({r.id for r in rs}) == len(rs)).map(
            lambda rs: ReflectorMap(tuple(rs))
        ),
        routes=st.lists(route, max_size=3, unique_by=lambda r: r.name).map(tuple),
        vehicle=vehicles(),
        scanners=st.lists(scanners(), min_size=1, max_size=2, unique_by=lambda s: s.name.casefold()).map(tuple),
        parameters=parameters(),
        disturbances=disturbances(),
        stations=st.lists(stations(), max_size=2, unique_by=lambda s: s.name).map(tuple),
        tags=st.lists(tags(), max_size=2, unique_by=lambda tag: tag.id).map(tuple),
        tag_camera=st.builds(TagCamera, mounting=st.tuples(ARM, ARM, st.floats(-math.pi, math.pi)).map(np.array)),
        zones=st.lists(zones(), max_size=2, unique_by=lambda zone: zone.name).map(tuple),
        layout=layouts(),
    )
