"""A small package of kernels beside a copy of `commission.compiled`, to edit and to run in processes of its own."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from tests.conftest import REPOSITORY

MODULES = {
    "constants.py": "LIMIT = 3.0\nFACTOR = 10.0\n",
    "angles.py": '''"""Angles."""
from commission.compiled import compiled_inline

TURN = 4.0


@compiled_inline
def wrap(angle):
    """Wrap."""
    # at four
    return angle % TURN
''',
    "steps.py": '''"""Steps of a filter."""
from typing import NamedTuple

from commission import constants
from commission.angles import wrap
from commission.compiled import compiled
from commission.constants import LIMIT


class State(NamedTuple):
    """State."""

    x: float
    y: float


@compiled
def run(state):
    """Run: calls a kernel that stands below it."""
    return predict(state) + correct(state)


@compiled
def predict(state):
    """Predict."""
    return wrap(state.x + 7.0)


@compiled
def correct(state, gain=0.5):
    """Correct."""
    return gain * min(state.y, LIMIT)


@compiled
def scaled(value):
    """Scale."""
    return constants.FACTOR * value


@compiled
def fill(values):
    """Fill."""
    for i in range(len(values)):
        values[i] = i
''',
    "loops.py": '''"""A kernel on all cores: apart, since it takes as long to compile as all others together."""
import numpy as np

from commission.compiled import compiled_parallel, parallel_range


@compiled_parallel
def doubled(values):
    """Double."""
    result = np.empty_like(values)
    for i in parallel_range(len(values)):
        result[i] = 2.0 * values[i]
    return result
''',
}

REPORT = """
import json
kernels = {name: k for m in modules for name, k in vars(m).items() if hasattr(k, "stats")}
# A step of others is another kernel where Python calls it.
stats = {name: (k.stats, getattr(k, "alone", k).stats) for name, k in kernels.items()}
compiled = sorted(name for name, both in stats.items() if any(each.cache_misses for each in both))
loaded = sorted(name for name, both in stats.items() if any(each.cache_hits for each in both))
print(json.dumps({"values": found, "compiled": compiled, "loaded": loaded}))
"""

SCRIPT = f"""
import numpy as np
from commission import angles, steps
state = steps.State(x=2.0, y=5.0)
steps.fill(np.zeros(3))
found = [steps.run(state), steps.predict(state), steps.correct(state), steps.scaled(2.0), angles.wrap(5.0)]
modules = [angles, steps]
{REPORT}"""

LOOPS_SCRIPT = f"""
import numpy as np
from commission import loops
found, modules = loops.doubled(np.arange(3.0)).tolist(), [loops]
{REPORT}"""

VALUES = [2.5, 1.0, 1.5, 20.0, 1.0]
"""By hand: (2 + 7) mod 4 = 1; 0.5 * min(5, 3) = 1.5; their sum; 10 * 2; 5 mod 4."""

ALL = ["correct", "fill", "predict", "run", "scaled", "wrap"]


@dataclass(frozen=True)
class Outcome:
    """What one process found."""

    values: list[float]
    compiled: list[str]
    """Kernels that it compiled."""
    loaded: list[str]
    """Kernels that it loaded."""


class SmallPackage:
    """A folder with a package `commission` that holds a few kernels."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        package = folder / "commission"
        ignore = shutil.ignore_patterns("__pycache__")
        shutil.copytree(REPOSITORY / "commission" / "compiled", package / "compiled", ignore=ignore)
        shutil.copy(REPOSITORY / "commission" / "progress.py", package)
        (package / "__init__.py").write_text("")
        for name, text in MODULES.items():
            (package / name).write_text(text)

    def edit(self, module: str, old: str, new: str) -> None:
        """Replace a text that occurs in a module."""
        path = self.folder / "commission" / module
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    def start(self, cache: Path, script: str = SCRIPT, **environment: str) -> subprocess.Popen[str]:
        """Begin a process that calls every kernel."""
        variables = {**os.environ, "PYTHONPATH": str(self.folder), "NUMBA_CACHE_DIR": str(cache), **environment}
        # An edit within the second and of the same size would leave Python's own cache of bytecode as it is.
        command = [sys.executable, "-B", "-W", "error", "-c", script]
        return subprocess.Popen(command, env=variables, cwd=self.folder, text=True, stdout=subprocess.PIPE)

    def run(self, cache: Path, script: str = SCRIPT, **environment: str) -> Outcome:
        """Call every kernel in a process of its own."""
        return outcome_of(self.start(cache, script, **environment))


def outcome_of(process: subprocess.Popen[str]) -> Outcome:
    """Wait for a process and read what it printed."""
    output, _ = process.communicate(timeout=240)
    assert process.returncode == 0
    return Outcome(**json.loads(output))
