"""Compiled kernels are kept on disk exactly as long as nothing that they depend on changes.

Each test runs programs of its own on a small package of kernels.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.compiled.small_package import ALL, LOOPS_SCRIPT, SCRIPT, VALUES, SmallPackage, outcome_of


@pytest.fixture(scope="module")
def filled_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Cache of the package as it is written."""
    cache = tmp_path_factory.mktemp("cache")
    outcome = SmallPackage(tmp_path_factory.mktemp("package")).run(cache)
    assert (outcome.values, outcome.compiled) == (VALUES, ALL)
    return cache


def test_second_start_compiles_nothing(tmp_path: Path, filled_cache: Path) -> None:
    # Another folder stands for another checkout or an installed wheel.
    outcome = SmallPackage(tmp_path).run(filled_cache)
    assert (outcome.values, outcome.compiled) == (VALUES, [])
    assert outcome.loaded == ALL


def test_edit_of_comments_and_docstrings_compiles_nothing(tmp_path: Path, filled_cache: Path) -> None:
    package = SmallPackage(tmp_path)
    package.edit("angles.py", "# at four", "# at four,\n    # as is usual here")
    package.edit("angles.py", "Wrap.", "Wrap an angle\n\n    to [0, 4).\n    ")
    package.edit("steps.py", '"""Steps of a filter."""', '"""All steps of a filter."""\n\n# They call each other.\n')
    for name in ("Correct", "Predict", "Fill"):
        package.edit("steps.py", f'"""{name}."""', f'"""{name} it."""\n    # Why.\n')
    outcome = package.run(filled_cache)
    assert (outcome.values, outcome.compiled) == (VALUES, [])


@pytest.mark.parametrize(
    ("module", "old", "new", "compiled", "changed"),
    [
        ("steps.py", "state.x + 7.0", "state.x + 8.0", ["predict", "run"], {0: 3.5, 1: 2.0}),
        ("angles.py", "angle % TURN", "angle % TURN + 1.0", ["predict", "run", "wrap"], {0: 3.5, 1: 2.0, 4: 2.0}),
        ("angles.py", "TURN = 4.0", "TURN = 5.0", ["predict", "run", "wrap"], {0: 5.5, 1: 4.0, 4: 0.0}),
        ("angles.py", "compiled_inline", "compiled", ["predict", "run", "wrap"], {}),
        ("constants.py", "LIMIT = 3.0", "LIMIT = 4.0", ["correct", "run"], {0: 3.0, 2: 2.0}),
        ("constants.py", "FACTOR = 10.0", "FACTOR = 100.0", ["scaled"], {3: 200.0}),
        ("steps.py", "gain=0.5", "gain=1.0", ["correct", "run"], {0: 4.0, 2: 3.0}),
        ("steps.py", "    x: float\n    y: float\n", "    y: float\n    x: float\n", ["correct", "predict", "run"], {}),
    ],
    ids=[
        "body",
        "inlined-kernel",
        "constant-of-the-same-module",
        "compiler-option",
        "constant-by-name",
        "constant-through-module",
        "default-argument",
        "order-of-fields-of-an-argument",
    ],
)
def test_edit_compiles_what_depends_on_it_and_nothing_else(
    tmp_path: Path, filled_cache: Path, module: str, old: str, new: str, compiled: list[str], changed: dict[int, float]
) -> None:
    package = SmallPackage(tmp_path)
    package.edit(module, old, new)
    outcome = package.run(filled_cache)
    expected = [changed.get(i, value) for i, value in enumerate(VALUES)]
    assert (outcome.values, outcome.compiled) == (expected, compiled)


def test_step_of_another_kernel_has_no_entry_for_python_until_python_calls_it(tmp_path: Path) -> None:
    script = """
import json
from commission import angles, steps
found, alone = [steps.predict(steps.State(x=2.0, y=5.0))], []
for call in (lambda: None, lambda: found.append(angles.wrap(5.0))):
    call()
    alone.append(hasattr(angles.wrap, "alone"))
print(json.dumps({"values": found, "compiled": alone, "loaded": []}))
"""
    package = SmallPackage(tmp_path / "package")
    # The second program finds both in the cache.
    for _ in range(2):
        outcome = package.run(tmp_path / "cache", script)
        assert (outcome.values, outcome.compiled) == ([1.0, 1.0], [False, True])


