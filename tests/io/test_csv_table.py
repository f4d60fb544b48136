from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.errors import FileFormatError
from commission.io.csv_table import LINE_LIMIT, read_table

COLUMNS = ("stamp_ns", "x")


def content(path: Path, bytes_at_once: int) -> list[tuple[int, int, float]]:
    """Line, stamp and x of every row."""
    return [
        row
        for block in read_table(path, COLUMNS, bytes_at_once=bytes_at_once)
        for row in zip(block.lines, block.stamps().tolist(), block.numbers("x", "m").tolist(), strict=True)
    ]


@given(
    rows=st.lists(
        st.tuples(st.integers(-(10**18), 10**18), st.floats(-1e9, 1e9)).map(lambda row: f"{row[0]},{row[1]!r}")
        | st.sampled_from(["", "   ", "# note", '" 7 ","1"', "5 , 2"]),
        max_size=20,
    ),
    end=st.sampled_from(["\n", "\r\n"]),
    size=st.integers(1, 60),
)
def test_size_of_the_blocks_does_not_change_what_is_read(
    tmp_path_factory: pytest.TempPathFactory, rows: list[str], end: str, size: int
) -> None:
    path = tmp_path_factory.mktemp("table") / "table.csv"
    path.write_bytes(end.join(["\ufeffstamp_ns,x", *rows]).encode())
    table = content(path, size)
    assert table == content(path, 1_000_000)
    assert [line for line, _, _ in table] == [
        number for number, row in enumerate(rows, start=2) if row.strip() and not row.startswith("#")
    ]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"stamp_ns,x\n1,2\n1,\xff\n", "line 3: byte 0xff is not UTF-8"),
        (b"stamp_ns,x\n1,2\n1,\x003\n", "line 3: holds a zero byte"),
        (b"stamp_ns,x\r1,2\r1,3\r", "line 1: holds a bare carriage return"),
        (b"stamp_ns,x\n1," + b"1" * (LINE_LIMIT + 1), f"line 2: is longer than {LINE_LIMIT} characters"),
        (b"1" * (LINE_LIMIT + 300_000), "line 1: is longer than"),
        (b"\n  \n", "is empty; expected a table with the columns stamp_ns, x"),
    ],
)
def test_what_is_no_table_is_said_with_its_line(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(data)
    with pytest.raises(FileFormatError) as caught:
        content(path, 100_000)
    assert message in str(caught.value)


@pytest.mark.parametrize("blank", [" ", "\t", "\x1c", "\x1f", "\x85", "\u2003"])
def test_what_is_blank_around_a_stamp_is_passed_over(tmp_path: Path, blank: str) -> None:
    file = tmp_path / "table.csv"
    file.write_bytes(f"stamp_ns,x\n5,1\n{blank}7{blank},2\n".encode())

    (block,) = read_table(file, ("stamp_ns", "x"))

    assert block.stamps().tolist() == [5, 7]
