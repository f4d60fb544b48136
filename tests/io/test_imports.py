from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError, UsageError
from commission.io import imports
from commission.io.exports import Format, export
from commission.io.imk import ReflectorImport
from commission.io.imports import LayoutChoice, read_import, read_named, read_pasted, shown_name
from commission.io.route_edges import RouteImport
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment

EXAMPLES = [f"{number:02}.json" for number in range(20)]
TABLE = b"id;x;y;radius;note\nR1;0,25;2,1;0,04;pillar\n"
ROUTE = Route("Loop", (Segment(control_points=np.array([[0.0, 0.0], [2.0, 0.0]]), degree=1),), 0.8)
ORDER = {
    "version": "3.0.0",
    "orderId": "order-7",
    "nodes": [
        {"nodeId": name, "sequenceId": 2 * i, "released": True, "nodePosition": {"x": 2.0 * i, "y": 0.0}}
        for i, name in enumerate("AB")
    ],
    "edges": [{"edgeId": "E", "sequenceId": 1, "released": True, "startNodeId": "A", "endNodeId": "B"}],
}


def reflectors(imported: object) -> tuple[Reflector, ...]:
    assert isinstance(imported, ReflectorImport)
    return imported.reflectors.reflectors


def test_table_with_semicolons_and_decimal_commas_is_read_and_says_which_columns_it_has() -> None:
    imported = read_import("hall.csv", TABLE)
    assert reflectors(imported) == (Reflector(id="R1", x=0.25, y=2.1, note="pillar"),)
    assert isinstance(imported, ReflectorImport)
    assert set(imported.fields) == {"id", "x", "y", "radius", "note"}


def test_table_as_other_tools_write_it_is_read_by_its_header() -> None:
    text = "# survey of May\nNr;X [mm];Y [mm];Diameter [mm]\n7;1250,5;-300;80\n"
    assert reflectors(read_import("survey.CSV", text.encode())) == (Reflector(id="7", x=1.2505, y=-0.3, radius=0.04),)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "R1\t1,5\t2,5\t0,04\nR2\t3\t4\t0,05",
            (Reflector(id="R1", x=1.5, y=2.5), Reflector(id="R2", x=3.0, y=4.0, radius=0.05)),
        ),
        (
            "globID\tx_mm\ty_mm\ttype\tsubtype\tsize_mm\tlayer1\n5 1500 2500 1 2 80 0\n",
            (Reflector(id="5", x=1.5, y=2.5),),
        ),
    ],
)
def test_pasted_text_is_recognized_by_its_beginning(text: str, expected: tuple[Reflector, ...]) -> None:
    assert reflectors(read_pasted(text)) == expected


def test_json_is_a_layout_or_an_order_by_what_it_holds() -> None:
    layout = export(Project(name="Hall", routes=(ROUTE,)), Format.LIF).content
    for imported in (read_import("any.json", layout), read_pasted(layout.decode())):
        assert isinstance(imported, RouteImport)
        assert [route.name for route in imported.routes] == ["Loop"]
    order = read_import("order.json", json.dumps(ORDER).encode())
    assert isinstance(order, RouteImport)
    assert [route.name for route in order.routes] == ["order-7"]


@pytest.mark.parametrize("name", EXAMPLES)
def test_official_layout_is_imported_with_warnings_instead_of_failure(shared_data: Path, name: str) -> None:
    content = (shared_data / "layouts" / "lif" / "examples" / name).read_bytes()
    imported = read_import(name, content)
    assert isinstance(imported, RouteImport)
    # None of the examples obeys the official schema, so none may pass without a word.
    assert imported.warnings
    assert imported.routes or name == "00.json"


