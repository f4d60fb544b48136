"""Fixtures that every room's tests may ask for."""

from __future__ import annotations

import functools
import os
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# The first example of a property may compile a kernel, and the machine is shared: time is pytest-timeout's business.
settings.register_profile("project", deadline=None)
settings.load_profile("project")

REPOSITORY = Path(__file__).resolve().parents[1]

LONGEST_WITH_ALL_SEEDS_S = 3600.0
"""Time for one test with all its seeds [s]."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the one option of the project's own."""
    parser.addoption(
        "--acceptance",
        action="store_true",
        help="run the tests that take seeds with all of them, instead of a few; and only these, unless paths are given",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Leave the other tests out when all seeds are asked for."""
    if config.getoption("acceptance") and config.args_source is pytest.Config.ArgsSource.TESTPATHS:
        config.args = files_with_seeds()


def few_of(all_of: Sequence[Any], few: Collection[Any]) -> list[Any]:
    """Parameters of a test that runs with those of `few` alone in the test command, and with all of them else."""
    return [
        each if each in few else pytest.param(*_together(each), marks=pytest.mark.with_all_seeds) for each in all_of
    ]


def _together(parameters: Any) -> tuple[Any, ...]:
    return parameters if isinstance(parameters, tuple) else (parameters,)


def files_with_seeds() -> list[str]:
    """The acceptance tests, and other files with tests that are left out or shortened in the test command."""
    words = ("with_all_seeds", "few_of(", "seeds: Seeds")
    others = sorted(file for file in (REPOSITORY / "tests").rglob("test_*.py") if file.parent.name != "acceptance")
    chosen = [file for file in others if any(word in file.read_text(encoding="utf-8") for word in words)]
    return [str(file) for file in (REPOSITORY / "tests" / "acceptance", *chosen)]


@dataclass(frozen=True, slots=True)
class Seeds:
    """Which virtual drives (or random cases) stand for all."""

    all: bool
    """Whether every seed is run. If not, a bound on a mean is wider by what the drives that are run scatter."""

    def __call__(self, few: int, total: int) -> range:
        """Return the first seeds, or all of them."""
        return range(total if self.all else few)


@pytest.fixture(scope="session")
def seeds(request: pytest.FixtureRequest) -> Seeds:
    """A few seeds of a test in the test command, all of them with `--acceptance`, before a figure is claimed."""
    return Seeds(request.config.getoption("acceptance"))


LONGEST_FIRST = ("tests/browser", "tests/acceptance", "tests/planning")
"""Among several workers these begin, so that none waits for another one at the end."""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let the longest begin, and give tests with all their seeds the time they need."""
    if config.getoption("acceptance"):
        for item in items:
            item.add_marker(pytest.mark.timeout(LONGEST_WITH_ALL_SEEDS_S))
    else:
        left_out = [item for item in items if item.get_closest_marker("with_all_seeds")]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: not item.path.relative_to(REPOSITORY).as_posix().startswith(LONGEST_FIRST))


def run_together(nodeid: str) -> str:
    """Name what one of several workers runs one after the other: the tests of a file, which share what they prepare.

    The tests in a browser share one worker with the files in which time is measured: a browser without a graphics card
    takes the cores that a measured test counts on, and beside a second one it does not draw in the time that a person
    would wait.
    """
    file = nodeid.partition("::")[0]
    return "browser" if file.startswith("tests/browser/") or _measures_time(file) else file


@functools.cache
def _measures_time(file: str) -> bool:
    return "@pytest.mark.measures_time" in (REPOSITORY / file).read_text(encoding="utf-8")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Share the tests among workers by `run_together`.

    The marks `xdist_group` would say it beside each test, but pytest-xdist 3.8 writes them into a part of the item that
    pytest 9 does not read any more: then each test goes to any worker, and the preparations of a file are made twice.
    """
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            return run_together(nodeid)

    return Scheduling(config, log)


@pytest.fixture(scope="session")
def repository() -> Path:
    """Root of the checkout that is being tested."""
    return REPOSITORY


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Recordings, maps and layouts of others that lie beside the checkout and are not part of it."""
    folder = REPOSITORY.parent / "shared" / "data"
    if not folder.is_dir():
        reason = f"{folder} is absent: it holds real recordings that the project does not contain"
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
    return folder
