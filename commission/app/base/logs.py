"""What the program says while it runs: one line for people, and the whole story in a file.

Libraries are heard here, too: their warnings are a line at most, and no traceback reaches the terminal unasked.
"""

from __future__ import annotations

import logging
import logging.handlers
import os
import re
import sys
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

OURS = "commission"
SHOW_TRACEBACK = "COMMISSION_TRACEBACK"
LARGEST_FILE = 1_000_000
"""Size at which the log begins anew; the one before is kept beside it [bytes]."""
SAME_LINE_AFTER_S = 10.0
"""Time in which a line that repeats is written once [s]."""
LONGEST_LINE = 500

_NOISE = ("opening handshake failed", "connection rejected", "server listening", "server clos", "connection open")
"""What websockets says of probes of the port and of every request."""


def wants_tracebacks() -> bool:
    """Whether the terminal shows where an unexpected error came from."""
    return bool(os.environ.get(SHOW_TRACEBACK))


def log_file() -> Path:
    """Return where tracebacks are written: in the user's folder for the state of programs."""
    base = os.environ.get("XDG_STATE_HOME") or os.environ.get("LOCALAPPDATA") or Path.home() / ".local" / "state"
    return Path(base) / "commission" / "commission.log"


_WARNING = re.compile(r"^.*?:\d+: (\w+: )")
"""Where a warning of Python's comes from, which helps nobody at a terminal."""


class OneLine(logging.Formatter):
    """Writes a record on one line, with the kind and text of its error and without its traceback."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line; the traceback under it where it was asked for."""
        text = record.getMessage()
        if record.name == "py.warnings":
            text = _WARNING.sub(r"\1", text.partition("\n")[0])
        if record.exc_info and record.exc_info[1] is not None:
            error = record.exc_info[1]
            text += f": {type(error).__name__}: {error}"
        line = " ".join(text.split())[:LONGEST_LINE]
        if record.exc_info and wants_tracebacks():
            return f"{line}\n{self.formatException(record.exc_info)}"
        return line


class Calm(logging.Filter):
    """Lets pass what is news: no noise of the network, no line that has just been written."""

    def __init__(self) -> None:
        super().__init__()
        self._written: dict[str, float] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record is written."""
        text = record.getMessage()
        if record.name.startswith("websockets") and text.startswith(_NOISE):
            return False
        if record.levelno < logging.WARNING:
            return True
        now = time.monotonic()
        self._written = {line: at for line, at in self._written.items() if now - at < SAME_LINE_AFTER_S}
        is_news = text not in self._written
        self._written.setdefault(text, now)
        return is_news


@contextmanager
def one_line_each() -> Generator[None]:
    """While this lasts, warnings and errors of the program and its libraries are lines on stderr, and in the log."""
    root, hook = logging.getLogger(), threading.excepthook
    handlers = [_terminal(sys.stderr, logging.WARNING), _file()]
    for handler in handlers:
        if handler is not None:
            root.addHandler(handler)
    threading.excepthook = _report_thread
    logging.captureWarnings(True)
    try:
        yield
    finally:
        logging.captureWarnings(False)
        threading.excepthook = hook
        for handler in handlers:
            if handler is not None:
                root.removeHandler(handler)
                handler.close()


@contextmanager
def told_on(stream: TextIO) -> Generator[None]:
    """While this lasts, what the program says to its user, such as the page's address, is written to a stream."""
    ours = logging.getLogger(OURS)
    handler, level = _terminal(stream, logging.INFO), ours.level
    handler.addFilter(lambda record: record.levelno < logging.WARNING)
    ours.addHandler(handler)
    ours.setLevel(logging.INFO)
    try:
        yield
    finally:
        ours.removeHandler(handler)
        ours.setLevel(level)


def _terminal(stream: TextIO, level: int) -> logging.Handler:
    """Make a handler that writes lines for people."""
    handler = logging.StreamHandler(stream)
    handler.setLevel(level)
    handler.setFormatter(OneLine())
    handler.addFilter(Calm())
    return handler


def _file() -> logging.Handler | None:
    """Make a handler that keeps warnings and errors with their tracebacks; None where no file can be written."""
    path = log_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handler = logging.handlers.RotatingFileHandler(
            path, maxBytes=LARGEST_FILE, backupCount=1, encoding="utf-8", delay=True
        )
    except OSError:
        return None
    handler.setLevel(logging.WARNING)
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    handler.addFilter(Calm())
    return handler


def _report_thread(arguments: threading.ExceptHookArgs) -> None:
    """Log what ended a thread."""
    error = arguments.exc_value
    if error is None or isinstance(error, SystemExit):
        return
    name = "" if arguments.thread is None else f" {arguments.thread.name}"
    logging.getLogger(f"{OURS}.thread").error("the thread%s has ended", name, exc_info=error)
