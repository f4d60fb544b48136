"""The checks of the cluster, in a process of their own: the threads of its client go on, and disturb later tests."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CHECKS = Path(__file__).with_name("cluster_checks.py")


@pytest.mark.with_all_seeds
def test_studies_on_a_cluster_are_those_of_this_machine_and_errors_are_clear(repository: Path) -> None:
    pytest.importorskip("distributed", reason="the extra commission[cluster] is not installed")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", str(CHECKS)],
        cwd=repository,
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:]
    assert "skipped" not in done.stdout
