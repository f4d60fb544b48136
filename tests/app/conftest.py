from collections.abc import Callable

import pytest

from commission.app.run.actions import VirtualDrive
from commission.app.run.drives import Drive, prepare
from commission.progress import silent
from commission.site.project import Project
from commission.studies.run import RunInput, RunResult, judged_run
from tests.app.sites import room


@pytest.fixture(scope="session")
def project() -> Project:
    return room()


@pytest.fixture(scope="session")
def drive(project: Project) -> Drive:
    return prepare(project, VirtualDrive(project.routes[0].name, seed=1), silent)


@pytest.fixture(scope="session")
def result(project: Project, drive: Drive) -> RunResult:
    """The drive, localized with the project as it is."""
    return judged_run(RunInput.of(project, drive.log, drive.start))


class Clock:
    """A clock that a test moves."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Callable[[], float]:
    return Clock()
