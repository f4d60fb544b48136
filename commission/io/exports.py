"""Files for other systems made of a project, as bytes with a safe name, and what each format cannot carry."""

from __future__ import annotations

import io
import re
import tempfile
import unicodedata
import zipfile
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from commission.errors import FileFormatError, UsageError
from commission.io.imk import write_imk
from commission.io.lif_writer import write_lif
from commission.io.project_file import save_project
from commission.io.reflector_tables import write_reflectors
from commission.progress import Progress, silent
from commission.site.project import Project

NAME_LIMIT = 48


class Format(StrEnum):
    """What can be made of a project, in the words of a button."""

    TABLE = "CSV"
    IMK = ".imk"
    LIF = "LIF"
    PROJECT = "Project"


_ENDINGS = {
    Format.TABLE: "_reflectors.csv",
    Format.IMK: ".imk",
    Format.LIF: ".lif",
    Format.PROJECT: ".zip",
}


@dataclass(frozen=True, slots=True)
class Exported:
    """A file for somebody else."""

    name: str
    """Name of the file: letters, digits and `._-`, whatever the project is called."""
    content: bytes
    """The file."""
    losses: tuple[str, ...] = ()
    """What the format cannot carry, one line each."""


def safe_stem(name: str) -> str:
    """Return a project's name as the beginning of a file's name that every system takes."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9_-]+", "_", plain)[:NAME_LIMIT].strip("_-") or "site"


def export(project: Project, wanted: Format, *, progress: Progress = silent) -> Exported:
    """Make a file of a project.

    Parameters
    ----------
    project : what to write.
    wanted : reflectors as a table or a SICK layout, routes and stations as a VDMA LIF layout, or all as a zip.
    progress : called between the steps; may raise to cancel.

    Raises
    ------
    UsageError
        the project holds nothing that the format is for.
    FileFormatError
        a value is beyond what the format can hold.
    """
    if wanted in (Format.TABLE, Format.IMK) and not len(project.reflectors):
        raise UsageError("there are no reflectors to write; expected one or more")
    if wanted is Format.LIF and not (project.routes or project.stations):
        raise UsageError("there are no routes to write; expected one or more")
    stem = safe_stem(project.name)
    name = f"{stem}{_ENDINGS[wanted]}"
    with tempfile.TemporaryDirectory(prefix="commission.") as folder:
        path = Path(folder) / "file"
        progress(0.1, "writing")
        try:
            losses = _written(project, wanted, path)
        except FileFormatError as error:
            raise FileFormatError(name, error.where, error.problem, error.remedy) from error
        content = _zipped(path, stem, progress) if wanted is Format.PROJECT else path.read_bytes()
    return Exported(name, content, losses)


def _written(project: Project, wanted: Format, path: Path) -> tuple[str, ...]:
    """Write a file, or the folder of a project; returns what is lost."""
    match wanted:
        case Format.TABLE:
            write_reflectors(project.reflectors, path)
        case Format.IMK:
            return write_imk(project.reflectors, path)
        case Format.LIF:
            return write_lif(project, path)
        case Format.PROJECT:
            save_project(project, path)
    return ()


def _zipped(folder: Path, stem: str, progress: Progress) -> bytes:
    """Content of a zip that unpacks into one folder."""
    target = io.BytesIO()
    files = sorted(path for path in folder.iterdir() if path.is_file())
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for index, path in enumerate(files):
            progress(0.5 + 0.5 * index / len(files), f"packing {path.name}")
            archive.write(path, f"{stem}/{path.name}")
    return target.getvalue()
