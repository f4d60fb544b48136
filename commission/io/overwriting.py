"""What lies where something is about to be written, so that nothing is overwritten unasked.

Results can be computed again, so a command replaces its own earlier ones; a recording, a project or a file that was
converted may be the only one there is, so that these are replaced when asked to.
"""

from __future__ import annotations

import json
import re
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from commission.errors import CommissionError, FileFormatError, UsageError
from commission.io.atomic import cannot_write, staged, write_text
from commission.io.journal_place import FILE_NAME as JOURNAL
from commission.io.project_file import FILE_NAME as PROJECT
from commission.io.project_file import load_project
from commission.io.reading import read_text
from commission.io.recordings.bearing_file import BEARINGS
from commission.io.recordings.contour_file import CONTOUR
from commission.io.recordings.csv_folder import DETECTIONS, ODOMETRY, REFERENCE, SCANS
from commission.io.recordings.reference_file import REFERENCE_MOUNT
from commission.io.recordings.tag_file import TAGS
from commission.io.recordings.truth_file import TRUTH

MANIFEST = ".commission.result"
"""File in a folder of results that says which command made which files: the same one may make them again."""
_RECORDING = re.compile(
    "|".join(
        (
            *map(re.escape, (ODOMETRY, DETECTIONS, SCANS, REFERENCE, REFERENCE_MOUNT, TRUTH, CONTOUR, BEARINGS, TAGS)),
            r"scans_.*\.npz",
        )
    )
)
_MANIFEST_LIMIT = 100_000


def refuse_recording(folder: Path, *, force: bool) -> None:
    """Raise UsageError when a folder holds a recording, or a part of one, unless it may be replaced by `force`."""
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder} is a file; expected a folder for the recording")
    found = sorted(path.name for path in folder.iterdir() if _RECORDING.fullmatch(path.name)) if folder.is_dir() else []
    if found and not force:
        remedy = "expected another folder, or --force to overwrite"
        raise UsageError(f"{folder} holds a recording or a part of one ({_listed(found)}); {remedy}")


def refuse_files(*paths: Path, force: bool) -> None:
    """Raise UsageError when one of these files is there, unless they may be replaced by `force`."""
    for path in paths:
        if not force and _exists(path):
            raise UsageError(f"{path} exists; expected another name, or --force to overwrite")


def project_in(folder: Path) -> str:
    """Say which project a folder holds: saved, or unsaved in the journal of a crashed session; empty: none."""
    parts: list[str] = []
    if _exists(folder / PROJECT):
        try:
            parts.append(f"the project {load_project(folder).name!r}")
        except CommissionError:
            parts.append("a project that cannot be read")
    if _exists(folder / JOURNAL):
        parts.append(f"unsaved edits of a session that crashed or still runs ({JOURNAL})")
    if not parts and (tables := _there(folder, ("reflectors.csv", "map.yaml", "map.png"))):
        parts.append(_listed(tables))
    return " and ".join(parts)


@dataclass(frozen=True, slots=True)
class ResultFolder:
    """Where a command writes its results."""

    folder: Path
    """As the engineer named it."""
    command: str
    """Name of the command."""
    own: tuple[str, ...]
    """Files there that this command wrote before: they are replaced."""

    @contextmanager
    def writing(self) -> Generator[Path]:
        """Give a folder to write into; after the block all files are in place together, and older own ones gone."""
        with staged(self.folder, last="summary.json") as scratch:
            yield scratch
            names = sorted(path.relative_to(scratch).as_posix() for path in scratch.rglob("*") if path.is_file())
            manifest = {"command": self.command, "files": names}
            write_text(scratch / MANIFEST, json.dumps(manifest, indent=2) + "\n")
        for name in set(self.own) - set(names):
            try:
                (self.folder / name).unlink(missing_ok=True)
            except OSError as error:
                raise cannot_write(self.folder / name, error) from error


def result_folder(
    folder: Path, command: str, names: Iterable[str], *, force: bool = False, sources: Iterable[Path] = ()
) -> ResultFolder:
    """Look at where a command is about to write, before it computes for long.

    Parameters
    ----------
    folder : need not exist.
    command : name of the command.
    names : files that it may write.
    force : whether files that it did not write are overwritten.
    sources : what it reads: never written into.

    Raises
    ------
    UsageError
        the folder is a file or one of the sources, or holds such files, and `force` is False.
    """
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"--out is the file {folder}; expected a folder")
    for source in sources:
        if source.exists() and folder.exists() and source.resolve() == folder.resolve():
            raise UsageError(f"--out is what is read, {source}; expected another folder")
    made_by, files = _manifest(folder)
    own = files if made_by == command else ()
    found = [name for name in _there(folder, names) if name not in own]
    if found and not force:
        owner = f" of the command {made_by}" if made_by and made_by != command else ""
        raise UsageError(
            f"{folder} holds {_listed(found)}{owner}, which {command} did not write; "
            "expected another folder, or --force to overwrite"
        )
    return ResultFolder(folder, command, own)


def _manifest(folder: Path) -> tuple[str, tuple[str, ...]]:
    """Command that made the results in a folder, and its files; nobody and none where that is not said."""
    try:
        values = json.loads(read_text(folder / MANIFEST, _MANIFEST_LIMIT))
        names = tuple(str(name) for name in values["files"])
        return str(values["command"]), tuple(name for name in names if _is_plain(name))
    except (FileFormatError, ValueError, TypeError, LookupError, RecursionError):
        return "", ()


def _is_plain(name: str) -> bool:
    """Whether it is the name of a file in the folder itself: others are never removed."""
    return bool(name) and Path(name).name == name


def _there(folder: Path, names: Iterable[str]) -> list[str]:
    return [name for name in names if _exists(folder / name)]


def _exists(path: Path) -> bool:
    return path.exists() or path.is_symlink()


def _listed(names: list[str]) -> str:
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more files" if len(names) > 4 else "")
