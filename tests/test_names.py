"""Names that a newcomer guesses wrongly stay away, and every handler has a name."""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY

RETIRED = {
    *("mapping", "keeping", "store", "reduction", "desk", "upkeep", "looks", "loads", "remembered", "ghost", "ghosts"),
    *("checking", "confusing", "covering", "edges"),
}
"""They once stood for floor maps, saving, state, problems, ambiguity, coverage and more; each has the field's word."""

FITTING = {
    "route_edges": "VDMA LIF and VDA 5050 call them edges",
    "_from_edges()": "the edges of a cluster of beams",
    "_covering_all()": "columns of a covering problem",
    "record_store": "a store of records, in memory or in a file: what it is",
    "mapping()": "what YAML and JSON call a value with keys",
}
"""Names in which such a word means what it says."""

SOURCES = sorted([*(REPOSITORY / "commission").rglob("*.py"), *(REPOSITORY / "tests").rglob("*.py")])


def names_in(path: Path, source: str) -> Iterator[str]:
    """What a file names: itself, its folder, classes, functions (with brackets), and what it imports as something."""
    yield from (path.stem, path.parent.name)
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield f"{node.name}()"
        elif isinstance(node, ast.alias) and node.asname is not None:
            yield node.asname


@functools.cache
def named() -> dict[Path, frozenset[str]]:
    """What each source names: all of them are read once."""
    return {path: frozenset(names_in(path, path.read_text(encoding="utf-8"))) for path in SOURCES}


def is_wrongly_guessed(name: str) -> bool:
    """Whether one of a name's words is retired; the sentences of tests may hold any."""
    words = name.lower().removesuffix("()").split("_")
    return words[0] != "test" and name not in FITTING and not RETIRED.isdisjoint(words)


def test_no_name_is_one_that_newcomers_guess_wrongly() -> None:
    found = {
        f"{path.relative_to(REPOSITORY)}: {name}"
        for path, names in named().items()
        for name in names
        if is_wrongly_guessed(name)
    }
    assert found == set()


def test_every_handler_has_a_name() -> None:
    assert [path for path, names in named().items() if "_()" in names] == []


@pytest.mark.parametrize(
    ("path", "source", "is_found"),
    [
        ("app/store.py", "", True),
        ("app/mapping/panel.py", "", True),
        ("app/base/state.py", "", False),
        ("cli/all.py", "from commission.cli import ambiguity as confusing", True),
        ("cli/all.py", "from commission.cli.ambiguity import Ambiguity", False),
        ("app/panel.py", "class Panel:\n    def _keeping_out(self): ...", True),
        ("app/panel.py", "class Desk: ...", True),
        ("app/panel.py", "def test_covering_hides_all(): ...", False),
        ("io/fields.py", "def mapping(): ...", False),
        ("io/fields.py", "def stored(): ...", False),
    ],
)
def test_a_retired_word_in_a_name_is_found(path: str, source: str, is_found: bool) -> None:
    assert any(is_wrongly_guessed(name) for name in names_in(Path(path), source)) == is_found
