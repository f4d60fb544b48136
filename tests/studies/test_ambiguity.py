"""Ambiguity of a site: floor and routes joined, with figures for drivable floor alone."""

from dataclasses import replace

import numpy as np
import pytest

from commission.errors import UsageError
from commission.planning.ambiguity import AmbiguityOptions
from commission.progress import Progress, silent
from commission.site.project import Project
from commission.site.scanner import Scanner
from commission.studies.ambiguity import (
    AmbiguityInput,
    AmbiguityResult,
    SiteAmbiguity,
    ambiguity,
    metres_at_risk,
    misleading_neighbors,
    summary,
)
from commission.studies.drives import DrivesInput
from tests.planning.sites import open_field, reflectors_at, room

ALL_AROUND = Scanner(field_of_view_deg=(-180.0, 180.0), reflector_range=20.0)
CORNERS = ((0.2, 0.2), (11.8, 0.2), (11.8, 7.8), (0.2, 7.8))


def hall(scanner=ALL_AROUND) -> Project:
    return Project(floor_map=room(12.0, 8.0), reflectors=reflectors_at(CORNERS), scanners=(scanner,))


def over_floor(
    project: Project, spacing: float, options: AmbiguityOptions | None = None, progress: Progress = silent
) -> AmbiguityResult:
    return ambiguity(AmbiguityInput.of(project, options, spacing=spacing), progress)


def test_walls_have_no_figures_and_the_floor_has_all():
    found = over_floor(hall(), 0.05)
    edge = found.share.reshape(found.lattice.rows, found.lattice.columns)[0]
    assert np.isnan(edge).all()
    assert found.visible.reshape(found.lattice.rows, -1)[0].max() == -1
    assert np.isfinite(found.share[found.drivable]).all()


def test_the_share_is_that_of_the_headings_that_are_ambiguous():
    # Half a turn of sight sees two corners of one wall in some headings, and one corner or none in others.
    narrow = replace(ALL_AROUND, field_of_view_deg=(-60.0, 60.0))
    found = over_floor(hall(narrow), 1.0, AmbiguityOptions(headings=4))
    assert set(np.unique(found.share[found.drivable] * 4)) <= {0.0, 1.0, 2.0, 3.0, 4.0}
    assert found.share[found.drivable].max() > 0.0
    count = len(found.cold.poses) // 4
    first = np.flatnonzero(found.drivable)[0]
    at = np.hypot(*(found.cold.poses[:count, :2] - found.lattice.points()[first]).T).argmin()
    assert found.share[first] == found.cold.ambiguous[at::count].mean()


def test_the_summary_counts_floor_and_metres():
    project = open_field([(3.0, 2.0), (3.03, 2.0), (9.0, -2.0), (14.0, 2.5)], scanner=ALL_AROUND)
    tracked = misleading_neighbors(DrivesInput.of(project, ("Line",)))
    found = SiteAmbiguity(over_floor(project, 2.0), tracked)
    entries = summary(found)
    assert entries["area_m2"] == 4.0 * entries["points"]
    assert entries["ambiguous_area_m2"] <= entries["area_m2"]
    ((route,),) = (entries["routes"],)
    assert route["metres"] == len(metres_at_risk(found.routes[0].risks)) > 0
    assert 0.0 < route["worst_probability"] <= 0.5


def test_only_the_routes_that_are_asked_for_are_tracked():
    assert misleading_neighbors(DrivesInput.of(open_field(CORNERS), ())) == ()
    with pytest.raises(UsageError, match="no route is called 'Loop'"):
        DrivesInput.of(open_field(CORNERS), ("Loop",))


def test_progress_rises_to_one():
    seen = []
    over_floor(open_field(CORNERS), 2.0, progress=lambda done, _: seen.append(done))
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
