"""The cache of kernels belongs to one state of the sources."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

import commission
from commission.compiled import cache_folder, sources_digest

PACKAGE = Path(commission.__file__).parent


def test_digest_changes_with_a_kernel_and_with_nothing_else(tmp_path: Path) -> None:
    kernel, other = tmp_path / "kernel.py", tmp_path / "other.py"
    kernel.write_text("from commission.compiled import compiled\n")
    other.write_text("x = 1\n")
    first = sources_digest(tmp_path)
    other.write_text("x = 2\n")
    assert sources_digest(tmp_path) == first
    kernel.write_text("from commission.compiled import compiled  # changed\n")
    assert sources_digest(tmp_path) != first


def test_digest_of_the_package_costs_little_at_every_start() -> None:
    start = time.process_time()
    sources_digest(PACKAGE)
    # A few milliseconds for about a hundred modules.
    assert time.process_time() - start < 0.2


def test_chosen_folder_is_kept_by_a_child_process(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    folder = cache_folder()
    assert folder == tmp_path / sources_digest(PACKAGE)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    assert cache_folder() == folder