def test_kernel_on_all_cores_is_cached_too(tmp_path: Path) -> None:
    package, cache = SmallPackage(tmp_path / "package"), tmp_path / "cache"
    for compiled in (["doubled"], []):
        outcome = package.run(cache, LOOPS_SCRIPT)
        assert (outcome.values, outcome.compiled) == ([0.0, 2.0, 4.0], compiled)
    package.edit("loops.py", "2.0 * values", "3.0 * values")
    outcome = package.run(cache, LOOPS_SCRIPT)
    assert (outcome.values, outcome.compiled) == ([0.0, 3.0, 6.0], ["doubled"])


def test_way_back_compiles_nothing(tmp_path: Path) -> None:
    package, cache = SmallPackage(tmp_path / "package"), tmp_path / "cache"
    package.run(cache)
    package.edit("angles.py", "TURN = 4.0", "TURN = 5.0")
    package.run(cache)
    package.edit("angles.py", "TURN = 5.0", "TURN = 4.0")
    outcome = package.run(cache)
    assert (outcome.values, outcome.compiled) == (VALUES, [])


def test_programs_that_start_at_once_share_one_empty_cache(tmp_path: Path) -> None:
    package, cache = SmallPackage(tmp_path / "package"), tmp_path / "cache"
    programs = [package.start(cache) for _ in range(3)]
    assert [outcome_of(program).values for program in programs] == [VALUES] * 3
    last = package.run(cache)
    assert (last.values, last.compiled) == (VALUES, [])
    assert not list(cache.rglob("*.tmp"))


def test_damaged_files_are_compiled_anew(tmp_path: Path) -> None:
    package, cache = SmallPackage(tmp_path / "package"), tmp_path / "cache"
    package.run(cache)
    for i, path in enumerate(sorted(cache.rglob("*.kernel"))):
        content = path.read_bytes()
        path.write_bytes((b"", content[: len(content) // 2], b"\0" * len(content))[i % 3])
    outcome = package.run(cache)
    assert (outcome.values, outcome.compiled) == (VALUES, ALL)
    assert package.run(cache).compiled == []


READ_ONLY = """
import errno, os, sys
def refuse(event, arguments):
    path = str(arguments[0]) if arguments else ""
    writes = event in ("os.mkdir", "os.rename", "os.remove", "os.utime", "os.chmod") or (
        event == "open" and arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
    )
    if writes and path.startswith(os.environ["NUMBA_CACHE_DIR"]):
        raise OSError(errno.EROFS, "Read-only file system", path)
sys.addaudithook(refuse)
"""
"""Stands for a read-only file system: the tests may run as root, whom permissions do not stop."""


def test_read_only_cache_is_read(tmp_path: Path, filled_cache: Path) -> None:
    outcome = SmallPackage(tmp_path).run(filled_cache, READ_ONLY + SCRIPT)
    assert (outcome.values, outcome.compiled) == (VALUES, [])


def test_temporary_folder_keeps_what_a_read_only_cache_cannot(tmp_path: Path) -> None:
    package, temporary = SmallPackage(tmp_path / "package"), tmp_path / "tmp"
    temporary.mkdir()
    for compiled in (ALL, []):
        outcome = package.run(tmp_path / "cache", READ_ONLY + SCRIPT, TMPDIR=str(temporary))
        assert (outcome.values, outcome.compiled) == (VALUES, compiled)
    assert not (tmp_path / "cache").exists()


def test_stepping_through_kernels_compiles_nothing_and_touches_no_file(tmp_path: Path) -> None:
    package, cache = SmallPackage(tmp_path / "package"), tmp_path / "cache"
    outcome = package.run(cache, NUMBA_DISABLE_JIT="1")
    assert (outcome.values, outcome.compiled) == (VALUES, [])
    assert not cache.exists()


def test_import_reads_and_writes_no_cache(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    script = 'from commission import steps\nprint(\'{"values": [], "compiled": [], "loaded": []}\')'
    SmallPackage(tmp_path / "package").run(cache, script)
    assert not cache.exists()


def test_checks_of_bounds_are_compiled_apart(tmp_path: Path, filled_cache: Path) -> None:
    outcome = SmallPackage(tmp_path).run(filled_cache, NUMBA_BOUNDSCHECK="1")
    assert (outcome.values, outcome.compiled) == (VALUES, ALL)
