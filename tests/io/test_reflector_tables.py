from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError
from commission.io.reflector_tables import read_reflectors, write_reflectors
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap

COORDINATE = st.floats(-1e6, 1e6)
TEXT = st.text(st.characters(blacklist_categories=("C", "Z")), max_size=8)
ID = TEXT.filter(lambda text: text and not text.startswith("#"))


def reflectors() -> st.SearchStrategy[ReflectorMap]:
    one = st.builds(
        Reflector,
        id=ID,
        x=COORDINATE,
        y=COORDINATE,
        radius=st.none() | st.floats(0.001, 1.0),
        kind=st.sampled_from(ReflectorKind),
        heading=st.none() | st.floats(-4.0, 4.0),
        height=st.floats(0.0, 3.0),
        sigma=st.floats(0.0, 0.1),
        layer=TEXT,
        note=TEXT,
        locked=st.booleans(),
    )
    return st.lists(one, max_size=5, unique_by=lambda r: r.id).map(lambda rows: ReflectorMap(tuple(rows)))


@given(table=reflectors())
def test_table_that_is_written_and_read_again_is_equal_to_a_tenth_of_a_millimetre(
    tmp_path_factory: pytest.TempPathFactory, table: ReflectorMap
) -> None:
    path = tmp_path_factory.mktemp("table") / "reflectors.csv"
    write_reflectors(table, path)
    read = read_reflectors(path)
    for new, old in zip(read.reflectors, table.reflectors, strict=True):
        for name in ("id", "kind", "layer", "note", "locked"):
            assert getattr(new, name) == getattr(old, name)
        lengths = [abs(getattr(new, name) - getattr(old, name)) for name in ("x", "y", "height")]
        assert max(lengths) <= 0.5001e-4
        for after, before, digit in ((new.radius, old.radius, 1e-4), (new.heading, old.heading, 1e-6)):
            assert (after is None) == (before is None)
            assert after is None or before is None or abs(after - before) <= 0.5001 * digit
        assert abs(new.sigma - old.sigma) <= 5.001e-6 * old.sigma
    text = path.read_text(encoding="utf-8")
    write_reflectors(read, path)
    assert path.read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    ("text", "radius", "heading"),
    [
        ("id,x,y,radius,kind,heading\nA,1,2,,flat,\n", None, None),
        ("id,x,y,radius,kind,heading\nA,1,2,0.1,flat,0\n", 0.1, 0.0),
        ("id;x;y;radius;kind;heading\nA;1;2; ;flat;-1,5\n", None, -1.5),
        ("id,x,y,radius,kind\nA,1,2,0.1,flat\n", 0.1, None),
    ],
    ids=["both empty", "zero is a direction", "radius blank", "no column heading"],
)
def test_what_a_table_leaves_empty_is_unknown_and_stays_so(
    tmp_path: Path, text: str, radius: float | None, heading: float | None
) -> None:
    path = tmp_path / "reflectors.csv"
    path.write_text(text, encoding="utf-8")
    expected = Reflector(id="A", x=1.0, y=2.0, radius=radius, kind=ReflectorKind.FLAT, heading=heading)
    assert read_reflectors(path) == ReflectorMap((expected,))
    write_reflectors(read_reflectors(path), path)
    assert read_reflectors(path) == ReflectorMap((expected,))


@pytest.mark.parametrize(
    "text",
    [
        "id,x,y,radius\nA,1.5,-2,0.04\n",
        "\ufeffid;x;y;radius\r\n\r\nA;1,5;-2,0;0,04\r\n",
        "# surveyed in May\nRadius, Y ,x,ID\n0.04,-2,1.5,A\n\n",
        'id,x,y,radius,kind,note\n"A",1.5,-2,4e-2,,\n',
    ],
    ids=["plain", "European spreadsheet", "other order", "quoted"],
)
def test_table_is_read_as_spreadsheets_save_it(tmp_path: Path, text: str) -> None:
    path = tmp_path / "reflectors.csv"
    path.write_bytes(text.encode())
    assert read_reflectors(path) == ReflectorMap((Reflector(id="A", x=1.5, y=-2.0, radius=0.04),))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; expected a table with the columns id, x, y, radius"),
        ("id,x,y\nA,1,2\n", "line 1: the header 'id,x,y' has no column radius"),
        ("id,x,y,radius,color\n", "line 1: column 'color' is unknown; expected one of: id, x, y, radius, kind"),
        ("id,x,y,radius,x\n", "line 1: column x is there 2 times; expected each column once"),
        ("id,x,y,radius\nA,1,2,0.04\nB,one,2,0.04\n", "line 3, column x: is 'one'; expected a number [m]"),
        ("id,x,y,radius\nA,nan,2,0.04\n", "line 2, column x: is nan; expected a finite number [m]"),
        ("id,x,y,radius\nA,1,,0.04\n", "line 2, column y: is empty; expected a number [m]"),
        ("id,x,y,radius\nA,1,2,0.04\nA,3,4,0.04\n", "line 3, column id: 'A' is used twice (first on line 2)"),
        ("id,x,y,radius\nA,1,2,0\n", "line 2, column radius: is 0; expected more than 0 and at most 1 m"),
        ("id,x,y,radius\n,1,2,0.1\n", "line 2, column id: is empty; expected a name"),
        ("id,x,y,radius\nA,1,2\n", "line 2: has 3 cells; expected 4 cells"),
        ("id,x,y,radius,kind\nA,1,2,0.1,round\n", "column kind: is 'round'; expected one of: cylinder, flat"),
        ("id,x,y,radius,locked\nA,1,2,0.1,maybe\n", "line 2, column locked: is 'maybe'; expected yes or no"),
        ('id,x,y,radius\n"A,1,2,0.1\n', "line 2: is no row of a table"),
        ("id,x,y,radius\nA,1_0,2,0.1\n", "line 2, column x: is '1_0'; expected a number [m]"),
    ],
)
def test_wrong_table_is_one_line_with_line_and_column(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "reflectors.csv"
    path.write_text(text)
    with pytest.raises(FileFormatError) as caught:
        read_reflectors(path)
    assert message in str(caught.value)


@given(data=st.binary(max_size=200))
def test_garbage_is_one_line_or_a_table(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.mktemp("table") / "reflectors.csv"
    path.write_bytes(b"id,x,y,radius\n" + data)
    try:
        read_reflectors(path)
    except CommissionError as error:
        assert "\n" not in str(error)
