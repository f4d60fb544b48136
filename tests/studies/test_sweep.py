"""Sweeps: each value is that of a run with it, in any number of threads; what cannot be swept is refused; cancel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from commission.errors import JobCancelled, UsageError
from commission.localization.setup import LocalizerSetup
from commission.studies.run import RunInput, judged_run, summary
from commission.studies.start import Start, StartOrigin
from commission.studies.sweep import SweepAxis, SweepInput, sweep, told
from commission.studies.workers import Threads
from tests.studies.recorded import PROJECT, drive, start

PARAMETERS = PROJECT.parameters


@pytest.fixture(scope="module")
def run() -> RunInput:
    return RunInput.of(PROJECT, drive(20.0), Start(start(), StartOrigin.GIVEN))


def axis(text: str) -> SweepAxis:
    return SweepAxis.parse(text, PARAMETERS)


def test_each_value_is_the_figure_of_a_run_with_it(run: RunInput) -> None:
    axes = (axis("association.gate_probability=0.5..0.98:3"), axis("observation.range_sigma=0.01..0.02:2"))
    result = sweep(SweepInput(run=run, axes=axes, figure="nis_before_gate_mean"))
    assert result.values.shape == (3, 2)
    for place in np.ndindex(3, 2):
        parameters = replace(
            PARAMETERS,
            association=replace(PARAMETERS.association, gate_probability=(0.5, 0.74, 0.98)[place[0]]),
            observation=replace(PARAMETERS.observation, range_sigma=(0.01, 0.02)[place[1]]),
        )
        alone = judged_run(replace(run).with_setup(LocalizerSetup.of(replace(PROJECT, parameters=parameters))))
        assert result.values[place] == pytest.approx(summary(alone)["nis_before_gate_mean"], rel=1e-12)
    assert result.operating == (PARAMETERS.association.gate_probability, PARAMETERS.observation.range_sigma)
    assert result.at_operating == summary(judged_run(run))["nis_before_gate_mean"]
    # A wider sigma is a smaller NIS.
    assert (result.values[:, 1] < result.values[:, 0]).all()


def test_threads_change_nothing(run: RunInput) -> None:
    inputs = SweepInput(run=run, axes=(axis("association.gate_probability=0.99..0.5:7"),), figure="rejected_fraction")
    one, four = (sweep(inputs, workers=Threads(count)).values for count in (1, 4))
    assert np.array_equal(one, four)
    assert (np.diff(one) > 0.0).all()


def test_a_sweep_that_is_cancelled_begins_no_further_run(run: RunInput) -> None:
    calls: list[float] = []

    def progress(fraction: float, _message: str, /) -> None:
        calls.append(fraction)
        if len(calls) == 4:
            raise JobCancelled

    inputs = SweepInput(run=run, axes=(axis("association.gate_probability=0.5..0.9:200"),), figure="rejected_fraction")
    with pytest.raises(JobCancelled):
        sweep(inputs, progress, workers=Threads(2))
    assert len(calls) == 4
    assert calls == sorted(calls)


def test_progress_goes_to_its_end(run: RunInput) -> None:
    calls: list[float] = []
    inputs = SweepInput(run=run, axes=(axis("association.gate_probability=0.5..0.9:3"),), figure="rejected_fraction")
    sweep(inputs, lambda fraction, _message: calls.append(fraction))
    assert calls[0] == 0.0
    assert calls[-1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("association.gate_probability", "expected group.key=FROM..TO:N"),
        ("association.gate_probability=0.5:3", "expected group.key=FROM..TO:N"),
        ("association.gate_probability=0.5..nan:3", "expected group.key=FROM..TO:N"),
        ("association.gate_probability=0.5..0.9:1", "asks for 1 values; expected 2 to 1000"),
        ("association.gate_probability=0.5..0.9:1001", "asks for 1001 values"),
        ("association.gate_probability=0.5..0.5:3", "expected 2 to 1000 different ones"),
        ("association.gate_probability=0.5..1.5:3", "expected"),
        ("association.enabled=0..1:2", "is no number"),
        ("association.gat=0..1:2", "association"),
    ],
)
def test_what_is_no_range_of_a_parameter_is_refused(text: str, problem: str) -> None:
    with pytest.raises(UsageError, match=problem):
        axis(text)


def test_two_different_parameters_and_a_known_figure_are_expected(run: RunInput) -> None:
    gate = axis("association.gate_probability=0.5..0.9:3")
    with pytest.raises(UsageError, match="expected one parameter or two different ones"):
        SweepInput(run=run, axes=(gate, gate), figure="rejected_fraction")
    with pytest.raises(UsageError, match="figure 'nis' is unknown; expected one of operational_fraction"):
        SweepInput(run=run, axes=(gate,), figure="nis")


def test_a_figure_of_errors_needs_a_reference(run: RunInput) -> None:
    log = replace(run.log, reference_stamps_ns=np.empty(0, np.int64), reference_poses=np.empty((0, 3)))
    gate = axis("association.gate_probability=0.5..0.9:3")
    with pytest.raises(UsageError, match="needs a reference, and the recording has none"):
        sweep(SweepInput(run=replace(run, log=log), axes=(gate,), figure="position_rmse_m"))


def test_a_person_is_told_the_least_and_the_largest(run: RunInput) -> None:
    inputs = SweepInput(run=run, axes=(axis("association.gate_probability=0.5..0.9:3"),), figure="rejected_fraction")
    result = sweep(inputs)
    lines = told(result)
    assert lines[0] == "Sweep        3 runs over association.gate_probability"
    assert lines[1].startswith("Project      Rejected by the gate")
    assert lines[2].endswith("at association.gate_probability = 0.9")
    assert lines[3] == f"Largest      {100.0 * result.values[0]:.2f} % at association.gate_probability = 0.5"
