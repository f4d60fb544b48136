"""Tags in recordings and live messages: every form gives the same frames back, and a wrong cell is named."""

# pyright: basic

import math

import numpy as np
import pytest

from commission.errors import FileFormatError
from commission.io.protocols.json_records import decode_message, encode_message
from commission.io.protocols.message import LiveMessage
from commission.io.recordings.base import load_log
from commission.io.recordings.csv_writer import write_recording
from commission.io.recordings.recorder import write_mcap
from commission.io.recordings.tag_file import read_tags
from commission.site.records import Odometry, ReferencePose, TagSightings

NAN = math.nan
FRAMES = (
    TagSightings(5, np.array([(1.5, -0.1, 1.0 / 3.0, 0.01, 0.02, NAN), (2.0, 0.0, 3.1, NAN, NAN, NAN)]), ("7", "")),
    TagSightings(10, np.empty((0, 6)), ()),
    TagSightings(15, np.array([(0.5, 0.25, -1.0, NAN, NAN, NAN)]), ('a "b", c;d',)),
)
RECORDS = (Odometry(0, np.zeros(3)), *FRAMES[:2], Odometry(12, np.zeros(3)), FRAMES[2], ReferencePose(20, np.zeros(3)))


def plain(frames):
    return [(each.stamp_ns, each.ids, each.sightings.tobytes()) for each in frames]


@pytest.mark.parametrize("name", ["drive", "drive.mcap"])
def test_frames_are_read_as_they_were_written(tmp_path, name):
    path = tmp_path / name
    (write_mcap if name.endswith(".mcap") else write_recording)(path, RECORDS)
    log = load_log(path)
    assert plain(record for record in log.records() if isinstance(record, TagSightings)) == plain(FRAMES)
    assert log.tags.offsets.tolist() == [0, 2, 2, 3]
    assert len(log) == len(RECORDS)


@pytest.mark.parametrize("frame", FRAMES)
def test_a_frame_is_the_same_after_a_live_message(frame):
    data = encode_message(LiveMessage(frame, device_ns=frame.stamp_ns, sequence=1), ("scanner",))
    assert plain([decode_message(data, ("scanner",)).record]) == plain([frame])


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("5,7,1.0,,0.1", "line 2, column y: is empty"),
        ("5,7,,,", "line 2, column x: is empty beside an id"),
        ("5,7,1.0,x,0.1", "line 2, column y"),
        ("5,7,1.0,0.0,0.1,0.0", "line 2, column sigma_x: is 0"),
    ],
)
def test_a_cell_that_cannot_be_is_named(tmp_path, row, told):
    path = tmp_path / "tags.csv"
    header = "stamp_ns,id,x,y,theta" + (",sigma_x" if row.count(",") == 5 else "")
    path.write_text(f"{header}\n{row}\n", encoding="utf-8")
    with pytest.raises(FileFormatError, match=told):
        read_tags(path)


def test_rows_of_one_stamp_are_a_frame_wherever_they_stand(tmp_path):
    path = tmp_path / "tags.csv"
    path.write_text("stamp_ns;id;x;y;theta\n9;b;2;0;0\n5;;;;\n9;a;1;0;0\n", encoding="utf-8")
    log = read_tags(path)
    assert (log.stamps_ns.tolist(), log.offsets.tolist(), log.ids.tolist()) == ([5, 9], [0, 0, 2], ["b", "a"])
