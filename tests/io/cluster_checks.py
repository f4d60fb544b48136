"""A real scheduler with two workers on loopback: bit by bit as local, also when one is killed; clear errors.

`test_cluster.py` runs these in a process of their own.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from commission.errors import UsageError
from commission.io import cluster as cluster_module
from commission.io.cluster import cluster
from commission.simulation.random_faults import FaultRates
from commission.studies.calibration_drives import calibrate_drives
from commission.studies.calibration_values import CalibrationInput
from commission.studies.monte_carlo import monte_carlo
from commission.studies.monte_carlo_figures import MonteCarloInput, MonteCarloResult
from commission.studies.run import RunInput
from commission.studies.start import Start, StartOrigin
from commission.studies.sweep import SweepAxis, SweepInput, sweep
from tests.conftest import REPOSITORY
from tests.simulation.halls import hall
from tests.studies.recorded import PROJECT, drive, start

pytest.importorskip("distributed", reason="the extra commission[cluster] is not installed")

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:distributed")

OPTIONS = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
"""Of each worker."""
INPUTS = MonteCarloInput(project=hall(), routes=("Out and back",), runs=10, seed=3, rates=FaultRates())

SWEPT = SweepInput(
    run=RunInput.of(PROJECT, drive(10.0), Start(start(), StartOrigin.GIVEN)),
    axes=(SweepAxis.parse("association.gate_probability=0.5..0.99:5", PROJECT.parameters),),
    figure="rejected_fraction",
)


def started(*words: str) -> subprocess.Popen[str]:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    return subprocess.Popen(
        [sys.executable, "-m", "distributed.cli." + words[0], *words[1:]],
        cwd=REPOSITORY,
        env={**environment, "PYTHONPATH": str(REPOSITORY)},
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )


def address_in(process: subprocess.Popen[str]) -> str:
    assert process.stderr is not None
    for line in process.stderr:
        if found := re.search(r"Scheduler at:\s+(tcp://\S+)", line):
            return found[1]
    raise AssertionError("the scheduler did not start")


@contextmanager
def two_workers() -> Generator[tuple[str, list[subprocess.Popen[str]]]]:
    boss = started("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    workers: list[subprocess.Popen[str]] = []
    try:
        address = address_in(boss)
        workers += [started("dask_worker", address, *OPTIONS) for _ in range(2)]
        deadline = time.monotonic() + 60.0
        while time.monotonic() < deadline:
            try:
                with cluster(address) as found:
                    if found.count == 2:
                        break
            except UsageError:
                time.sleep(0.2)
        yield address, workers
    finally:
        for process in (*workers, boss):
            process.kill()
            process.communicate()


@pytest.fixture(scope="module")
def scheduler() -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    with two_workers() as found:
        yield found


def same(one: MonteCarloResult, other: MonteCarloResult) -> bool:
    pairs = list(zip(one.drives, other.drives, strict=True))
    return all(
        (a.number, a.seed, a.position_rmse, a.anees, a.operational_fraction, a.longest_fail)
        == (b.number, b.seed, b.position_rmse, b.anees, b.operational_fraction, b.longest_fail)
        for a, b in pairs
    ) and np.array_equal(one.counts.errors, other.counts.errors)


def test_a_cluster_gives_the_same_result_also_when_a_worker_is_killed(
    scheduler: tuple[str, list[subprocess.Popen[str]]],
) -> None:
    address, workers = scheduler
    local = monte_carlo(INPUTS)
    with cluster(address) as found:
        assert found.count == 2
        assert same(monte_carlo(INPUTS, workers=found), local)
        assert np.array_equal(sweep(SWEPT, workers=found).values, sweep(SWEPT).values)

        def kill_one(_fraction: float, message: str, /) -> None:
            if message.startswith("2 of"):
                workers[0].send_signal(signal.SIGKILL)

        assert same(monte_carlo(INPUTS, kill_one, workers=found), local)
    assert workers[0].wait(10.0) == -signal.SIGKILL
    assert workers[1].poll() is None


def test_many_drives_are_calibrated_as_here_also_when_a_worker_is_killed() -> None:
    def drives() -> Iterator[tuple[str, CalibrationInput]]:
        for seed in range(1, 6):
            log = drive(20.0, bias=0.03, seed=seed)
            yield f"drive {seed}", CalibrationInput.of(PROJECT, log, Start(start(), StartOrigin.GIVEN))

    local = calibrate_drives(drives(), 5)
    told: list[str] = []
    with two_workers() as (address, workers), cluster(address) as found:
        assert found.count == 2

        def kill_one(_fraction: float, message: str, /) -> None:
            told.append(message)
            if message.startswith("1 of"):
                workers[0].send_signal(signal.SIGKILL)

        there = calibrate_drives(drives(), 5, kill_one, workers=found)
        assert workers[0].wait(10.0) == -signal.SIGKILL
        assert workers[1].poll() is None
    assert told[-1] == "5 of 5 drives"
    assert [each.name for each in there.inputs.drives] == [f"drive {seed}" for seed in range(1, 6)]
    assert [each.values for each in there.inputs.drives] == [each.values for each in local.inputs.drives]
    assert (there.values, there.notes) == (local.values, local.notes)
    bias = next(each for each in there.proposed if each.key == "observation.range_bias")
    assert abs(bias.proposed - 0.03) < 0.001


def test_another_version_on_a_worker_is_refused(
    scheduler: tuple[str, list[subprocess.Popen[str]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module.commission, "__version__", "99.0")
    with (
        pytest.raises(UsageError, match=r"has version \S+ of this package; expected 99.0, as here"),
        cluster(scheduler[0]),
    ):
        pass


def test_a_scheduler_that_nobody_is_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "PATIENCE", 0.5)
    with (
        pytest.raises(UsageError, match=r"--scheduler tcp://127\.0\.0\.1:9 does not answer"),
        cluster("tcp://127.0.0.1:9"),
    ):
        pass


def test_without_the_extra_its_name_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(UsageError, match=r'expected the extra: pip install "commission\[cluster\]"'),
        cluster("tcp://a:1"),
    ):
        pass
