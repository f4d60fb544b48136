from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError
from commission.io.pasted_table import parse_table
from commission.site.reflectors import Reflector, ReflectorKind

A = Reflector(id="A", x=1.5, y=-2.0, radius=0.04)


@pytest.mark.parametrize(
    "text",
    [
        "id\tx\ty\tradius\nA\t1.5\t-2\t0.04\n",
        "id\tx\ty\tradius\r\nA\t1,5\t-2,0\t0,04\r\n\t\t\t\r\n",
        "ID;X [m];Y [m];Diameter [mm]\nA;1,5;-2;80\n",
        "Nr,x_mm,y_mm,size_mm\nA,1500,-2000,80\n",
        "A;1,5;-2;0,04",
        "A\t1.5\t-2\t0.04",
    ],
    ids=["tabs", "decimal comma", "semicolons", "millimetres", "no header", "no header, tabs"],
)
def test_table_is_read_as_spreadsheets_give_it(text: str) -> None:
    imported = parse_table(text)
    assert imported.reflectors.reflectors == (A,)
    assert imported.warnings == ()


def test_flat_reflectors_are_read_with_their_heading_in_degrees() -> None:
    (read,) = parse_table("name\tx\ty\tr\ttype\theading (deg)\nA\t0\t0\t0,1\tflat\t90").reflectors.reflectors
    assert read == Reflector(id="A", x=0.0, y=0.0, radius=0.1, kind=ReflectorKind.FLAT, heading=math.pi / 2)


def test_names_that_are_missing_are_filled_in_sizes_are_unknown_and_both_is_said() -> None:
    imported = parse_table("1\t2\n3\t4")
    assert [(r.id, r.x, r.y, r.radius) for r in imported.reflectors.reflectors] == [
        ("R1", 1.0, 2.0, None),
        ("R2", 3.0, 4.0, None),
    ]
    assert "no ids" in imported.warnings[0]
    assert "is unknown" in imported.warnings[1]


def test_coordinates_that_look_like_millimetres_are_doubted() -> None:
    imported = parse_table("A\t14740\t-4211\t0.04")
    assert imported.warnings[0] == "x reaches 14740 m; if these are millimetres, call the column x_mm"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "pasted table: is empty"),
        (" \n\t\n", "is empty"),
        ("hello", "first row: is 'hello'; expected a header with x and y"),
        ("id\tx\ty\tcolor\nA\t1\t2\tred", "header: column 'color' is unknown"),
        ("x\tX\ty\n1\t2\t3", "header: column x is there twice"),
        ("id\tx\ty\tr\tsize\nA\t1\t2\t3\t4", "names both radius and diameter"),
        ("id\tx\ty\nA\t1", "line 2: has 2 cells; expected 3 cells: id, x, y"),
        ("id\tx\ty\nA\t1.5\t2\nB\t1,234\t3.1", "line 3, column x: is '1,234'; expected a number [m]"),
        ("id\tx_mm\ty\nA\tone\t2", "line 2, column x: is 'one'; expected a number [m]"),
        ("id\tx\ty\nA\tnan\t2", "line 2, column x: is nan; expected a finite number [m]"),
        ("id\tx\ty\nA\t1\t2\nA\t3\t4", "line 3, column id: 'A' is used twice (first on line 2)"),
    ],
)
def test_wrong_table_is_one_line_with_line_and_column(text: str, message: str) -> None:
    with pytest.raises(FileFormatError) as caught:
        parse_table(text)
    assert message in str(caught.value)


@given(text=st.text(st.sampled_from('xyid\t;,\n1.5-e"mnaé ')))
def test_garbage_is_one_line_or_a_table(text: str) -> None:
    try:
        parse_table(text)
    except CommissionError as error:
        assert "\n" not in str(error)
