"""The order of the rooms: the import contract of pyproject.toml, and what no import shows."""

import ast
import subprocess
import sys
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


def test_every_module_imports_only_from_the_layers_below_its_own():
    command = "import sys; from importlinter.cli import lint_imports_command; sys.exit(lint_imports_command())"
    finished = subprocess.run(
        [sys.executable, "-c", command], cwd=REPOSITORY, capture_output=True, text=True, timeout=120, check=False
    )
    assert finished.returncode == 0, finished.stdout + finished.stderr
    assert "4 kept, 0 broken" in finished.stdout


@pytest.mark.parametrize("module", modules_below_io(), ids=lambda path: str(path.relative_to(REPOSITORY)))
def test_no_module_below_io_opens_a_file(module):
    assert calls_that_open_files(module.read_text(encoding="utf-8")) == []


def test_the_search_for_opened_files_finds_them():
    assert calls_that_open_files("open('a'); path.read_text(); np.load('b'); print('c')") == [
        "open",
        "read_text",
        "load",
    ]
