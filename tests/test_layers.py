"""The order of the rooms: what no import shows."""

import ast
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY

BELOW_IO = ("geometry", "site", "localization", "planning", "simulation", "studies")

OPENING_NAMES = {"open"}
OPENING_METHODS = {
    *("read_text", "write_text", "read_bytes", "write_bytes"),
    *("load", "save", "savez", "savez_compressed", "loadtxt", "savetxt", "genfromtxt", "fromfile", "tofile", "memmap"),
}


def calls_that_open_files(source: str) -> list[str]:
    """Names of the calls in a module's text that read or write files."""
    found: list[str] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            if isinstance(node.func, ast.Name) and node.func.id in OPENING_NAMES:
                found.append(node.func.id)
            elif isinstance(node.func, ast.Attribute) and node.func.attr in OPENING_METHODS | OPENING_NAMES:
                found.append(node.func.attr)
    return found


def modules_below_io() -> list[Path]:
    """All modules of the rooms that know no file."""
    return [path for room in BELOW_IO for path in sorted((REPOSITORY / "commission" / room).rglob("*.py"))]


@pytest.mark.parametrize("module", modules_below_io(), ids=lambda path: str(path.relative_to(REPOSITORY)))
def test_no_module_below_io_opens_a_file(module):
    assert calls_that_open_files(module.read_text(encoding="utf-8")) == []


def test_the_search_for_opened_files_finds_them():
    assert calls_that_open_files("open('a'); path.read_text(); np.load('b'); print('c')") == [
        "open",
        "read_text",
        "load",
    ]
