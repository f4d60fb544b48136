"""Files read and made in the background, by the worker that the page has."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from queue import Queue

import pytest

from commission.app.base import reducer
from commission.app.base.reduction import ExportProject, ReadFile, StopReading
from commission.app.base.state import AppState
from commission.app.base.uploads import Upload
from commission.app.editing.editor import Editor
from commission.app.exchange import actions
from commission.app.exchange.actions import ExchangeAction
from commission.app.exchange.pending import ImportSource, Pasted, ServerFile
from commission.app.exchange.words import notes
from commission.app.exchange.work import Exchanger
from commission.io.exports import Format
from commission.io.imk import ReflectorImport
from commission.io.imports import WHOLE
from commission.site.project import Project
from tests.app.sites import room

TABLE = b"id,x,y,radius\nA,1,2,0.04\n"


class Bench:
    """A worker whose answers can be waited for."""

    def __init__(self) -> None:
        self._answers: Queue[ExchangeAction] = Queue()
        self.worker = Exchanger(self._answers.put)

    def answer(self) -> ExchangeAction:
        """Return the next answer that is not about progress."""
        while isinstance(answer := self._answers.get(timeout=20), actions.ExchangeProgressed):
            pass
        return answer


@pytest.fixture
def bench() -> Iterator[Bench]:
    opened = Bench()
    yield opened
    opened.worker.close()


@pytest.mark.parametrize("way", ["upload", "server", "paste"])
def test_reflectors_are_read_whichever_way_they_come(bench: Bench, tmp_path: Path, way: str) -> None:
    (tmp_path / "hall.csv").write_bytes(TABLE)
    sources: dict[str, ImportSource] = {
        "upload": Upload("hall.csv", TABLE),
        "server": ServerFile(tmp_path / "hall.csv"),
        "paste": Pasted(TABLE.decode()),
    }
    bench.worker.carry_out(ReadFile(3, 7, sources[way], WHOLE, room()))
    answer = bench.answer()
    assert isinstance(answer, actions.ImportRead)
    assert (answer.client, answer.number) == (3, 7)
    assert isinstance(answer.imported, ReflectorImport)
    assert [r.id for r in answer.imported.reflectors.reflectors] == ["A"]


def test_file_that_cannot_be_read_is_answered_with_the_reason(bench: Bench) -> None:
    bench.worker.carry_out(ReadFile(3, 7, Upload("hall.csv", b"id,x,y,radius\nA,one,2,0.04\n"), WHOLE, room()))
    text = "hall.csv: line 2, column x: is 'one'; expected a number [m]"
    assert bench.answer() == actions.ExchangeFailed(3, text, 7)


def test_what_was_stopped_is_not_answered(bench: Bench) -> None:
    rows = "".join(f"R{i},{i},0,0.04\n" for i in range(15_000)).encode()
    bench.worker.carry_out(ReadFile(3, 1, Upload("long.csv", b"id,x,y,radius\n" + rows), WHOLE, room()))
    bench.worker.carry_out(StopReading(3))
    bench.worker.carry_out(ReadFile(3, 2, Upload("hall.csv", TABLE), WHOLE, room()))
    answer = bench.answer()
    assert isinstance(answer, actions.ImportRead)
    assert answer.number == 2


def test_file_is_made_for_the_browser_that_asked(bench: Bench) -> None:
    bench.worker.carry_out(ExportProject(3, Format.TABLE, room()))
    answer = bench.answer()
    assert isinstance(answer, actions.FileMade)
    assert (answer.client, answer.file.name) == (3, "Room_reflectors.csv")
    bench.worker.carry_out(ExportProject(3, Format.IMK, Project()))
    assert bench.answer() == actions.ExchangeFailed(3, "there are no reflectors to write; expected one or more")


def test_every_official_layout_goes_all_the_way_into_the_project(bench: Bench, shared_data: Path) -> None:
    for path in sorted((shared_data / "layouts" / "lif" / "examples").glob("*.json")):
        state = AppState(room(), room(), editors={3: Editor()})
        asked = reducer.reduce(actions.ReadImport(3, Upload(path.name, path.read_bytes())), state)
        (effect,) = asked.effects
        assert isinstance(effect, ReadFile)
        bench.worker.carry_out(effect)
        answer = bench.answer()
        assert isinstance(answer, actions.ImportRead), answer
        looking = reducer.reduce(answer, asked.state).state
        pending = looking.editors[3].exchange.pending
        assert pending is not None
        assert "<li>" in notes(pending.imported.warnings)
        accepted = reducer.reduce(actions.AcceptImport(3), looking).state
        # Example 00 is a template with words in place of numbers.
        assert (len(accepted.project.routes) > 1) is (path.name != "00.json")
