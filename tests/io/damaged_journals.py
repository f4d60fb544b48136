"""Journals that a disk, a sync client or an editor has damaged, and what of them must come back."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from commission.io.journal import Journal
from commission.io.journal_place import FILE_NAME
from commission.io.journal_replay import Restored, restore
from commission.io.project_file import load_project, save_project
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap


@dataclass(frozen=True)
class Written:
    """A journal as it was written: edit number i adds the reflector `Ei` and calls the project `edit i`."""

    project: Project
    lines: tuple[bytes, ...]
    """Line of each edit, from number 1 on, without its end."""
    content: bytes


def written(folder: Path, edits: int) -> Written:
    """Save a project, and edit it."""
    saved = Project(name="edit 0", reflectors=ReflectorMap((Reflector(id="A", x=1.0, y=1.0),)))
    save_project(saved, folder)
    journal, project = Journal(folder, saved), saved
    for number in range(1, edits + 1):
        reflectors = (*project.reflectors.reflectors, Reflector(id=f"E{number}", x=float(number), y=0.5))
        project = replace(project, name=f"edit {number}", reflectors=ReflectorMap(reflectors))
        journal.append(project, f"Edit {number}")
    journal.close()
    content = journal.path.read_bytes()
    return Written(load_project(folder), tuple(content.splitlines()[-edits:]), content)


def flip_bit(data: bytes, rng: random.Random) -> bytes:
    """One bit is another."""
    place = rng.randrange(len(data))
    return data[:place] + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1 :]


def change_byte(data: bytes, rng: random.Random) -> bytes:
    """One byte is another; often one that ends a line."""
    ends = [place for place, byte in enumerate(data) if byte == 10]
    # What was damaged before may have no line that ends.
    place = rng.choice(ends) if ends and rng.random() < 0.3 else rng.randrange(len(data))
    return data[:place] + rng.randbytes(1) + data[place + 1 :]


def _block(data: bytes, rng: random.Random) -> tuple[int, int]:
    start = rng.randrange(len(data))
    return start, min(len(data), start + 1 + int(rng.random() ** 3 * len(data)))


def zero_block(data: bytes, rng: random.Random) -> bytes:
    """A block was never written: what a power cut leaves."""
    start, end = _block(data, rng)
    return data[:start] + bytes(end - start) + data[end:]


def garble_block(data: bytes, rng: random.Random) -> bytes:
    """A block is of something else."""
    start, end = _block(data, rng)
    return data[:start] + rng.randbytes(end - start) + data[end:]


def drop_block(data: bytes, rng: random.Random) -> bytes:
    """A block is missing."""
    start, end = _block(data, rng)
    return data[:start] + data[end:]


def repeat_block(data: bytes, rng: random.Random) -> bytes:
    """A block is there twice."""
    start, end = _block(data, rng)
    return data[:end] + data[start:]


def move_block(data: bytes, rng: random.Random) -> bytes:
    """A block is somewhere else."""
    start, end = _block(data, rng)
    rest = data[:start] + data[end:]
    place = rng.randrange(len(rest) + 1)
    return rest[:place] + data[start:end] + rest[place:]


def insert(data: bytes, rng: random.Random) -> bytes:
    """Something came in between."""
    place = rng.randrange(len(data) + 1)
    return data[:place] + rng.randbytes(rng.randrange(1, 200)) + data[place:]


def cut_off(data: bytes, rng: random.Random) -> bytes:
    """The end is missing."""
    return data[: rng.randrange(len(data))]


def other_line_ends(data: bytes, _rng: random.Random) -> bytes:
    """A sync client took it for a text."""
    return data.replace(b"\n", b"\r\n")


DAMAGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    *(flip_bit, change_byte, zero_block, garble_block, drop_block, repeat_block, move_block, insert, cut_off),
    other_line_ends,
)


def damaged(content: bytes, rng: random.Random) -> bytes:
    """Damage a file once, or sometimes more often."""
    data = content
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        data = rng.choice(DAMAGES)(data, rng) or data
    return data


def check_restored(folder: Path, journal: Written, data: bytes) -> Restored | None:
    """Restore from damaged content: fail unless every intact edit comes back, and the content is kept."""
    for old in folder.glob(f"{FILE_NAME}*"):
        old.unlink()
    (folder / FILE_NAME).write_bytes(data)
    # Whose bytes are there, wherever that is, was not damaged.
    intact = [number for number, line in enumerate(journal.lines, start=1) if line in data]
    restored = restore(folder, journal.project)
    if restored is None:
        assert not intact
        assert data == journal.content[: len(data)], "thrown away"
        return None
    found = {reflector.id for reflector in restored.project.reflectors.reflectors}
    assert found == {"A", *(f"E{number}" for number in intact)}
    assert restored.project.name == f"edit {intact[-1] if intact else 0}"
    assert restored.edits == len(intact)
    if not restored.damage:
        assert data == b"".join(line + b"\n" for line in data.splitlines() if line in journal.content)
        return restored
    # The next session begins its journal: the damaged one stays.
    following = Journal(folder, journal.project, restored)
    following.append(replace(restored.project, name="later"), "Rename")
    following.close()
    assert restored.kept is not None
    assert restored.kept.read_bytes() == data
    assert str(restored.kept) in restored.summary()
    assert len(list(folder.glob(f"{FILE_NAME}.*"))) == 1
    return restored
