"""What is told of temporary landmarks is what became of them, and a run in which none counted says so."""

# pyright: basic

from __future__ import annotations

import dataclasses

import pytest

from commission.cli.localize import _by_goods
from commission.localization.setup import LocalizerSetup
from commission.site.disturbances import Reel
from commission.site.parameters import TemporaryParameters
from commission.studies.run import RunInput, judged_run
from commission.studies.start import Start, StartOrigin
from commission.studies.temporary_figures import temporary_figures, temporary_findings
from tests.paper_warehouse import yard


@pytest.fixture(scope="module")
def driven():
    return yard(1)


def result_of(driven, **changes):
    own = TemporaryParameters(**changes)
    parameters = dataclasses.replace(driven.project.parameters, temporary=own)
    project = dataclasses.replace(driven.project, parameters=parameters)
    given = RunInput.of(project, driven.log, Start(driven.start, StartOrigin.DRIVE))
    return judged_run(given.with_setup(LocalizerSetup.of(project)))


def test_figures_count_what_became_of_landmarks(driven):
    result = result_of(driven, enabled=True)
    told, known = temporary_figures(result.columns), result.columns.final.temporary
    assert known is not None
    born, forgotten, matched, most = (
        int(told[f"temporary_{name}"] or 0) for name in ("born", "forgotten", "matched", "known_max")
    )
    assert born == known.born == len(known) + forgotten
    assert matched >= known.marks[:, 3].sum() - len(known), "a birth is no match"
    assert most <= 9, "there are nine reels"
    nis = told["temporary_nis_per_row_mean"]
    assert nis is not None and 0.0 < nis < 1.2
    assert temporary_findings(result.columns) == ()
    (line,) = _by_goods(result)
    assert f"{matched} sightings of landmarks" in line and f"{known.born} born" in line


def test_a_run_in_which_none_counts_says_why(driven):
    nothing = result_of(driven, enabled=True, least_radius=2.0, largest_radius=3.0, corners=False)
    (finding,) = temporary_findings(nothing.columns)
    assert "no scan shows a reel or a corner" in finding.found
    carried = [Reel(x=x, y=4.0, carried=0.01, to_x=x, to_y=60.0, speed=2.5) for x in (5.0, 8.0, 11.0)]
    moving = result_of(yard(1, tuple(carried)), enabled=True, corners=False)
    (finding,) = temporary_findings(moving.columns)
    assert "none often enough" in finding.found
    off = result_of(driven, enabled=False)
    assert temporary_figures(off.columns) == {} and _by_goods(off) == [] and temporary_findings(off.columns) == ()
