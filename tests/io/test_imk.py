from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError
from commission.io.imk import read_imk, write_imk
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap

HEADER = "globID\tx_mm\ty_mm\ttype\tsubtype\tsize_mm\tlayer1\n"
LAYER = st.lists(st.integers(1, 65535), max_size=3, unique=True).map(lambda layers: "+".join(map(str, layers)))


@st.composite
def layouts(draw: st.DrawFn) -> ReflectorMap:
    """Reflectors that the format can hold: whole millimetres, numbers for names."""
    one = st.builds(
        Reflector,
        id=st.integers(0, 65535).map(str),
        x=st.integers(-(2**31) + 1, 2**31 - 1).map(lambda mm: mm / 1000.0),
        y=st.integers(-(10**6), 10**6).map(lambda mm: mm / 1000.0),
        radius=st.integers(1, 2000).map(lambda mm: mm / 2000.0),
        kind=st.sampled_from(ReflectorKind),
        layer=LAYER,
    )
    return ReflectorMap(tuple(draw(st.lists(one, max_size=6, unique_by=lambda r: r.id))))


@given(layout=layouts())
def test_layout_that_is_written_and_read_again_is_equal(
    tmp_path_factory: pytest.TempPathFactory, layout: ReflectorMap
) -> None:
    path = tmp_path_factory.mktemp("layout") / "hall.imk"
    write_imk(layout, path)
    assert read_imk(path).reflectors == layout


@given(
    x=st.floats(-1e5, 1e5),
    y=st.floats(-1e5, 1e5),
    radius=st.floats(0.001, 1.0),
)
def test_writing_moves_no_reflector_by_more_than_half_a_millimetre(
    tmp_path_factory: pytest.TempPathFactory, x: float, y: float, radius: float
) -> None:
    path = tmp_path_factory.mktemp("layout") / "hall.imk"
    write_imk(ReflectorMap((Reflector(id="7", x=x, y=y, radius=radius),)), path)
    (read,) = read_imk(path).reflectors.reflectors
    # Half a millimetre, and what 64-bit numbers of that size cannot resolve.
    assert abs(read.x - x) <= 0.0005 + 1e-9
    assert abs(read.y - y) <= 0.0005 + 1e-9
    assert abs(read.radius - radius) <= 0.00025 + 1e-9


def test_layout_of_a_real_sensor_is_read(shared_data: Path) -> None:
    imported = read_imk(shared_data / "sick_captures" / "nav350" / "tvz_20231130_excerpt.imk")
    assert imported.warnings == ()
    first, *_ = imported.reflectors.reflectors
    assert first == Reflector(id="1", x=14.74, y=-4.211, radius=0.03, kind=ReflectorKind.CYLINDER)
    assert len(imported.reflectors) >= 11


def test_what_the_format_cannot_carry_is_said(tmp_path: Path) -> None:
    reflectors = (
        Reflector(
            id="north",
            x=1.0004,
            y=2.0,
            radius=0.04,
            kind=ReflectorKind.FLAT,
            heading=1.0,
            height=1.8,
            sigma=0.002,
            note="pillar",
        ),
        Reflector(id="2", x=3.0, y=4.0, layer="hall"),
    )
    losses = "\n".join(write_imk(ReflectorMap(reflectors), tmp_path / "hall.imk"))
    for said in (
        "reflector 'north': ids become numbers",
        "positions are rounded to whole millimetres",
        "layer 'hall' becomes layer 1",
        "heading of 1 reflector is not carried",
        "height of 1",
        "sigma of 1",
        "note of 1",
        "2 reflectors; a NAV sensor needs 3 or more",
    ):
        assert said in losses
    again = read_imk(tmp_path / "hall.imk")
    assert [r.id for r in again.reflectors.reflectors] == ["1", "2"]
    assert again.reflectors.reflectors[0].lacks_direction
    assert any("which way a flat reflector faces" in warning for warning in again.warnings)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("1 2 3 1 2 60", "line 2: has 6 columns; expected 7 or more: globID x_mm"),
        ("1 x 3 1 2 60 0", "line 2, column x_mm: is 'x'; expected a number of millimetres"),
        ("1 nan 3 1 2 60 0", "column x_mm: is 'nan'"),
        ("1 1e99 3 1 2 60 0", "column x_mm: is '1e99'"),
        ("1 1_0 3 1 2 60 0", "column x_mm: is '1_0'"),
        ("1 1 3 1 2 0 0", "column size_mm: is 0; expected more than 0 and at most 2000"),
        ("70000 1 3 1 2 60 0", "column globID: is '70000'; expected a whole number from 0 to 65535"),
        ("1 1 3 1 2 60 -1", "column layer1: is '-1'"),
        ("1 1 3 1 2 60 0\n1 5 3 1 2 60 0", "line 3, column globID: 1 is used twice (first on line 2)"),
    ],
)
def test_wrong_layout_is_one_line_with_line_and_column(tmp_path: Path, row: str, message: str) -> None:
    path = tmp_path / "hall.imk"
    path.write_text(HEADER + row + "\n")
    with pytest.raises(FileFormatError) as caught:
        read_imk(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_coordinate_beyond_the_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=r"x is 3e\+06 m; expected at most"):
        write_imk(ReflectorMap((Reflector(id="1", x=3e6, y=0.0),)), tmp_path / "hall.imk")


@given(data=st.binary(max_size=200))
def test_garbage_is_one_line_or_a_layout(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.mktemp("layout") / "hall.imk"
    path.write_bytes(HEADER.encode() + data)
    try:
        read_imk(path)
    except CommissionError as error:
        assert "\n" not in str(error)
