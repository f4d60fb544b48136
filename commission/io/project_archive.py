"""A project in a zip, as one engineer sends it to another: unpacked within limits and never outside its folder."""

from __future__ import annotations

import shutil
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from commission.errors import FileFormatError
from commission.io.project_file import FILE_NAME, load_project
from commission.io.reading import cannot_read, check_size
from commission.progress import Progress, silent
from commission.site.project import Project

SIZE_LIMIT = 256_000_000
"""Bytes of a zip."""
UNPACKED_LIMIT = 512_000_000
"""Bytes of all its files together."""
HARMLESS = 32_000_000
"""Unpacked bytes that are taken whatever their ratio: an empty map packs well, and this much does no harm."""
RATIO_LIMIT = 200
"""Unpacked bytes for each packed one; deflate ends at 1032, tables of numbers at 10."""
MEMBER_LIMIT = 200
"""Files of a project."""
_GARBAGE = (zipfile.BadZipFile, zlib.error, EOFError, ValueError, NotImplementedError, RuntimeError, UnicodeError)
"""What zipfile raises for files that end early, were never a zip or are encrypted."""


@dataclass(frozen=True, slots=True)
class ProjectImport:
    """A whole project from somebody else."""

    project: Project
    """As its files are."""
    warnings: tuple[str, ...] = ()
    """What was passed over, one line each."""


def read_project_archive(path: Path, *, progress: Progress = silent) -> ProjectImport:
    """Read a project from a zip.

    Parameters
    ----------
    path : zip with a `project.yaml` at its top or in its only folder.
    progress : called between the files; may raise to cancel.

    Raises
    ------
    FileFormatError
        it is no zip, too large or unpacks into too much, a name leads out of it, it holds no project, or the project
        is wrong.
    """
    check_size(path, SIZE_LIMIT)
    with _opened(path) as archive, tempfile.TemporaryDirectory(prefix="commission.") as temporary:
        members = _checked(path, archive)
        root = _root(path, members)
        wanted = [(name, info) for name, info in members.items() if name.is_relative_to(root)]
        folder = Path(temporary)
        for index, (name, info) in enumerate(wanted):
            progress(0.8 * index / len(wanted), f"unpacking {name.name}")
            target = folder / name.relative_to(root)
            target.parent.mkdir(parents=True, exist_ok=True)
            # zipfile hands out no more than the size that the directory of the zip announces, which was checked.
            with archive.open(info) as packed, target.open("xb") as file:
                shutil.copyfileobj(packed, file)
        progress(0.8, "reading the project")
        try:
            return ProjectImport(load_project(folder))
        except FileFormatError as error:
            # The path of the temporary folder would mean nothing to the reader.
            inner = error.path.relative_to(folder) if error.path.is_relative_to(folder) else error.path
            where = f"{inner}, {error.where}" if error.where else str(inner)
            problem, remedy = (text.replace(str(folder), "the zip") for text in (error.problem, error.remedy))
            raise FileFormatError(path, where, problem, remedy) from error


@contextmanager
def _opened(path: Path) -> Generator[zipfile.ZipFile]:
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except OSError as error:
        raise cannot_read(path, error) from error
    except _GARBAGE as error:
        raise FileFormatError(path, "", f"is no readable zip ({error})", "a complete zip of a project") from error


def _checked(path: Path, archive: zipfile.ZipFile) -> dict[PurePosixPath, zipfile.ZipInfo]:
    """Files of an archive by their names, after looking at its directory only: nothing is unpacked yet."""
    infos = [info for info in archive.infolist() if not info.is_dir()]
    if not 0 < len(infos) <= MEMBER_LIMIT:
        raise FileFormatError(path, "", f"holds {len(infos)} files", f"1 to {MEMBER_LIMIT}")
    unpacked, packed = sum(info.file_size for info in infos), path.stat().st_size
    if unpacked > UNPACKED_LIMIT or (unpacked > HARMLESS and unpacked > RATIO_LIMIT * packed):
        remedy = f"at most {UNPACKED_LIMIT} bytes, and {RATIO_LIMIT} times its size"
        raise FileFormatError(path, "", f"would unpack {packed} bytes into {unpacked}", remedy)
    members: dict[PurePosixPath, zipfile.ZipInfo] = {}
    for info in infos:
        name = PurePosixPath(info.filename)
        mode = info.external_attr >> 16
        if name.is_absolute() or ".." in name.parts or set(info.filename) & set("\\:\0"):
            raise FileFormatError(path, "", f"holds {info.filename[:60]!r}", "names that stay inside its folder")
        if stat.S_IFMT(mode) not in (0, stat.S_IFREG):
            raise FileFormatError(path, "", f"holds the link {info.filename[:60]!r}", "plain files")
        if name in members:
            raise FileFormatError(path, "", f"holds {info.filename[:60]!r} twice", "each file once")
        members[name] = info
    return members


def _root(path: Path, members: dict[PurePosixPath, zipfile.ZipInfo]) -> PurePosixPath:
    """Folder of the project within the archive."""
    roots = [name.parent for name in members if name.name == FILE_NAME and len(name.parts) <= 2]
    if len(roots) != 1:
        problem = f"holds {len(roots) or 'no'} {FILE_NAME}"
        raise FileFormatError(path, "", problem, "one, at the top or in a folder at the top")
    return roots[0]
