"""Variants on the page: which letters are kept, what is listed, drawn and localized again over another drive."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from commission.app.base.carrier import as_text
from commission.app.base.jobs import Jobs
from commission.app.base.service import Context
from commission.app.base.state import AppState
from commission.app.run.asked import action_of
from commission.app.run.charts import CHARTS, color_of
from commission.app.run.drawn_curves import drawn, values_at
from commission.app.run.variant_actions import DropRun, DropVariant, KeepRun, KeepVariant, UseVariant
from commission.app.run.variant_reducer import LETTERS, VariantsState
from commission.app.run.variant_runs import VariantRuns
from commission.app.run.variant_table import variants_message
from commission.app.run.view import KeptRun
from commission.app.tune.actions import SetParameter
from commission.errors import UsageError
from commission.localization.setup import LocalizerSetup
from commission.site.project import Project
from commission.studies.run import RunResult, judged_run
from commission.studies.variant_settings import differing_settings
from commission.studies.variants import VariantsInput, variants
from tests.app.asking import after


@pytest.fixture(scope="module")
def narrow(project: Project, result: RunResult) -> RunResult:
    parameters = replace(
        project.parameters, association=replace(project.parameters.association, gate_probability=0.5, enabled=True)
    )
    setup = LocalizerSetup.of(replace(project, parameters=parameters))
    return judged_run(result.inputs.with_setup(setup), earlier=result)


@pytest.fixture
def state(project: Project) -> AppState:
    return AppState(project=project, saved=project)


def test_variants_take_the_first_free_letter_and_a_fourth_is_refused(state: AppState) -> None:
    for letter in LETTERS:
        outcome = after(state, KeepVariant())
        assert outcome.effects == (KeepRun(letter),)
        state = outcome.state
    with pytest.raises(UsageError, match="A, B, C are kept already"):
        after(state, KeepVariant())
    outcome = after(state, DropVariant("B"))
    assert outcome.effects == (DropRun("B"),)
    state = outcome.state
    outcome = after(state, KeepVariant())
    assert outcome.effects == (KeepRun("B"),)
    state = outcome.state
    assert [each.letter for each in state.part(VariantsState).kept] == ["A", "B", "C"]
    with pytest.raises(UsageError, match="no variant is called 'D'; kept: A, B, C"):
        after(state, UseVariant("D"))


def test_parameters_of_a_variant_come_back_in_one_undo_step(state: AppState) -> None:
    before = state.project
    state = after(state, KeepVariant()).state
    state = after(state, SetParameter("association.gate_probability", 0.6)).state
    steps = len(state.undo)
    state = after(state, UseVariant("A")).state
    assert state.project.parameters == before.parameters
    assert len(state.undo) == steps + 1
    assert state.undo[-1].name == "use variant A"
    again = after(state, UseVariant("A")).state
    assert again is state


@pytest.mark.parametrize(
    ("text", "action"),
    [
        ('{"do":"keep","n":1}', KeepVariant()),
        ('{"do":"use","n":2,"letter":"B"}', UseVariant("B")),
        ('{"do":"drop","n":3,"letter":"C"}', DropVariant("C")),
    ],
)
def test_the_script_asks_for_variants(text: str, action: object) -> None:
    assert action_of(text) == action


def test_the_list_has_settings_figures_marks_and_moments(
    state: AppState, project: Project, result: RunResult, narrow: RunResult
) -> None:
    state = after(state, KeepVariant()).state
    compared = variants(VariantsInput(names=("Now", "A"), runs=(narrow, result)))
    message = json.loads(as_text(variants_message(compared, state.part(VariantsState))))
    assert message["names"] == ["Now", "A"]
    assert message["colors"] == ["", color_of("A")]
    assert message["settings"] == [["association.gate_probability", "Gate", ["50 %", "95 %"]]]
    listed = {label: cells for label, cells in message["figures"]}
    assert listed["NIS of all near a reflector"][0][2] == "2.00"
    assert listed["Rejected by the gate"][0][0] == f"{100.0 * narrow.consistency.rejected_fraction:.2f} %"
    assert message["moments"] == [[pytest.approx(each.time, abs=1e-4), str(each)] for each in compared.moments]
    # What is forgotten is not listed until the others are compared.
    state = after(state, DropVariant("A")).state
    assert variants_message(compared, state.part(VariantsState))["names"] == []


def test_settings_that_differ_are_told_and_no_others(result: RunResult, narrow: RunResult) -> None:
    assert differing_settings([result, result]) == ()
    (told,) = differing_settings([result, narrow])
    assert (told.key, told.texts) == ("association.gate_probability", ("95 %", "50 %"))


def test_plots_lay_a_curve_of_each_variant_over_their_own(result: RunResult, narrow: RunResult) -> None:
    kept = (KeptRun("B", narrow),)
    message = drawn(result, CHARTS, (0.0, result.duration), kept)
    plain = drawn(result, CHARTS, (0.0, result.duration))
    other = drawn(narrow, CHARTS, (0.0, result.duration))
    for chart, sent, alone, its in zip(CHARTS, message["charts"], plain["charts"], other["charts"], strict=True):
        *own, line = sent["lines"]
        assert own == alone["lines"]
        assert (line["label"], line["color"], line["variant"]) == ("B", color_of("B"), True)
        assert line["low"] == its["lines"][chart.lines.index(chart.compared)]["low"]
    values = values_at(result, CHARTS, 20, kept)
    assert [len(each) for each in values] == [len(chart.lines_of(result)) + 1 for chart in CHARTS]
    two_sigma = values[0][-1]
    assert two_sigma is not None
    assert two_sigma[0] == pytest.approx(1000.0 * narrow.position_two_sigma[20])


def done_at_once(monkeypatch: pytest.MonkeyPatch) -> Jobs:
    """Jobs that are done when they are started."""
    jobs = Jobs(lambda _report: None)

    def start(_name: str, work: Callable[..., object], *, then: Callable[..., object], **_: object) -> None:
        then(work(lambda *_: None))

    monkeypatch.setattr(jobs, "start", start)
    return jobs


def test_variants_follow_onto_another_drive(
    state: AppState, result: RunResult, narrow: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = after(state, KeepVariant()).state
    runs = VariantRuns(Context(state, lambda _: None, lambda: 0.0, done_at_once(monkeypatch)))
    runs.take(result)
    runs.keep("A", result.inputs, state)
    assert runs.kept[0].run is result
    runs.take(narrow)
    assert runs.compared is not None
    assert runs.compared.inputs.runs == (narrow, result)
    # The same records as another drive: the variant is localized over them with its own gate.
    log = replace(result.inputs.log)
    other = judged_run(replace(narrow.inputs, log=log))
    # As long as that is not known, nothing of another drive is laid over it: a vehicle may still be driving it.
    assert runs.kept_over(other) == ()
    assert runs.compared_over(other) is None
    runs.take(other)
    assert runs.compared_over(other) is runs.compared
    (kept,) = runs.kept
    assert kept.run.inputs.log is log
    assert kept.run.consistency.rejected_fraction == result.consistency.rejected_fraction
    assert not math.isclose(kept.run.consistency.rejected_fraction, narrow.consistency.rejected_fraction)
    runs.drop("A", state)
    assert runs.kept == ()
    assert runs.compared is None


def test_a_run_that_is_not_there_yet_is_kept_as_it_will_be(
    state: AppState, result: RunResult, narrow: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = VariantRuns(Context(state, lambda _: None, lambda: 0.0, done_at_once(monkeypatch)))
    runs.take(result)
    state = after(state, KeepVariant()).state
    runs.keep("A", narrow.inputs, state)
    (kept,) = runs.kept
    assert kept.run.consistency.rejected_fraction == narrow.consistency.rejected_fraction
