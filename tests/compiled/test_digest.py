"""A digest covers what goes into a kernel's machine code, and costs next to nothing."""

from __future__ import annotations

import enum
import importlib
import pkgutil
import subprocess
import sys
import time
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest

import commission
from commission.compiled.digest import kernel_digest
from tests.conftest import REPOSITORY

ROOMS = ("geometry", "site", "localization", "planning", "simulation")


def kernels_of_the_package() -> dict[str, Any]:
    found: dict[str, Any] = {}
    for room in ROOMS:
        folder = importlib.import_module(f"commission.{room}")
        for module in pkgutil.walk_packages(folder.__path__, f"commission.{room}."):
            values = vars(importlib.import_module(module.name)).values()
            found |= {f"{k.__module__}.{k.__qualname__}": k for k in values if hasattr(k, "py_func")}
    return found


def test_every_kernel_has_a_digest_of_its_own_that_costs_little() -> None:
    kernels = kernels_of_the_package()
    assert len(kernels) > 100
    start = time.process_time()
    digests = {kernel_digest(kernel) for kernel in kernels.values()}
    # 5 ms for 123 kernels on the slowest machine so far.
    assert time.process_time() - start < 0.1
    assert len(digests) == len(kernels)


def test_digest_is_the_same_in_every_process() -> None:
    script = (
        "from commission.localization import whole_run\nfrom commission.compiled.digest import kernel_digest\n"
        "print([kernel_digest(k) for n, k in sorted(vars(whole_run).items()) if hasattr(k, 'py_func')])"
    )
    printed = {
        subprocess.run(
            [sys.executable, "-c", script],
            cwd=REPOSITORY,
            env={"PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(printed) == 1


class Speed(enum.IntEnum):
    SLOW = 1
    FAST = 2


class Point(NamedTuple):
    x: float
    y: float = 0.0


def function(source: str, **names: Any) -> Any:
    """Compile a source to the function `f`, in a module of its own with some names in it."""
    module = ModuleType("commission.example")
    vars(module).update(names)
    exec(source, vars(module))
    return vars(module)["f"]


CALLER = "def f(x):\n    return g(x)\n"


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("def f(x):\n    return x\n", "\n\ndef f(x):  # a comment\n\n    return x\n"),
        ('def f(x):\n    """Old."""\n    return x\n', 'def f(x):\n    """New."""\n    return x\n'),
        ('def f(x):\n    """Old."""\n    x[0] = 1\n', 'def f(x):\n    """New."""\n    x[0] = 1\n'),
    ],
)
def test_comments_lines_and_docstrings_change_no_digest(first: str, second: str) -> None:
    assert kernel_digest(function(first)) == kernel_digest(function(second))


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("def f(x):\n    return x\n", "def f(x):\n    return x + 1\n"),
        ("def f(x):\n    return x + 1\n", "def f(x):\n    return x + 2\n"),
        ("def f(x):\n    return x + 1\n", "def f(x):\n    return x + 1.0\n"),
        ("def f(x):\n    return x * 0.0\n", "def f(x):\n    return x * -0.0\n"),
        ("def f(x, y):\n    return x\n", "def f(y, x):\n    return x\n"),
        ("def f(x=1):\n    return x\n", "def f(x=2):\n    return x\n"),
        ("def f(*, x=1):\n    return x\n", "def f(*, x=2):\n    return x\n"),
        ("def f(x):\n    return x.sin\n", "def f(x):\n    return x.cos\n"),
        ('def f(x):\n    """A."""\n    return "A."\n', 'def f(x):\n    """B."""\n    return "B."\n'),
        ("def f(x):\n    return [i + 1 for i in x]\n", "def f(x):\n    return [i + 2 for i in x]\n"),
    ],
)
def test_code_changes_a_digest(first: str, second: str) -> None:
    assert kernel_digest(function(first)) != kernel_digest(function(second))


def module_of(**names: Any) -> ModuleType:
    module = ModuleType("commission.other")
    vars(module).update(names)
    return module


FIXED = np.arange(4.0)


@pytest.mark.parametrize(
    ("source", "first", "second"),
    [
        ("def f():\n    return g\n", 1, 2),
        ("def f():\n    return g\n", True, 1),
        ("def f():\n    return g\n", (1, 2), (1, 3)),
        ("def f():\n    return g\n", frozenset({1, 2}), frozenset({1, 3})),
        ("def f():\n    return g\n", FIXED, FIXED + 1),
        ("def f():\n    return g\n", FIXED, FIXED.reshape(2, 2)),
        ("def f():\n    return g\n", FIXED, FIXED.astype(np.float32)),
        ("def f():\n    return g\n", np.float32(1), np.float64(1)),
        ("def f():\n    return g\n", Point(1.0), Point(2.0)),
        ("def f():\n    return g(1.0)\n", Point, NamedTuple("Point", [("y", float), ("x", float)])),
        ("def f():\n    return g.SLOW\n", Speed, enum.IntEnum("Speed", {"SLOW": 2, "FAST": 1})),
        ("def f():\n    return g\n", Speed.SLOW, Speed.FAST),
        ("def f():\n    return g.LIMIT\n", module_of(LIMIT=1.0), module_of(LIMIT=2.0)),
        ("def f():\n    return g(0)\n", float, int),
        ("def f():\n    return g(0)\n", np.float64, np.float32),
        (CALLER, function("def f(x):\n    return x\n"), function("def f(x):\n    return x + 1\n")),
        (
            "def f(x):\n    return g.step(x)\n",
            module_of(step=function("def f(x):\n    return x\n")),
            module_of(step=function("def f(x):\n    return x + 1\n")),
        ),
        (
            CALLER,
            function(CALLER, g=function("def f(x):\n    return x\n")),
            function(CALLER, g=function("def f(x):\n    return x + 1\n")),
        ),
    ],
)
def test_what_a_kernel_reads_changes_its_digest(source: str, first: Any, second: Any) -> None:
    assert kernel_digest(function(source, g=first)) == kernel_digest(function(source, g=first))
    assert kernel_digest(function(source, g=first)) != kernel_digest(function(source, g=second))


def test_what_a_kernel_does_not_read_changes_nothing() -> None:
    source = "def f():\n    return 1\n"
    assert kernel_digest(function(source, g=1)) == kernel_digest(function(source, g=2))


def test_kernels_that_call_each_other_have_digests() -> None:
    first, second = function(CALLER), function(CALLER)
    first.__globals__["g"], second.__globals__["g"] = second, first
    assert kernel_digest(first)


def test_global_whose_changes_would_go_unseen_is_refused() -> None:
    with pytest.raises(TypeError, match=r"commission\.example\.f reads a global of type builtins\.dict; expected"):
        kernel_digest(function("def f():\n    return g['a']\n", g={"a": 1}))


def test_package_that_is_tested_is_the_checkout() -> None:
    assert commission.__file__ == str(REPOSITORY / "commission" / "__init__.py")
