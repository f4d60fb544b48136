"""Files read and made in the background, by the worker that the page has."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from queue import Queue

import pytest

from commission.app.exchange import actions
from commission.app.exchange.actions import ExchangeAction
from commission.app.exchange.pending import ImportSource, Pasted, ServerFile, Upload
from commission.app.exchange.work import Exchanger
from commission.app.reduction import ExportProject, ReadFile, StopReading
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
    bench.worker.carry_out(ReadFile(3, 7, sources[way], WHOLE))
    answer = bench.answer()
    assert isinstance(answer, actions.ImportRead)
    assert (answer.client, answer.number) == (3, 7)
    assert isinstance(answer.imported, ReflectorImport)
    assert [r.id for r in answer.imported.reflectors.reflectors] == ["A"]


def test_file_that_cannot_be_read_is_answered_with_the_reason(bench: Bench) -> None:
    bench.worker.carry_out(ReadFile(3, 7, Upload("hall.csv", b"id,x,y,radius\nA,one,2,0.04\n"), WHOLE))
    text = "hall.csv: line 2, column x: is 'one'; expected a number [m]"
    assert bench.answer() == actions.ExchangeFailed(3, text, 7)


def test_what_was_stopped_is_not_answered(bench: Bench) -> None:
    rows = "".join(f"R{i},{i},0,0.04\n" for i in range(15_000)).encode()
    bench.worker.carry_out(ReadFile(3, 1, Upload("long.csv", b"id,x,y,radius\n" + rows), WHOLE))
    bench.worker.carry_out(StopReading(3))
    bench.worker.carry_out(ReadFile(3, 2, Upload("hall.csv", TABLE), WHOLE))
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
