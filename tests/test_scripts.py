"""Benchmarks and tools are no part of the test command, but they must not be left behind by what they use."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
SCRIPTS = sorted(
    f"tests.{folder}.{path.stem}" for folder in ("benchmarks", "tools") for path in (TESTS / folder).glob("*.py")
)


@pytest.mark.parametrize("name", SCRIPTS)
def test_every_script_finds_what_it_imports(name: str) -> None:
    assert importlib.import_module(name).__doc__
