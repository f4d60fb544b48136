"""Puts deliberate faults into copies of the sources, one at a time, and tells which of them the tests see.

Run `python -m tests.tools.mutate` for all mutants of `tests.tools.mutants`, `--list` to see them, `-j 2` for two at a
time, or name some: `python -m tests.tools.mutate 'kalman' 'gate'` runs those whose file or name holds one of the words.
The checkout is only read. For maintainers; the test command merely checks that every mutant can still be made.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from tests.tools.mutants import MUTANTS, Mutant

REPOSITORY = Path(__file__).resolve().parents[2]
NEEDED = ("commission", "tests", "maps", "web_assets", "pyproject.toml", "README.md", "LICENSE")
"""What of the checkout the tests read."""
LONGEST = 900.0
"""A fault may make a loop endless: its tests are stopped after this time [s]."""


class Verdict(StrEnum):
    """What the tests made of a mutant."""

    KILLED = "killed"
    SURVIVED = "SURVIVED"
    BROKEN = "BROKEN"
    """The tests did not run to their end, which says nothing about them: a syntax error, or an endless loop."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Verdict with its reason."""

    verdict: Verdict
    seconds: float
    why: str = ""


def checked(mutants: Sequence[Mutant]) -> None:
    """Raise ValueError, with all that is wrong, unless every mutant can be made and has a name and tests."""
    names = [mutant.name for mutant in mutants]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"two mutants are called {twice[0]!r}; expected different names")
    if problems := [problem for mutant in mutants for problem in problems_with(mutant)]:
        raise ValueError("\n".join(problems))


def problems_with(mutant: Mutant) -> Iterator[str]:
    """Yield why a mutant cannot be made, or has no tests."""
    module = REPOSITORY / mutant.file
    source = module.read_text(encoding="utf-8") if module.is_file() else ""
    if mutant.find in source:
        mutant.applied_to(source)
    else:
        yield (
            f"{mutant.file} has no {mutant.find!r}; expected once, for the mutant {mutant.name!r} in "
            f"tests/tools/mutants. {where_else(mutant.find)}"
        )
    for test in mutant.tests:
        path, _, name = test.partition("::")
        file = REPOSITORY / path
        if not file.is_file() or f"def {name}(" not in file.read_text(encoding="utf-8"):
            yield f"{path} has no {name!r}; expected the test that sees {mutant.name!r}"


def where_else(text: str) -> str:
    """Say where a text that has moved stands now."""
    modules = sorted((REPOSITORY / "commission").rglob("*.py"))
    found = [path.relative_to(REPOSITORY).as_posix() for path in modules if text in path.read_text(encoding="utf-8")]
    return f"It stands in {', '.join(found)} now." if found else "It stands nowhere: name what stands there instead."


def copied(folder: Path) -> Path:
    """Copy what the tests need of the checkout."""
    tree = folder / "tree"
    for name in NEEDED:
        source = REPOSITORY / name
        if source.is_dir():
            shutil.copytree(source, tree / name, ignore=shutil.ignore_patterns("__pycache__", ".hypothesis"))
        else:
            shutil.copy2(source, tree / name)
    if (shared := REPOSITORY.parent / "shared").is_dir():
        (folder / "shared").symlink_to(shared.resolve())
    return tree


def environment(tree: Path) -> dict[str, str]:
    """Variables with which Python imports a tree.

    All trees share one folder of kernels, which are named by what goes into them: a fault compiles anew the kernels
    that it changes and those that call them, once. The engineer's own folder does not fill with faults.
    """
    kernels = Path(tempfile.gettempdir()) / "commission-mutants" / "kernels"
    return os.environ | {
        "PYTHONPATH": str(tree),
        "PYTHONDONTWRITEBYTECODE": "1",
        "NUMBA_CACHE_DIR": str(kernels),
    }


def ran(tree: Path, tests: Iterable[str]) -> tuple[int, str]:
    """Exit code and output of pytest over some tests of a tree."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-rfE",
        "-p",
        "no:cacheprovider",
        "--tb=line",
        "--hypothesis-seed=0",
        *tests,
    ]
    try:
        done = subprocess.run(
            command, cwd=tree, env=environment(tree), capture_output=True, text=True, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        return -1, f"stopped after {LONGEST:.0f} s"
    return done.returncode, done.stdout + done.stderr


def judged(mutant: Mutant) -> Outcome:
    """Put one fault into a copy of its own and run its tests there."""
    started = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="commission-mutant-") as name:
        folder = Path(name).resolve()
        tree = copied(folder)
        module = tree / mutant.file
        module.write_text(mutant.applied_to(module.read_text(encoding="utf-8")), encoding="utf-8")
        code, output = ran(tree, mutant.tests)
    seconds = time.monotonic() - started
    if code not in (0, 1):
        return Outcome(Verdict.BROKEN, seconds, output[-2000:])
    failed = set(re.findall(r"^(?:FAILED|ERROR) (\S+?)(?:\[.*)?(?: - .*)?$", output, re.MULTILINE))
    if passed := [test for test in mutant.tests if test not in failed]:
        return Outcome(Verdict.SURVIVED, seconds, "not seen by " + ", ".join(passed))
    return Outcome(Verdict.KILLED, seconds)


def chosen(words: Sequence[str]) -> list[Mutant]:
    """Mutants whose file or name holds one of the words; all without words."""
    return [each for each in MUTANTS if not words or any(word in each.file or word in each.name for word in words)]


def main() -> int:
    """Run the mutants that the command line asks for; 0 when all are killed."""
    parser = argparse.ArgumentParser(prog="python -m tests.tools.mutate", description=__doc__)
    parser.add_argument("words", nargs="*", help="only mutants whose file or name holds one of these")
    parser.add_argument("-l", "--list", action="store_true", help="list them and run nothing")
    parser.add_argument("-j", "--jobs", type=int, default=1, help="mutants at a time (default 1)")
    parser.add_argument("--unchecked", action="store_true", help="do not run the tests without a fault first")
    options = parser.parse_args()
    mutants = chosen(options.words)
    checked(mutants)
    if options.list:
        for mutant in mutants:
            print(f"{mutant.file}: {mutant.name}")
        print(f"{len(mutants)} mutants")
        return 0
    if not options.unchecked:
        code, output = ran(REPOSITORY, sorted({test for mutant in mutants for test in mutant.tests}))
        if code != 0:
            print(output, "tests fail without any fault; expected all to pass", sep="\n")
            return 2
    alive = 0
    with ThreadPoolExecutor(options.jobs) as pool:
        outcomes = pool.map(judged, mutants)
        for mutant, outcome in zip(mutants, outcomes, strict=True):
            print(f"{outcome.verdict:8} {outcome.seconds:5.0f} s  {mutant.file}: {mutant.name}", flush=True)
            if outcome.verdict is not Verdict.KILLED:
                alive += 1
                print(f"    {outcome.why}", flush=True)
    print(f"{len(mutants) - alive} of {len(mutants)} mutants killed")
    return 1 if alive else 0


if __name__ == "__main__":
    sys.exit(main())
