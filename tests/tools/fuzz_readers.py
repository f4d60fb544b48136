"""Change recordings at random, as often as asked, and read them: each must be an error in one line or valid records.

`python -m tests.tools.fuzz_readers 10000 [--seed N]`. The tests do the same some hundred times.
"""

from __future__ import annotations

import random
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from commission.errors import CommissionError
from commission.io.recordings.base import load_log
from commission.io.recordings.csv_writer import write_recording
from commission.io.recordings.writers import write_records
from commission.site.record_log import RecordLog
from tests.io.protocols.captures import fragments, instance
from tests.io.recordings import captured_packets as made
from tests.io.recordings import ros_bags as bags
from tests.io.recordings.test_captured_messages import bridge, datagrams, pose
from tests.io.recordings.test_carmen import flaser, log_of
from tests.io.recordings.test_cut_recordings import cola_packets
from tests.io.recordings.test_mcap_recording import NAMES, steps
from tests.io.recordings.test_ros_bag import drive
from tests.tools.fuzz_decoders import changed, main

SLOW_S = 2.0
"""Time of the processor in which any of these small files is read [s]."""


def sound(folder: Path) -> dict[str, Path]:
    """A sound recording of each kind: the file that is changed."""
    folder.mkdir(parents=True, exist_ok=True)
    packets = [(bags.START + i, made.ip(17, made.udp(p))) for i, p in enumerate(fragments(instance(60), 1) * 3)]
    found = {
        "pcap": made.write_pcap(folder / "a.pcap", packets),
        "pcapng": made.write_pcapng(folder / "a.pcapng", packets, order=">"),
        "pcap of TCP": made.write_pcap(folder / "tcp.pcap", cola_packets(4), nanoseconds=True),
        "pcap of JSON": made.write_pcap(folder / "json.pcap", datagrams(NAMES, [pose(i) for i in range(9)])),
        "pcap of rosbridge": made.write_pcap(folder / "bridge.pcap", bridge(is_cbor=True)),
        "CARMEN": log_of(folder, *(flaser([1.0, 2.0], (0.1 * i, 0.0, 0.0), 9.0 + i, 1.0 + i) for i in range(9))),
    }
    for ending in (".mcap", ".db3", ".bag"):
        path = bags.write_bag(folder / f"bag_{ending[1:]}{ending}", drive())
        found[f"{ending} of others"] = path if path.is_file() else next(path.glob(f"*{ending}"))
        found[f"own {ending}"] = folder / f"own{ending}"
        write_records(folder / f"own{ending}", steps(6), scanners=NAMES)
    found["ROS 1, cut"] = folder / "cut.bag"
    found["ROS 1, cut"].write_bytes(found[".bag of others"].read_bytes()[:-200])
    write_recording(folder / "tables", steps(6), scanners=NAMES)
    for name in ("odometry.csv", "detections.csv", "reference.csv", "scans_rear.npz"):
        found[name] = folder / "tables" / name
    return found


def check(log: RecordLog) -> None:
    """Raise AssertionError where a record cannot be one."""
    assert np.isfinite(log.displacements).all()
    assert (np.diff(log.odometry_stamps_ns) > 0).all()
    assert np.isfinite(log.range_bearing).all()
    for scans in log.scans:
        assert (np.diff(scans.stamps_ns) > 0).all()
        block = scans.block(0, len(scans))
        assert not (block.ranges < 0.0).any()
        assert np.isfinite(block.angle_min).all()


def fuzz(count: int, seed: int) -> Counter[str]:
    """Read so many changed recordings; returns how many of each kind were read and refused. Others are raised."""
    chance, told = random.Random(seed), Counter[str]()
    with tempfile.TemporaryDirectory() as scratch:
        files = sound(Path(scratch) / "sound")
        contents = {name: path.read_bytes() for name, path in files.items()}
        for index in range(count):
            name = list(files)[index % len(files)]
            data = changed(contents[name], chance)
            # Tables are read with those beside them.
            path = (
                files[name]
                if name.endswith((".csv", ".npz"))
                else files[name].with_name(f"changed{files[name].suffix}")
            )
            path.write_bytes(data)
            # Of the processor: that the computer is busy is no fault of a reader.
            begun = time.process_time()
            try:
                check(load_log(path.parent if path == files[name] else path))
                told[f"{name}: read"] += 1
            except CommissionError as error:
                assert "\n" not in str(error), str(error)
                told[f"{name}: refused"] += 1
            except Exception:
                kept = Path(tempfile.gettempdir()) / f"fuzzed_{seed}_{index}{files[name].suffix}"
                kept.write_bytes(data)
                sys.stderr.write(f"{name}: kept as {kept}\n")
                raise
            finally:
                if path == files[name]:
                    path.write_bytes(contents[name])
            if time.process_time() - begun > SLOW_S:
                told[f"{name}: slower than {SLOW_S:g} s"] += 1
    return told


if __name__ == "__main__":
    main(__doc__, "recordings to read", fuzz)
