"""The exception tree of the whole project.

An exception here means that something the user gave or relied on is wrong; its text is one line that says where, what
was found and what is expected. Expected outcomes (a rejected gate, no reflector seen) are results, never exceptions.
"""

from __future__ import annotations

from pathlib import Path


class CommissionError(Exception):
    """Root of all errors that a command or the page shows to the user as one line.

    The tree, by what a person would do next:

    - `ProjectError`: the project contradicts itself (a route that names no segment, two reflectors with one id).
    - `FileFormatError`: a file is not what it claims to be (truncated map, missing column).
    - `SourceError`: a live source misbehaves; `SourceTimeout` (it is silent), `DecodeError` (it sends garbage).
    - `ServerError`: the page cannot be served as asked (port taken, no token for a public address).
    - `JobError`: background work could not be done; `JobCancelled`: somebody stopped it.
    - `UsageError`: a command or an action was asked for something that does not exist (an unknown route).
    """


def fault_line(error: BaseException) -> str:
    """Return what people are told of an error that is a mistake of ours.

    Its own text is no answer to anybody (a bare key, a number), and may be a line of a file: it is for the log.
    """
    return f"a fault of the program ({type(error).__name__}); its log says where"


class ProjectError(CommissionError):
    """The project's values contradict each other."""


class FileFormatError(CommissionError):
    """A file cannot be used.

    Parameters
    ----------
    path : path of the file.
    where : place inside it: a key, a line, a column, a byte offset; empty when it is the file as a whole.
    problem : what was found.
    remedy : what is expected.
    """

    def __init__(self, path: Path | str, where: str, problem: str, remedy: str) -> None:
        self.path = Path(path)
        self.where = where
        self.problem = problem
        self.remedy = remedy
        place = f"{self.path}: {where}" if where else str(self.path)
        text = f"{place}: {problem}; expected {remedy}" if remedy else f"{place}: {problem}"
        super().__init__(" ".join(text.split()))


class SourceError(CommissionError):
    """A live source of records misbehaves."""


class DecodeError(SourceError):
    """A telegram cannot be decoded; `offset` is the byte at which decoding stopped."""

    def __init__(self, problem: str, offset: int) -> None:
        self.offset = offset
        super().__init__(f"byte {offset}: {problem}")


class ServerError(CommissionError):
    """The page cannot be served as asked."""


class JobError(CommissionError):
    """Background work could not be done."""


class JobCancelled(JobError):
    """Background work was stopped by the user."""


class UsageError(CommissionError):
    """A command or an action asks for something that does not exist."""


def reason_of(error: BaseException) -> str:
    """Say in words what a library found wrong with a file.

    Parameters
    ----------
    error : what it raised. The text of a KeyError is the key alone, which says nothing to a person; some have no text.
    """
    if isinstance(error, KeyError) and error.args:
        return f"it refers to {error.args[0]!r}, which is not in it"
    return str(error).strip() or type(error).__name__
