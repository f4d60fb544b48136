"""Several workers share the tests by whole files; one has all that need a browser and all that measure time."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections import defaultdict

import pytest

from tests.conftest import REPOSITORY, run_together


def test_each_file_stays_on_one_worker_and_both_work() -> None:
    """As the test command shares them."""
    (options,) = re.findall(r"-m pytest -n \"\$workers\" (.*) \"\$@\"", (REPOSITORY / "tests" / "run").read_text())
    files = [f"tests/geometry/test_{name}.py" for name in ("angles", "se2", "gaussian", "occupancy")]
    command = [sys.executable, "-m", "pytest", "-n2", *options.split(), "-v", "-p", "no:cacheprovider", *files]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    done = subprocess.run(command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    found: dict[str, set[str]] = defaultdict(set)
    for worker, file in re.findall(r"\[(gw\d)\] .*PASSED (\S+?)::", done.stdout):
        found[file].add(worker)
    assert set(found) == set(files)
    assert all(len(workers) == 1 for workers in found.values())
    assert set.union(*found.values()) == {"gw0", "gw1"}


@pytest.mark.parametrize(
    ("nodeid", "group"),
    [
        ("tests/browser/test_page.py::test_x", "browser"),
        ("tests/browser/test_plan.py::test_x[a/b::c]", "browser"),
        ("tests/app/base/test_jobs.py::test_progress_beyond_its_range_is_clipped", "browser"),
        ("tests/geometry/test_se2.py::test_x", "tests/geometry/test_se2.py"),
    ],
)
def test_what_measures_time_goes_with_the_browser(nodeid: str, group: str) -> None:
    assert run_together(nodeid) == group