def test_part_of_a_layout_can_be_chosen_and_an_unknown_one_is_named(shared_data: Path) -> None:
    content = (shared_data / "layouts" / "lif" / "examples" / "17.json").read_bytes()
    with pytest.raises(UsageError, match="no vehicle type is called 'none of them'"):
        read_import("17.json", content, LayoutChoice(vehicle_type="none of them"))


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("hall.exe", b"", "hall.exe: is of a kind that is not read here; expected a file that ends in .csv, .tsv"),
        ("hall", b"", "is of a kind that is not read here"),
        ("../../etc/passwd", b"", "passwd: is of a kind that is not read here"),
        ("a\\b\\hall.csv", b"id,x,y,radius\nA,zero,0,0.04\n", "hall.csv: line 2, column x: is 'zero'"),
        ("hall.imk", b"1 2 3\n", "hall.imk: line 1: has 3 columns"),
        ("hall.lif", b"{", "hall.lif: is no JSON"),
        ("order.json", b"{}", "order.json: nodes: is missing; expected a list"),
        ("hall.csv", b"\xff\xfe\x00", "hall.csv: line 1: byte 0xff is not UTF-8"),
        ("hall.csv", b"", "is empty"),
    ],
)
def test_what_cannot_be_imported_is_one_line_that_names_the_file_as_the_person_does(
    name: str, content: bytes, message: str
) -> None:
    with pytest.raises(FileFormatError) as caught:
        read_import(name, content)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "commission." not in str(caught.value)


def test_what_is_too_large_is_refused_with_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(imports, "SIZE_LIMIT", 40)
    with pytest.raises(FileFormatError, match=f"has {len(TABLE)} bytes; expected at most 40 bytes"):
        read_import("hall.csv", TABLE)
    monkeypatch.undo()
    monkeypatch.setattr(imports, "REFLECTOR_LIMIT", 0)
    with pytest.raises(FileFormatError, match="holds 1 reflectors; expected at most 0"):
        read_import("hall.csv", TABLE)


@pytest.mark.parametrize("path", ["/etc/passwd", "absent.csv", "~nobody_at_all/hall.csv", "nul\0.csv"])
def test_file_of_the_server_that_is_none_is_one_line_and_tells_nothing_of_its_content(path: str) -> None:
    with pytest.raises(FileFormatError) as caught:
        read_named(Path(path))
    assert "root:" not in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("hall.csv", "hall.csv"),
        ("C:\\plans\\hall.csv", "hall.csv"),
        ("../../etc/cron.d/x.csv", "x.csv"),
        ("a\nb\x00c.csv", "a b c.csv"),
        ("\u202egnp.exe", "gnp.exe"),
        ("", "file"),
        ("///", "file"),
        ("x" * 300 + ".dxf", "x" * 48 + "…" + "x" * 7 + ".dxf"),
    ],
)
def test_name_of_a_strangers_file_is_shown_without_folders_and_tricks(name: str, shown: str) -> None:
    assert shown_name(name) == shown


MAPS = st.lists(
    st.builds(
        Reflector,
        id=st.from_regex(r"[A-Za-z<>&'/][A-Za-z0-9<>&'/;, ]{0,8}[A-Za-z0-9>]", fullmatch=True),
        x=st.integers(-(10**8), 10**8).map(lambda tenths: tenths / 1e4),
        y=st.integers(-(10**8), 10**8).map(lambda tenths: tenths / 1e4),
        radius=st.integers(10, 10**4).map(lambda tenths: tenths / 1e4),
        note=st.text(st.characters(min_codepoint=33, max_codepoint=0x2FFF, exclude_categories=("C", "Z")), max_size=9),
        locked=st.booleans(),
    ),
    min_size=1,
    max_size=5,
    unique_by=lambda r: r.id,
).map(lambda rs: ReflectorMap(tuple(rs)))


@given(reflectors=MAPS)
def test_table_that_was_exported_is_imported_as_it_was(reflectors: ReflectorMap) -> None:
    made = export(Project(reflectors=reflectors), Format.TABLE)
    imported = read_import(made.name, made.content)
    assert isinstance(imported, ReflectorImport)
    assert imported.reflectors == reflectors


@given(name=st.sampled_from(["a.csv", "a.imk", "a.lif", "a.json"]), content=st.binary(max_size=300))
def test_garbage_is_one_line_or_an_import(name: str, content: bytes) -> None:
    try:
        read_import(name, content)
    except CommissionError as error:
        assert "\n" not in str(error)
