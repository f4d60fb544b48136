from __future__ import annotations

from pathlib import Path

import pytest

from commission.errors import FileFormatError
from commission.io.yaml_document import DEPTH_LIMIT, dotted, parse_yaml, scalar

PATH = Path("hall.yaml")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),
        ("-.5", -0.5),
        ("12", 12),
        ("0x1F", 31),
        ("no", "no"),
        ("12:30", "12:30"),
        ("true", True),
        ("~", None),
        ("1_000", "1_000"),
        ("1.2.3", "1.2.3"),
    ],
)
def test_plain_scalars_follow_the_core_schema_of_yaml_1_2(text: str, value: object) -> None:
    assert scalar(text) == value
    assert type(scalar(text)) is type(value)
    assert parse_yaml(f"key: {text}", PATH).value == {"key": value}


def test_quoted_scalars_are_text() -> None:
    assert parse_yaml("a: '1'\nb: \"true\"\nc: |\n  2\n", PATH).value == {"a": "1", "b": "true", "c": "2\n"}


def test_every_key_and_element_has_its_line() -> None:
    document = parse_yaml("a: 1\nb:\n  - x: 2\n  - {y: 3,\n     z: 4}\n", PATH)
    assert document.lines["b", 0, "x"] == 3
    assert document.lines["b", 1, "z"] == 5
    assert document.place(("b", 1, "z")) == "line 5, b[1].z"
    assert document.place(("b", 1, "missing")) == "line 4, b[1].missing"
    assert dotted(("b", 1, "z")) == "b[1].z"


def test_nothing_is_none() -> None:
    assert parse_yaml("", PATH).value is None
    assert parse_yaml("# only a comment\n", PATH).value is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\na: 2", "hall.yaml: line 2, a: is given a second time (first on line 1)"),
        ("a: &x [1]\nb: *x", "line 1, a: uses an anchor or alias"),
        ("a: !!python/object/apply:os.system [ls]", "line 1, a: has the tag"),
        ("a: .nan", "line 1, a: is .nan; expected a finite number"),
        ("a: 1e999", "line 1, a: is 1e999; expected a finite number"),
        ("? [1]\n: 2", "line 1: has a list or mapping as a key"),
        ("a: 1\n---\nb: 2", "line 2: a second document starts"),
        ("a: [1", "is no YAML"),
        ("a: \x07", "is no YAML"),
        ("[" * (DEPTH_LIMIT + 2), f"expected at most {DEPTH_LIMIT} levels"),
    ],
)
def test_what_is_no_plain_data_is_said_with_its_line(text: str, message: str) -> None:
    with pytest.raises(FileFormatError) as caught:
        parse_yaml(text, PATH)
    assert message in str(caught.value)
