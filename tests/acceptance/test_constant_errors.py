"""Errors of map, mounting, range and clock that stay over a drive, drawn anew for each: what the filter says of them.

The bound on ANEES is for 40 drives a site. A drive is one draw of its constants: with few of them the bounds are as
much wider as the mean over as many chi-squares of three degrees of freedom scatters, twice.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.simulation.scenario import virtual_drive
from commission.site.parameters import FilterParameters
from commission.site.project import Project
from commission.site.uncertainty import Uncertainty
from tests.acceptance.judged import judge
from tests.conftest import Seeds, few_of
from tests.constants_as_known import constants_as_known
from tests.planning.driven import QUICK

DRIVES = 40
FEW_DRIVES = {"laboratory": 6, "shop_floor": 6, "warehouse": 3}

pytestmark = pytest.mark.slow


def drawn(site: str, survey: float) -> Project:
    """A bundled site whose constants are drawn as its uncertainty says, and its reflectors surveyed to a 1-sigma."""
    project = load_project(bundled_folder("maps") / site)
    known = Uncertainty(survey=survey)
    disturbances = replace(project.disturbances.undisturbed(), constants=constants_as_known(known))
    return replace(project, uncertainty=known, disturbances=disturbances)


@dataclass(frozen=True)
class Outcome:
    """Means over drives."""

    anees: float
    rms: float
    """Of the position [m]."""


def outcomes(project: Project, seeds: range) -> tuple[Outcome, Outcome]:
    """The same drives, localized with constants considered and taken for noise."""
    route = project.routes[0].name
    logs = [virtual_drive(project, route, seed, options=QUICK) for seed in seeds]

    def outcome(consider: bool) -> Outcome:
        parameters = replace(project.parameters, filter=FilterParameters(consider=consider))
        judged = [judge(replace(project, parameters=parameters), route, log) for log in logs]
        squares = [np.nanmean(each.distances**2) for each in judged]
        return Outcome(float(np.mean([each.statistics.anees for each in judged])), float(np.sqrt(np.mean(squares))))

    return outcome(True), outcome(False)


@pytest.mark.parametrize("site", few_of(tuple(FEW_DRIVES), ("laboratory", "shop_floor")))
@pytest.mark.parametrize("survey", [0.0, 0.003, 0.01])
def test_a_filter_that_considers_constants_is_as_sure_as_it_may_be(site: str, survey: float, seeds: Seeds) -> None:
    project, numbers = drawn(site, survey), seeds(FEW_DRIVES[site], DRIVES)
    margin = 0.0 if seeds.all else 2.0 * np.sqrt(2.0 / (3.0 * len(numbers)))
    considering, noise = outcomes(project, numbers)
    assert 0.6 - margin < considering.anees < 1.1 + margin
    # Taken for noise, constants average out in the covariance alone.
    assert noise.anees > 3.0
    assert considering.rms < 1.02 * noise.rms
