"""What reaches the terminal and the log file."""

from __future__ import annotations

import io
import logging
import threading
import warnings
from pathlib import Path

import pytest

from commission.app.base import logs
from commission.app.base.logs import log_file, one_line_each, told_on


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.delenv("COMMISSION_TRACEBACK", raising=False)


def fail(name: str, message: str) -> None:
    try:
        raise KeyError("x")
    except KeyError:
        logging.getLogger(name).exception(message)


def test_a_fault_is_one_line_for_people_and_a_traceback_in_the_file(capfd: pytest.CaptureFixture[str]) -> None:
    with one_line_each():
        fail("commission.app.runtime", "a mistake\nof ours")
    assert capfd.readouterr() == ("", "a mistake of ours: KeyError: 'x'\n")
    kept = log_file().read_text()
    assert "ERROR commission.app.runtime: a mistake" in kept
    assert "Traceback (most recent call last)" in kept
    assert "KeyError: 'x'" in kept


def test_who_asks_for_tracebacks_sees_them_in_the_terminal(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COMMISSION_TRACEBACK", "1")
    with one_line_each():
        fail("commission.app.runtime", "a mistake")
    assert capfd.readouterr().err.startswith("a mistake: KeyError: 'x'\nTraceback (most recent call last)")


@pytest.mark.parametrize("name", ["trimesh", "ezdxf", "websockets.server", "asyncio", "anything.else"])
def test_what_a_library_complains_about_is_one_line_on_stderr(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    with one_line_each():
        fail(name, "odd\ngeometry")
        logging.getLogger(name).info("a detail")
    assert capfd.readouterr() == ("", "odd geometry: KeyError: 'x'\n")


def test_a_library_that_repeats_itself_is_heard_once(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with one_line_each():
        for _ in range(100):
            logging.getLogger("ezdxf").warning("unknown entity")
        assert capfd.readouterr().err == "unknown entity\n"
        monkeypatch.setattr(logs, "SAME_LINE_AFTER_S", 0.0)
        logging.getLogger("ezdxf").warning("unknown entity")
    assert capfd.readouterr().err == "unknown entity\n"


@pytest.mark.parametrize("noise", ["opening handshake failed", "connection rejected (401 Unauthorized)"])
def test_probes_of_the_port_are_no_news(noise: str, capfd: pytest.CaptureFixture[str]) -> None:
    with one_line_each():
        fail("websockets.server", noise)
    assert capfd.readouterr() == ("", "")
    assert not log_file().exists()


def test_a_warning_of_python_is_one_line_without_its_place(capfd: pytest.CaptureFixture[str]) -> None:
    # pytest hears warnings itself: what Python would pass on is passed on here by hand.
    text = warnings.formatwarning("will go", DeprecationWarning, "/a/b.py", 7, "old()")
    with one_line_each():
        logging.getLogger("py.warnings").warning("%s", text)
    assert capfd.readouterr().err == "DeprecationWarning: will go\n"


def test_a_thread_that_ends_by_a_fault_is_one_line(capfd: pytest.CaptureFixture[str]) -> None:
    def fall() -> None:
        raise RuntimeError("no more")

    thread = threading.Thread(target=fall, name="worker")
    with one_line_each():
        thread.start()
        thread.join()
    assert capfd.readouterr().err == "the thread worker has ended: RuntimeError: no more\n"


def test_information_for_the_user_goes_where_it_is_asked_for_and_warnings_to_stderr(
    capfd: pytest.CaptureFixture[str],
) -> None:
    stream = io.StringIO()
    with one_line_each():
        logging.getLogger("commission.io").info("nobody asks")
        with told_on(stream):
            logging.getLogger("commission.app").info("page at\nhome")
            logging.getLogger("commission.app").warning("odd")
            logging.getLogger("numba").info("a detail")
    assert stream.getvalue() == "page at home\n"
    assert capfd.readouterr() == ("", "odd\n")


def test_everything_is_as_before_afterwards() -> None:
    root, ours, hook = logging.getLogger(), logging.getLogger("commission"), threading.excepthook
    before = list(root.handlers), list(ours.handlers), ours.level
    with one_line_each(), told_on(io.StringIO()):
        assert len(root.handlers) == len(before[0]) + 2
    assert (list(root.handlers), list(ours.handlers), ours.level) == before
    assert threading.excepthook is hook


def test_a_home_that_cannot_be_written_to_is_no_fault(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    with one_line_each():
        fail("commission", "a mistake")
    assert capfd.readouterr().err == "a mistake: KeyError: 'x'\n"
