"""Files of a ROS 2 bag that are packed as a whole (`bag_0.db3.zstd`) where no metadata says so: unpacked, then read.

With its metadata such a bag is read by `rosbags`. What is unpacked lies on the disk while the bag is open.
"""

from __future__ import annotations

import shutil
import tempfile
import weakref
from collections.abc import Collection, Iterator
from pathlib import Path

from commission.errors import FileFormatError
from commission.io.atomic import cannot_write
from commission.io.reading import cannot_read

ENDINGS = (".zstd", ".zst")
"""How packed files end; behind it stands the ending of what is in them."""
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_PIECE = 1_000_000
_SPARE = 500_000_000
"""Bytes of the disk that stay free."""


def packed_files(path: Path, magics: Collection[bytes]) -> list[Path]:
    """Files that are packed and hold a bag: of a folder, or the file itself.

    Parameters
    ----------
    path : file or folder.
    magics : with what a file of a bag begins.
    """
    files = [path] if path.is_file() else [each for end in ENDINGS for each in path.glob(f"*{end}") if each.is_file()]
    return sorted((file for file in files if _holds(file, magics)), key=lambda file: (len(file.name), file.name))


def unpacked_folder(owner: object, path: Path, files: list[Path]) -> tuple[Path, tuple[str, ...]]:
    """Unpack files into a folder that goes with its owner; returns it, and which files are cut.

    Parameters
    ----------
    owner : the folder is removed when it is gone.
    path : the bag, for messages.
    files : those that are packed.

    Raises
    ------
    FileFormatError
        a file cannot be read, or the disk has no room for what is in it.
    """
    try:
        folder = Path(tempfile.mkdtemp())
    except OSError as error:
        raise cannot_write(path, error) from error
    weakref.finalize(owner, shutil.rmtree, folder, ignore_errors=True)
    cut = [f"{file.name} is cut; it is read up to there" for file in files if not _unpack(path, file, folder)]
    return folder, tuple(cut)


def _unpack(path: Path, file: Path, folder: Path) -> bool:
    """Unpack one file; returns whether it is whole."""
    target = folder / file.name[: -len(file.suffix)]
    try:
        with target.open("wb") as out:
            for piece in _pieces(file):
                if shutil.disk_usage(folder).free < _SPARE + len(piece):
                    raise FileFormatError(path, file.name, "does not fit on the disk unpacked", f"room in {folder}")
                out.write(piece)
    except EOFError:
        return False
    except OSError as error:
        raise cannot_read(file, error) from error
    return True


def _pieces(file: Path) -> Iterator[bytes]:
    """Deliver what is in a file; raises EOFError where it is cut or damaged."""
    from rosbags.rosbag2.storage_mcap import zstd

    try:
        with file.open("rb") as packed, zstd.ZstdFile(packed) as plain:
            # What is left of a file that is cut comes before the error.
            while piece := plain.read1(_PIECE):
                yield piece
    except zstd.ZstdError as error:
        raise EOFError(str(error)) from error


def _holds(file: Path, magics: Collection[bytes]) -> bool:
    with file.open("rb") as packed:
        if packed.read(len(ZSTD_MAGIC)) != ZSTD_MAGIC:
            return False
    try:
        begin = next(_pieces(file), b"")
    except EOFError:
        return False
    return any(begin.startswith(magic) for magic in magics)
