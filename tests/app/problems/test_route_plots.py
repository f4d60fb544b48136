"""The plots along the selected route, without a browser: what they show and when they are drawn."""

from dataclasses import replace

import numpy as np
import pytest

from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import PageView, view_of
from commission.app.editing.editor import ControlPoint, Editor
from commission.app.problems.route_plots import CHARTS, NOTHING, RoutePlots, flags, span, summary
from commission.app.problems.view import InspectionView
from commission.app.problems.violation_layer import ViolationLayer
from commission.planning.route_profile import route_profile
from commission.site.routes import Route
from commission.site.vehicle import TricycleVehicle
from commission.studies.violations import Violation, ViolationKind, check_route
from tests.app.asking import ME, joined
from tests.app.sites import room

ROOM = replace(room(), vehicle=TricycleVehicle(wheelbase=3.0, max_steering_deg=20.0))
ROUTE = ROOM.routes[0]
PROFILE = route_profile(ROUTE, ROOM.vehicle)
VIOLATIONS = check_route(ROUTE, ROOM.vehicle, None, 0.1).violations


@pytest.fixture
def server():
    server = start_server("127.0.0.1", 0)
    yield server
    server.stop()


def view(route: str | None, violations: tuple[Violation, ...] = VIOLATIONS) -> PageView:
    point = None if route is None else ControlPoint(route)
    state = joined(AppState(project=ROOM, saved=ROOM)).with_browser(ME, Editor(point=point))
    return view_of(state, InspectionView(violations=violations, profiles={ROUTE.name: PROFILE}))


def test_without_a_selected_route_there_is_a_hint_and_no_plot(server) -> None:
    panel = RoutePlots(server.gui, ME)
    panel.draw_slowly(view(None))
    assert NOTHING in panel._head.content
    assert not any(plot.visible for plot in panel._plots)


def test_a_selected_route_is_drawn_once_and_again_only_when_something_of_it_changes(server) -> None:
    panel = RoutePlots(server.gui, ME)
    panel.draw_slowly(view(ROUTE.name))
    assert all(plot.visible for plot in panel._plots)
    drawn = [plot.data for plot in panel._plots]
    panel.draw_slowly(view(ROUTE.name))
    assert all(plot.data is data for plot, data in zip(panel._plots, drawn, strict=True))
    panel.draw_slowly(view(ROUTE.name, ()))
    assert all(plot.data is not data for plot, data in zip(panel._plots, drawn, strict=True))


def test_the_curve_and_its_limit_are_both_inside_the_curvature_plot() -> None:
    low, high = span(CHARTS[0], PROFILE)
    assert low < -PROFILE.largest_curvature < PROFILE.largest_curvature < high
    assert np.isfinite([low, high]).all()


def test_violated_stretches_are_marked_at_their_metres() -> None:
    curves = [violation for violation in VIOLATIONS if violation.kind is ViolationKind.CURVE]
    assert curves
    marked = PROFILE.metres[flags(PROFILE, curves) > 0.0]
    begin, end = curves[0].where.metres
    assert marked[0] == pytest.approx(begin, abs=0.05)
    assert np.any(np.abs(marked - end) < 0.05)
    # What is marked is what is too tight.
    assert np.abs(np.interp(0.5 * (begin + end), PROFILE.metres, np.abs(PROFILE.curvatures))) > 0.12


def test_the_line_of_facts_names_lengths_radii_and_what_is_violated_and_escapes_the_name() -> None:
    text = summary("<b>", PROFILE, VIOLATIONS)
    assert "&lt;b&gt;" in text
    assert f"{PROFILE.length:.1f} m" in text
    assert "(vehicle: 8.24 m)" in text
    assert "too tight: " in text
    assert "nothing violated" in summary("r", PROFILE, ())


def test_every_violated_stretch_is_drawn_with_the_outline_where_it_is_worst(server) -> None:
    layer = ViolationLayer(server.scene)
    layer.show_site(ROOM)
    layer.draw(view(None))
    fatal = [v for v in VIOLATIONS if v.is_fatal]
    places = layer._fatal.points.reshape(-1, 3)[:, :2]
    for violation in fatal:
        gaps = np.hypot(*(places - violation.where.worst_pose[:2]).T)
        assert gaps.min() < 0.2
    corners = len(ROOM.vehicle.outline)
    assert len(layer._worst_outlines.points) == corners * len(VIOLATIONS)
    before = layer._fatal.points
    layer.draw(view(None))
    assert layer._fatal.points is before
    layer.draw(view(None, ()))
    assert layer._fatal.points.min() == -1000.0


def test_a_route_of_another_name_leaves_the_plots_of_this_one_empty(server) -> None:
    panel = RoutePlots(server.gui, ME)
    renamed = Route("Other", ROUTE.segments)
    state = joined(AppState(project=replace(ROOM, routes=(ROUTE, renamed)), saved=ROOM)).with_browser(
        ME, Editor(point=ControlPoint("Other"))
    )
    panel.draw_slowly(view_of(state, InspectionView(profiles={ROUTE.name: PROFILE})))
    assert "Looking along Other" in panel._head.content
