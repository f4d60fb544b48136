"""Placement: demands hold in independent predictions, and small cases are solved with the fewest reflectors."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from commission.errors import UsageError
from commission.geometry.occupancy import OccupancyGrid
from commission.planning.candidates import CandidateOptions, clear_of, wall_candidates
from commission.planning.placement import Demands, PlacementOptions, choose, place
from commission.planning.route_prediction import Damage, plan_route, predict_route
from commission.planning.visibility import visibility_model
from commission.site.parameters import OdometryParameters, Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from tests.planning.sites import open_field, room

SCANNER = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=8.0, rate=5.0)
"""Five scans a second keep the enumeration of all layouts short."""


def hall(**changes) -> Project:
    route = Route("Through", (Segment(np.array([[2.0, 4.0], [16.0, 4.0]]), degree=1),), 1.0)
    return Project(floor_map=room(18.0, 8.0), scanner=SCANNER, routes=(route,), **changes)


def holds(project: Project, reflectors: ReflectorMap, demands: Demands) -> bool:
    """Whether a layout meets the demands, by predictions of its own."""
    site = replace(project, reflectors=reflectors)
    planned = plan_route(site, project.routes[0].name)
    if planned.visible.counts().min() < demands.visible + demands.survive_failure:
        return False
    damages = [Damage(), *(Damage(blocked=(i,)) for i in range(len(reflectors)) if demands.survive_failure)]
    limit = demands.position_limit or project.parameters.supervisor.position_limit
    heading = demands.heading_limit or project.parameters.supervisor.heading_limit
    return all(bool(np.all(predict_route(planned, each).two_sigma <= (limit, limit, heading))) for each in damages)


def test_a_suggested_layout_meets_its_demands_and_its_spacing():
    project, demands = hall(), Demands(visible=2, spacing=1.0)
    found = place(project, options=PlacementOptions(demands))
    assert found.unmet == ()
    assert found.at_least <= found.added == len(found.reflectors) <= found.at_least + 2
    assert holds(project, found.reflectors, demands)
    centers = found.reflectors.centers
    apart = np.hypot(*(centers[:, np.newaxis] - centers).transpose(2, 0, 1))[np.triu_indices(len(centers), 1)]
    assert apart.min() >= 1.0
    # On the free side of the walls, and off the vehicle's way.
    assert not project.floor_map.occupancy().is_occupied(centers).any()
    assert np.abs(centers[:, 1] - 4.0).min() > 0.6


def test_tight_limits_ask_for_more_reflectors_than_sight_alone():
    # So poor odometry that two distant reflectors do not hold the pose.
    project = hall(parameters=Parameters(odometry=OdometryParameters(heading_per_sqrt_m=0.05, forward_per_sqrt_m=0.05)))
    loose, tight = Demands(1, survive_failure=False), Demands(1, survive_failure=False, position_limit=0.03)
    few, more = (place(project, options=PlacementOptions(demands)) for demands in (loose, tight))
    assert few.added < more.added
    assert more.unmet == ()
    assert holds(project, more.reflectors, tight)


def random_case(seed):
    """Twelve candidates on the walls, and demands of which now the sight and now the limits are hard to meet."""
    rng = np.random.default_rng(seed)
    x = np.concatenate((rng.uniform(0.5, 17.5, 6), rng.uniform(0.5, 17.5, 6)))
    y = np.repeat((0.2, 7.8), 6)
    odometry = OdometryParameters(heading_per_sqrt_m=0.03, forward_per_sqrt_m=0.03)
    project = hall(parameters=Parameters(odometry=odometry))
    demands = Demands(
        visible=1,
        survive_failure=bool(seed % 2),
        position_limit=float(rng.choice([0.04, 0.06, 0.1])),
        spacing=0.2,
    )
    return project, np.column_stack((x, y)), demands


def smaller_layout_holds(project, centers, demands, size):
    """Whether any layout of that many of the candidates meets the demands."""
    everything = ReflectorMap(tuple(Reflector(f"C{i}", x, y) for i, (x, y) in enumerate(centers)))
    site = replace(project, reflectors=everything)
    planned = plan_route(site, "Through", model=visibility_model(site))
    sees = np.zeros((len(planned.drive), len(centers)), dtype=bool)
    sees[np.repeat(np.arange(len(sees)), planned.visible.counts()), planned.visible.indices] = True
    need = demands.visible + demands.survive_failure
    for chosen in itertools.combinations(range(len(centers)), size):
        if sees[:, chosen].sum(axis=1).min() < need:
            continue
        layout = ReflectorMap(tuple(everything.reflectors[i] for i in chosen))
        near = np.hypot(*(layout.centers[:, np.newaxis] - layout.centers).transpose(2, 0, 1))
        if near[np.triu_indices(size, 1)].min(initial=9.0) >= demands.spacing and holds(project, layout, demands):
            return True
    return False


@pytest.mark.slow
def test_small_cases_are_solved_with_the_fewest_reflectors_or_one_more():
    optimal = []
    for seed in range(12):
        project, centers, demands = random_case(seed)
        found = choose(project, ("Through",), centers, PlacementOptions(demands, extend=False))
        if found.unmet:
            # Then all candidates together fail as well, or their spacing forbids it.
            everything = ReflectorMap(tuple(Reflector(f"C{i}", x, y) for i, (x, y) in enumerate(centers)))
            assert not holds(project, everything, demands)
            continue
        assert holds(project, found.reflectors, demands)
        optimal.append(not smaller_layout_holds(project, centers, demands, found.added - 1))
        if not optimal[-1]:
            assert not smaller_layout_holds(project, centers, demands, found.added - 2)
    assert len(optimal) >= 6
    assert np.mean(optimal) >= 0.9


def test_extending_keeps_what_there_is_and_adds_fewer():
    project, demands = hall(), Demands(visible=2)
    empty = place(project, options=PlacementOptions(demands))
    half = ReflectorMap(empty.reflectors.reflectors[::2])
    extended = place(replace(project, reflectors=half), options=PlacementOptions(demands))
    assert extended.reflectors.reflectors[: len(half)] == half.reflectors
    assert extended.added < empty.added
    assert extended.unmet == ()
    ids = [reflector.id for reflector in extended.reflectors.reflectors]
    assert len(set(ids)) == len(ids)


def test_what_cannot_be_met_is_named_by_route_and_metre():
    far = Project(floor_map=room(18.0, 8.0), scanner=replace(SCANNER, reflector_range=2.0), routes=hall().routes)
    found = place(far, options=PlacementOptions(Demands(visible=2)))
    assert {(unmet.route, unmet.reason) for unmet in found.unmet} >= {("Through", "visible")}
    # In the middle of the hall no wall is within two metres.
    assert 7 in next(unmet for unmet in found.unmet if unmet.reason == "visible").metres


def test_an_open_field_has_no_candidates():
    found = place(open_field([(3.0, 2.0)]))
    assert found.added == 0
    assert len(found.candidates) == 0
    assert found.unmet


def test_an_unknown_route_is_refused():
    with pytest.raises(UsageError, match="no route is called 'Loop'"):
        place(hall(), ("Loop",))


def test_progress_never_falls_and_may_cancel():
    fractions = []
    place(hall(), options=PlacementOptions(Demands(1)), progress=lambda done, _: fractions.append(done))
    assert fractions == sorted(fractions)

    def stop(fraction, what):
        if what == "predicting":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        place(hall(), options=PlacementOptions(Demands(1)), progress=stop)


def test_the_same_seed_gives_the_same_layout():
    first, second = (place(hall(), options=PlacementOptions(Demands(2))) for _ in range(2))
    assert first.reflectors == second.reflectors


def test_candidates_stand_off_walls_at_their_spacing_and_outside_keep_out_areas():
    occupied = np.zeros((100, 160), dtype=np.bool_)
    occupied[40:60, 70:90] = True
    grid = OccupancyGrid(occupied, 0.05)
    options = CandidateOptions(spacing=0.4, keep_out=((3.0, 0.0, 5.0, 2.5),))
    centers = wall_candidates(grid, options)
    assert len(centers) > 3
    # The pillar spans 3.5 to 4.5 and 2 to 3 m.
    outside = np.maximum(np.abs(centers - (4.0, 2.5)) - 0.5, 0.0)
    off = np.hypot(*outside.T)
    assert off.min() >= options.radius
    # A gap and a radius, and a cell and the diagonal of a half one by which centers of cells differ.
    assert off.max() <= options.radius + options.gap + 1.71 * 0.05
    apart = np.hypot(*(centers[:, np.newaxis] - centers).transpose(2, 0, 1))[np.triu_indices(len(centers), 1)]
    assert apart.min() >= 0.4 * (1.0 - 1e-9)
    assert centers[:, 1].min() > 2.5


def test_places_in_the_way_are_left_out():
    centers = np.array([[0.0, 1.0], [0.0, 3.0]])
    assert clear_of(centers, np.array([[0.0, 0.0], [1.0, 0.0]]), 2.0).tolist() == [False, True]
    assert clear_of(centers, np.empty((0, 2)), 2.0).all()
