"""Change telegrams at random, as often as asked, and decode them: each must be a `DecodeError` or a valid scan.

`python -m tests.tools.fuzz_decoders 1000000 [--seed N]`. The tests do the same some hundred times.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
import zlib
from collections import Counter
from collections.abc import Callable

import numpy as np

from commission.errors import DecodeError
from commission.io.protocols import cola, compact, nav350, rosbridge, safety
from commission.io.protocols.json_records import decode_message, encode_message
from commission.io.protocols.message import LiveMessage, OdometryPose
from commission.site.records import Scan
from tests.io.protocols.captures import cola_b, fragments, instance, nav_answer
from tests.io.protocols.test_cola import TEXT, binary

Decode = Callable[[bytes], Scan | None]


def _safety(data: bytes) -> Scan | None:
    found = safety.decode_instance(data)
    return None if found is None else safety.scan_of(found, 0)


def _fragment(data: bytes) -> None:
    safety.Reassembly().add(safety.decode_fragment(data))


def _compact(data: bytes) -> None:
    # With a right checksum, so that what is behind it is reached.
    compact.whole_size(data)
    whole = data[:-4] + zlib.crc32(data[:-4]).to_bytes(4, "little")
    for module in compact.decode_telegram(whole).modules:
        compact.scan_of([module], 0, 0)


def _frames(data: bytes) -> None:
    for frame in cola.split_frames(data)[0]:
        if cola.is_scan(frame):
            cola.decode_lmd(frame)


def compact_telegram() -> bytes:
    """One segment of 12 beams by the layout: one echo with strength, properties and azimuth."""
    layer = b"".join([bytes(16), bytes(12)])
    head = b"".join(value.to_bytes(size, "little") for value, size in ((3, 8), (9, 8), (7, 4), (1, 4), (12, 4), (1, 4)))
    rows = b"".join(b"\x10\x27\x05\x00\x01" + (16384 + 90 * beam).to_bytes(2, "little") for beam in range(12))
    module = head + layer + b"\x00\x00\x80\x3f" + bytes(4) + b"\x01\x03\x03\x00" + rows
    begin = compact.STX + b"\x01\x00\x00\x00" + bytes(16) + b"\x04\x00\x00\x00" + len(module).to_bytes(4, "little")
    return begin + module + zlib.crc32(begin + module).to_bytes(4, "little")


def _rosbridge(data: bytes) -> None:
    found = rosbridge.decode_publication(data)
    if found is not None:
        rosbridge.decode_record(*found, {"/scan": 0})


def _scan() -> Scan:
    return Scan(
        stamp_ns=5_000_000_007,
        ranges=np.linspace(1.0, 3.0, 20).astype(np.float32),
        angle_min=-0.5,
        angle_increment=0.05,
        intensities=np.arange(20, dtype=np.float32),
    )


SEEDS: dict[str, tuple[bytes, Decode]] = {
    "CoLa B": (binary(channels=2), lambda data: cola.scan_of(cola.decode_lmd(data), 0)),
    "CoLa A": (TEXT, lambda data: cola.scan_of(cola.decode_lmd(data), 0)),
    "CoLa frames": (cola_b(binary()) + b"\x02" + TEXT + b"\x03", _frames),
    "Compact": (compact_telegram(), _compact),
    "safety instance": (instance(40), _safety),
    "safety fragment": (fragments(instance(40), 1)[0], _fragment),
    "JSON": (
        encode_message(LiveMessage(_scan(), 5, 6), ("scanner",)),
        lambda data: decode_message(data, ("scanner",)) and None,
    ),
    "rosbridge text": (rosbridge.encode_publication("/scan", _scan(), is_cbor=False), _rosbridge),
    "rosbridge CBOR": (rosbridge.encode_publication("/scan", _scan(), is_cbor=True), _rosbridge),
    "rosbridge odometry": (
        rosbridge.encode_publication("/odom", OdometryPose(7, np.array([1.0, 2.0, 0.3])), is_cbor=True),
        _rosbridge,
    ),
    "NAV350": (nav_answer(20), lambda data: nav350.scan_of(nav350.decode_nav(data), 0)),
}
"""A sound telegram of each kind, and what decodes it."""


def changed(data: bytes, chance: random.Random) -> bytes:
    """Return a telegram with some bytes changed, cut out, put in twice, or cut off."""
    found = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        place = chance.randrange(len(found) or 1)
        kind = chance.randrange(8)
        if kind == 0:
            del found[place : place + chance.randint(1, 8)]
        elif kind == 1:
            found[place:place] = found[place : place + chance.randint(1, 8)]
        elif kind == 2:
            del found[place:]
        elif found:
            found[place] = chance.choice((0, 1, 127, 128, 255, chance.randrange(256)))
        if not found:
            break
    return bytes(found)


def fuzz(count: int, seed: int) -> Counter[str]:
    """Decode so many changed telegrams; returns how many of each kind were decoded and refused. Others are raised."""
    chance, told = random.Random(seed), Counter[str]()
    names = list(SEEDS)
    for index in range(count):
        name = names[index % len(names)]
        sound, decode = SEEDS[name]
        data = changed(sound, chance)
        begun = time.perf_counter()
        try:
            decode(data)
            told[f"{name}: decoded"] += 1
        except DecodeError:
            told[f"{name}: refused"] += 1
        except Exception:
            sys.stderr.write(f"{name}: {data.hex()}\n")
            raise
        if time.perf_counter() - begun > 1.0:
            told[f"{name}: slower than 1 s"] += 1
    return told


def main(description: str | None, what: str, fuzz: Callable[[int, int], Counter[str]]) -> None:
    """Do what a command line says: so many of something, changed by chance, and what became of them."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("count", type=int, help=what)
    parser.add_argument("--seed", type=int, default=1)
    words = parser.parse_args()
    for line, number in sorted(fuzz(words.count, words.seed).items()):
        sys.stdout.write(f"{line:32} {number}\n")


if __name__ == "__main__":
    main(__doc__, "telegrams to decode", fuzz)
