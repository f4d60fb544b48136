"""Reflexes of a goniometer in recordings and live messages: every form gives the same back, a wrong cell is named."""

# pyright: basic

import math

import numpy as np
import pytest

from commission.errors import FileFormatError
from commission.io.protocols.json_records import decode_message, encode_message
from commission.io.protocols.message import LiveMessage
from commission.io.recordings.base import load_log
from commission.io.recordings.bearing_file import read_bearings
from commission.io.recordings.csv_writer import write_recording
from commission.io.recordings.recorder import write_mcap
from commission.site.records import Odometry, ReferencePose, Reflex

REFLEXES = (Reflex(5, 1.0 / 3.0), Reflex(10, math.nan), Reflex(10, -3.1, 'a "b", c;d'))
RECORDS = (Odometry(0, np.zeros(3)), *REFLEXES, Odometry(12, np.zeros(3)), ReferencePose(20, np.zeros(3)))


def plain(reflexes):
    return [(each.stamp_ns, repr(each.bearing), each.reflector) for each in reflexes]


@pytest.mark.parametrize("name", ["drive", "drive.mcap"])
def test_reflexes_are_read_as_they_were_written(tmp_path, name):
    path = tmp_path / name
    (write_mcap if name.endswith(".mcap") else write_recording)(path, RECORDS)
    log = load_log(path)
    assert plain(record for record in log.records() if isinstance(record, Reflex)) == plain(REFLEXES)
    assert len(log) == len(RECORDS)


@pytest.mark.parametrize("reflex", REFLEXES)
def test_a_reflex_is_the_same_after_a_live_message(reflex):
    data = encode_message(LiveMessage(reflex, device_ns=reflex.stamp_ns, sequence=1), ("scanner",))
    assert plain([decode_message(data, ("scanner",)).record]) == plain([reflex])


@pytest.mark.parametrize(
    ("row", "told"), [("5,,A", "line 2, column bearing: is empty beside"), ("5,west,", "line 2, column bearing")]
)
def test_a_cell_that_cannot_be_is_named(tmp_path, row, told):
    path = tmp_path / "bearings.csv"
    path.write_text(f"stamp_ns,bearing,reflector\n{row}\n", encoding="utf-8")
    with pytest.raises(FileFormatError, match=told):
        read_bearings(path)
