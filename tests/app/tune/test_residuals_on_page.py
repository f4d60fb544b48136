"""Residuals on the page: studied while they are wanted, again when the run changes, and said and drawn as found."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from commission.app.base.shown_run import RunShown
from commission.app.tune.diagnosis import DiagnosisService, ShowResiduals, residual_text
from commission.io.residual_charts import charts
from commission.localization.setup import LocalizerSetup
from commission.site.fields import with_field
from commission.site.project import Project
from commission.studies.residual_study import ResidualInput, residual_study
from commission.studies.residual_words import residual_lines
from commission.studies.run import RunResult, judged_run
from tests.app.bench import Bench


@pytest.fixture
def bench(project: Project) -> Iterator[Bench[DiagnosisService]]:
    bench = Bench(DiagnosisService, project)
    yield bench
    bench.close()


def test_residuals_follow_the_run_while_they_are_wanted(
    bench: Bench[DiagnosisService], project: Project, result: RunResult
) -> None:
    bench.ask(RunShown(result))
    assert bench.found() is None
    bench.ask(ShowResiduals(wanted=True))
    found = bench.found()
    alone = residual_study(ResidualInput(run=result, floor_map=project.floor_map))
    assert found.study.counts.tolist() == alone.counts.tolist()
    text = residual_text(found, idle=False)
    for line in residual_lines(alone):
        assert line.replace("'", "&#x27;") in text
    assert text.count("<svg") == len(list(charts(alone))) > 8
    # A smaller sigma, and the words say so as soon as the run is there.
    parameters = with_field(project.parameters, "observation.range_sigma", 0.003, "parameter")
    smaller = LocalizerSetup(
        reflectors=project.reflectors, scanners=project.scanners, parameters=parameters, uncertainty=project.uncertainty
    )
    bench.ask(RunShown(judged_run(result.inputs.with_setup(smaller), earlier=result)))
    assert bench.view.outdated
    assert "Of the run before" in residual_text(bench.view, idle=False)
    again = bench.found()
    assert not again.outdated
    assert again.study.factors[0] > 2.0 * found.study.factors[0]
    assert "range sigma is" in residual_text(again, idle=False)
    assert "times too small" in residual_text(again, idle=False)
    bench.ask(ShowResiduals(wanted=False))
    assert bench.view is None


def test_without_a_run_it_says_that_there_is_none(bench: Bench[DiagnosisService]) -> None:
    bench.ask(ShowResiduals(wanted=True))
    assert bench.found() is None
    assert "No drive is shown that is over." in residual_text(None, idle=True)
