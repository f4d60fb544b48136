"""Files read and made in the background, by the service that the page has."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from commission.app.base.actions import Action, Envelope, Sender
from commission.app.base.effects import Effect
from commission.app.base.state import AppState
from commission.app.base.uploads import Upload
from commission.app.exchange import actions
from commission.app.exchange.effects import ExportProject, ReadFile, StopReading
from commission.app.exchange.pending import Exchange, ImportSource, Pasted, ServerFile
from commission.app.exchange.words import notes
from commission.app.exchange.work import ExchangeService
from commission.io.exports import Format
from commission.io.imk import ReflectorImport
from commission.io.imports import WHOLE
from commission.site.project import Project
from tests.app.asking import after, joined
from tests.app.owning import Owner
from tests.app.sites import room

ASKING = Sender(3)
STATE = joined(AppState(project=room(), saved=room()), 3)
TABLE = b"id,x,y,radius\nA,1,2,0.04\n"


class Bench(Owner[ExchangeService]):
    """The service, asked by one browser; its answers can be waited for."""

    def __init__(self) -> None:
        super().__init__(ExchangeService, STATE)

    def do(self, effect: Effect) -> None:
        self.service.carry_out(effect, STATE, ASKING)

    def answer(self) -> Action:
        """Return the next answer that is not about progress."""
        while True:
            while not self.posted:
                self.hear()
            answer = self.posted.pop(0)
            assert isinstance(answer, Envelope)
            assert answer.sender is ASKING
            if not isinstance(answer.action, actions.ExchangeProgressed):
                return answer.action


@pytest.fixture
def bench() -> Iterator[Bench]:
    opened = Bench()
    yield opened
    opened.close()


@pytest.mark.parametrize("way", ["upload", "server", "paste"])
def test_reflectors_are_read_whichever_way_they_come(bench: Bench, tmp_path: Path, way: str) -> None:
    (tmp_path / "hall.csv").write_bytes(TABLE)
    sources: dict[str, ImportSource] = {
        "upload": Upload("hall.csv", TABLE),
        "server": ServerFile(tmp_path / "hall.csv"),
        "paste": Pasted(TABLE.decode()),
    }
    bench.do(ReadFile(7, sources[way], WHOLE, room()))
    answer = bench.answer()
    assert isinstance(answer, actions.ImportRead)
    assert answer.number == 7
    assert isinstance(answer.imported, ReflectorImport)
    assert [r.id for r in answer.imported.reflectors.reflectors] == ["A"]


def test_file_that_cannot_be_read_is_answered_with_the_reason(bench: Bench) -> None:
    bench.do(ReadFile(7, Upload("hall.csv", b"id,x,y,radius\nA,one,2,0.04\n"), WHOLE, room()))
    text = "hall.csv: line 2, column x: is 'one'; expected a number [m]"
    assert bench.answer() == actions.ExchangeFailed(text, 7)


def test_what_was_stopped_is_not_answered(bench: Bench) -> None:
    rows = "".join(f"R{i},{i},0,0.04\n" for i in range(15_000)).encode()
    bench.do(ReadFile(1, Upload("long.csv", b"id,x,y,radius\n" + rows), WHOLE, room()))
    bench.do(StopReading())
    bench.do(ReadFile(2, Upload("hall.csv", TABLE), WHOLE, room()))
    answer = bench.answer()
    assert isinstance(answer, actions.ImportRead)
    assert answer.number == 2


def test_file_is_made_for_the_browser_that_asked(bench: Bench) -> None:
    bench.do(ExportProject(Format.TABLE, room()))
    answer = bench.answer()
    assert isinstance(answer, actions.FileMade)
    assert answer.file.name == "Room_reflectors.csv"
    bench.do(ExportProject(Format.IMK, Project()))
    assert bench.answer() == actions.ExchangeFailed("there are no reflectors to write; expected one or more")


def test_every_official_layout_goes_all_the_way_into_the_project(bench: Bench, shared_data: Path) -> None:
    for path in sorted((shared_data / "layouts" / "lif" / "examples").glob("*.json")):
        asked = after(STATE, actions.ReadImport(Upload(path.name, path.read_bytes())), browser=3)
        (effect,) = asked.effects
        assert isinstance(effect, ReadFile)
        bench.do(effect)
        answer = bench.answer()
        assert isinstance(answer, actions.ImportRead), answer
        looking = after(asked.state, answer, browser=3).state
        pending = looking.of_browser(3, Exchange).pending
        assert pending is not None
        assert "<li>" in notes(pending.imported.warnings)
        accepted = after(looking, actions.AcceptImport(), browser=3).state
        # Example 00 is a template with words in place of numbers.
        assert (len(accepted.project.routes) > 1) is (path.name != "00.json")
