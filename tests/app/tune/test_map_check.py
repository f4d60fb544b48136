"""The map against the drive on the page: what is found, ticked and corrected, and what is never touched in silence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from commission.app.base.actions import Undo
from commission.app.base.shown_run import RunShown
from commission.app.run.actions import VirtualDrive
from commission.app.run.drives import prepare
from commission.app.tune.map_check import CheckMap, CorrectMap, TickFinding
from commission.app.tune.map_check_panel import changes_text, evidence_text, summary_text
from commission.app.tune.map_check_service import MapCheckService, MapCheckView
from commission.errors import UsageError
from commission.progress import silent
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.studies.map_findings import MapFault
from commission.studies.run import RunInput, RunResult, judged_run
from tests.app.bench import Bench
from tests.app.sites import room


@pytest.fixture(scope="module")
def project() -> Project:
    """A room with more reflectors: among four, a drive cannot tell one that was moved from one that is gone."""
    site = room()
    more = (Reflector(id="R5", x=3.0, y=7.75), Reflector(id="R6", x=8.0, y=0.25), Reflector(id="R7", x=0.25, y=4.0))
    return replace(site, reflectors=ReflectorMap((*site.reflectors.reflectors, *more)))


@pytest.fixture(scope="module")
def changed(project: Project) -> RunResult:
    """A drive in a room whose R1 stands 6 cm farther east than the map says, whose R3 is gone, and where one is new."""
    first, second, _, *others = project.reflectors.reflectors
    standing = (replace(first, x=first.x + 0.06), second, *others, Reflector(id="added", x=6.0, y=7.75))
    hall = replace(project, reflectors=ReflectorMap(standing))
    drive = prepare(hall, VirtualDrive(project.routes[0].name, seed=1), silent)
    return judged_run(RunInput.of(project, drive.log, drive.start))


@pytest.fixture(scope="module")
def found(project: Project, changed: RunResult) -> Iterator[Bench[MapCheckService]]:
    bench = Bench(MapCheckService, project)
    bench.ask(RunShown(changed), CheckMap())
    bench.found()
    yield bench
    bench.close()


@pytest.fixture
def bench(found: Bench[MapCheckService], project: Project) -> Iterator[Bench[MapCheckService]]:
    """What was found, with the project as it was; what a test does to it is forgotten."""
    kept = found.state
    yield found
    found.state = kept
    found.service.follow(kept)


def seen(bench: Bench[MapCheckService]) -> dict[str, MapFault]:
    return {line.finding.id: line.finding.fault for line in bench.view.lines}


def place(bench: Bench[MapCheckService], name: str) -> tuple[float, float]:
    return next((each.x, each.y) for each in bench.state.project.reflectors.reflectors if each.id == name)


def with_r1(bench: Bench[MapCheckService], **more: object) -> MapCheckView:
    """The same findings over a map whose R1 is another one."""
    first, *others = bench.state.project.reflectors.reflectors
    bench.edit(replace(bench.state.project, reflectors=ReflectorMap((replace(first, **more), *others))))
    return bench.view


def test_what_has_changed_is_ticked_but_not_what_may_be_a_shiny_column(bench: Bench[MapCheckService]) -> None:
    assert seen(bench) == {"R1": MapFault.MOVED, "R3": MapFault.MISSING, "new-1": MapFault.NEW}
    assert {line.finding.id for line in bench.view.lines if line.is_ticked} == {"R1", "R3"}
    moved, missing, new = (evidence_text(line) for line in bench.view.lines)
    assert "R1 has moved by" in moved
    assert "-0 mm" not in moved
    assert "scans" in moved
    assert "R3 is missing: seen in" in missing
    assert "since this drive" in new
    assert "3 findings." in summary_text(bench.view)
    told = changes_text(bench.view.ticked)
    assert "<td>R1</td><td>0.250, 2.000</td><td>0.30" in told
    assert "<td>R3</td><td>11.750, 1.500</td><td>gone</td>" in told
    bench.ask(TickFinding("R1", wanted=False), TickFinding("new-1", wanted=True))
    assert {each.id for each in bench.view.ticked} == {"R3", "new-1"}


def test_all_that_is_ticked_is_corrected_in_one_step_that_is_undone_at_once(bench: Bench[MapCheckService]) -> None:
    before = bench.state.project
    bench.ask(TickFinding("new-1", wanted=True))
    bench.ask(CorrectMap(bench.view.ticked))
    assert place(bench, "R1") == pytest.approx((0.31, 2.0), abs=0.01)
    assert place(bench, "new-1") == pytest.approx((6.0, 7.75), abs=0.05)
    assert [each.id for each in bench.state.project.reflectors.reflectors] == [
        *("R1", "R2", "R4", "R5", "R6", "R7", "new-1")
    ]
    # By now there is nothing left of it to be corrected.
    assert bench.view.ticked == ()
    assert all(line.why_not for line in bench.view.lines)
    bench.ask(Undo())
    assert bench.state.project == before
    assert {each.id for each in bench.view.ticked} == {"R1", "R3", "new-1"}


def test_a_locked_reflector_is_named_and_stays(bench: Bench[MapCheckService]) -> None:
    ticked = bench.view.ticked
    view = with_r1(bench, locked=True)
    assert {each.id for each in view.ticked} == {"R3"}
    assert "It is locked and stays: unlock it first." in evidence_text(view.lines[0])
    before = bench.state.project
    with pytest.raises(UsageError, match="R1: it is locked and stays: unlock it first; the map stays as it is"):
        bench.ask(CorrectMap(ticked))
    assert bench.state.project is before


def test_a_reflector_that_was_edited_since_is_not_moved_to_where_it_was_found(bench: Bench[MapCheckService]) -> None:
    ticked = bench.view.ticked
    view = with_r1(bench, y=2.5)
    assert "The map has it elsewhere by now: check again." in evidence_text(view.lines[0])
    with pytest.raises(UsageError, match="R1: the map has it elsewhere by now"):
        bench.ask(CorrectMap(ticked))
    assert place(bench, "R1") == (0.25, 2.5)


def test_nothing_ticked_or_no_drive_is_refused_and_findings_are_dropped(bench: Bench[MapCheckService]) -> None:
    with pytest.raises(UsageError, match="nothing is ticked"):
        bench.ask(CorrectMap(()))
    bench.ask(RunShown(None))
    assert not bench.view.is_of_drive
    assert "Another drive is shown by now" in summary_text(bench.view)
    with pytest.raises(UsageError, match="no drive is shown"):
        bench.ask(CheckMap())
