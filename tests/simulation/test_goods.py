"""Reels of a virtual hall: there when they are said to be, and seen by the scanner."""

# pyright: basic

from __future__ import annotations

import numpy as np

from commission.simulation.goods import reels_at
from commission.simulation.scenario import virtual_drive
from commission.site.disturbances import Disturbances, Reel
from commission.site.project import Project
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner


def test_reels_appear_vanish_and_are_carried_to_where_they_stay():
    stays = Reel(x=1.0, y=2.0, radius=0.5)
    comes, goes = Reel(x=3.0, y=0.0, appears=2.0), Reel(x=4.0, y=0.0, vanishes=2.0)
    moves = Reel(x=0.0, y=0.0, carried=1.0, to_x=3.0, to_y=4.0, speed=2.0)
    hall = (stays, comes, goes, moves)
    np.testing.assert_array_equal(reels_at(hall, 0.0), [(1.0, 2.0, 0.5), (4.0, 0.0, 0.6), (0.0, 0.0, 0.6)])
    np.testing.assert_allclose(reels_at(hall, 2.0), [(1.0, 2.0, 0.5), (3.0, 0.0, 0.6), (1.2, 1.6, 0.6)])
    np.testing.assert_allclose(reels_at(hall, 9.0)[-1], (3.0, 4.0, 0.6))
    assert reels_at((), 1.0).shape == (0, 3)


def test_a_scanner_meets_a_reel_from_the_moment_at_which_it_stands_there():
    way = Route(
        name="Way", segments=(Segment(control_points=np.array([(0.0, 0.0), (0.1, 0.0), (0.2, 0.0), (0.3, 0.0)])),)
    )
    exact = Scanner(field_of_view_deg=(-10.0, 10.0), resolution_deg=1.0, range_sigma=0.0, bearing_sigma_deg=0.0)
    reel = Reel(x=5.0, y=0.0, appears=1.0)
    project = Project(routes=(way,), scanners=(exact,), disturbances=Disturbances(reels=(reel,)))
    (scans,) = virtual_drive(project, "Way", 1).scans
    ahead = scans.block(0, len(scans)).ranges[:, 10]
    there = scans.stamps_ns >= 1_000_000_000
    assert np.isnan(ahead[~there]).all()
    x = 5.0 - exact.mounting[0] - 0.6
    np.testing.assert_allclose(ahead[there], np.clip(ahead[there], x - 0.35, x + 0.05))
