"""Large drawings and models, written fast: for tests and benchmarks of reading with progress and cancel."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np


def write_drawing(path: Path, entities: int) -> None:
    """Write a drawing of lines, arcs and circles in 12 layers, 180 x 80 m in millimetres."""
    rng = np.random.default_rng(3)
    with path.open("w", encoding="ascii") as file:
        file.write("0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n")
        places, sizes = rng.uniform((0, 0), (180_000, 80_000), (entities, 2)), rng.uniform(100, 2000, (entities, 2))
        for number, ((x, y), (w, h)) in enumerate(zip(places, sizes, strict=True)):
            layer = f"8\nLAYER_{number % 12}\n10\n{x:.3f}\n20\n{y:.3f}\n"
            if number % 10 == 8:
                file.write(f"0\nARC\n{layer}40\n{w:.3f}\n50\n0\n51\n90\n")
            elif number % 10 == 9:
                file.write(f"0\nCIRCLE\n{layer}40\n{w:.3f}\n")
            else:
                file.write(f"0\nLINE\n{layer}11\n{x + w:.3f}\n21\n{y + h:.3f}\n")
        file.write("0\nENDSEC\n0\nEOF\n")


def triangles(count: int) -> Iterator[np.ndarray]:
    """Yield (N, 3, 3) corners [m] of a floor of small pyramids, 180 x 80 m, some at a time."""
    rng = np.random.default_rng(4)
    for start in range(0, count, 100_000):
        n = min(100_000, count - start)
        base = rng.uniform((0, 0, 0), (180, 80, 0.2), (n, 3))[:, np.newaxis]
        yield base + rng.uniform(0.0, 0.3, (n, 3, 3))


def write_stl(path: Path, size: int) -> None:
    """Write a binary STL of about so many bytes."""
    count = (size - 84) // 50
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    with path.open("wb") as file:
        file.write(b"\0" * 80 + np.uint32(count).tobytes())
        for part in triangles(count):
            rows = np.zeros(len(part), record)
            rows["corners"] = part
            file.write(rows.tobytes())


def write_obj(path: Path, size: int) -> None:
    """Write a text OBJ of about so many bytes."""
    with path.open("w", encoding="ascii") as file:
        number = 1
        for part in triangles(10_000_000):
            lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in part.reshape(-1, 3)]
            lines += [f"f {3 * i + number} {3 * i + number + 1} {3 * i + number + 2}" for i in range(len(part))]
            file.write("\n".join(lines) + "\n")
            number += 3 * len(part)
            if file.tell() >= size:
                return
