"""Every benchmark at an earlier commit and now, in turns on one machine in one sitting, and the ratios of their times.

    python -m tests.benchmarks.before_and_after COMMIT [WORD ...] [--rounds 3] [--tree FOLDER]

Words choose the benchmarks whose names hold one of them. The earlier commit is checked out into a temporary folder, or
is what lies in FOLDER. Each round runs a benchmark there and here, one right after the other, so that what else the
machine does hits both; of all rounds the best counts. Ratios are times now over times before: above 1 is slower. A line
that only one of the two prints has no ratio. Beside nothing else that runs: half an hour to an hour with all of them.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
ARGUMENTS = {
    "bench_filter": ("100000",),
    "bench_page": ("10",),
    "bench_placement": ("2", "16"),
    "bench_prediction": ("12",),
}
"""What shortens a benchmark whose figures are many drives, not times."""
LONGEST_S = 1800.0

COSTS = ("us/cycle", "us/scan", "us per scan", "us", "ms", "s", "% of one core")
RATES = ("Mrays/s", "heatmaps/s", "x real time")
_FIGURE = re.compile(r"(?<![\w.])(\d[\d,]*\.?\d*) ?(" + "|".join(map(re.escape, COSTS + RATES)) + r")(?![\w/])")
_MEASURED = re.compile(r"\d[\d,]*\.\d+")
"""A number without one of the units: what has decimals was measured, what has none is part of the label."""


@dataclass(frozen=True, slots=True)
class Figure:
    """One time or rate that a benchmark printed."""

    label: str
    """Text of the line before it, without other figures."""
    value: float
    unit: str

    @property
    def is_rate(self) -> bool:
        """Whether more is better."""
        return self.unit in RATES


def figures(output: str) -> list[Figure]:
    """Times and rates in what a benchmark printed, each with a label that does not depend on the others."""
    found: list[Figure] = []
    for line in output.splitlines():
        for match in _FIGURE.finditer(line):
            before = _MEASURED.sub("", _FIGURE.sub("", line[: match.start()]))
            label = " ".join(re.sub(r"[^\w ,%/.-]+", " ", before).split())
            found.append(Figure(label[-60:].strip(" ,"), float(match[1].replace(",", "")), match[2]))
    return found


def best(runs: Sequence[Sequence[Figure]]) -> dict[tuple[str, str, int], Figure]:
    """Best of several runs by label, unit and how often that label came before in its run."""
    found: dict[tuple[str, str, int], Figure] = {}
    for run in runs:
        seen: dict[tuple[str, str], int] = defaultdict(int)
        for figure in run:
            key = (figure.label, figure.unit, seen[figure.label, figure.unit])
            seen[figure.label, figure.unit] += 1
            other = found.get(key)
            better = other is None or (figure.value > other.value if figure.is_rate else figure.value < other.value)
            if better:
                found[key] = figure
    return found


def rows(name: str, before: Sequence[Sequence[Figure]], now: Sequence[Sequence[Figure]]) -> Iterator[str]:
    """One row of the table for each figure that both print, then one for each that only one of them does."""
    old, new = best(before), best(now)
    for key, figure in new.items():
        if (other := old.get(key)) is not None and figure.value > 0.0 and other.value > 0.0:
            ratio = other.value / figure.value if figure.is_rate else figure.value / other.value
            yield f"| {name} | {figure.label} | {other.value:g} {figure.unit} | {figure.value:g} | {ratio:.2f} |"
    for key, figure in new.items():
        if key not in old:
            yield f"| {name} | {figure.label} | | {figure.value:g} {figure.unit} | |"
    for key, figure in old.items():
        if key not in new:
            yield f"| {name} | {figure.label} | {figure.value:g} {figure.unit} | | |"


def run(tree: Path, name: str) -> str:
    """Output of a benchmark of a checkout; empty, after a line that says so, when it has none or it fails."""
    if not (tree / "tests" / "benchmarks" / f"{name}.py").exists():
        return ""
    command = [sys.executable, "-m", f"tests.benchmarks.{name}", *ARGUMENTS.get(name, ())]
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    try:
        done = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, text=True, timeout=LONGEST_S, check=False
        )
    except subprocess.TimeoutExpired:
        print(f"{tree}: {name} took longer than {LONGEST_S:g} s", flush=True)
        return ""
    if done.returncode != 0:
        last = (done.stderr or done.stdout).strip().splitlines()[-1:]
        print(f"{tree}: {name} ended with {done.returncode}: {''.join(last)}", flush=True)
    return done.stdout


@contextmanager
def checkout(commit: str) -> Iterator[Path]:
    """Put a commit into a temporary folder, beside which the data of others can be found."""
    git = ("git", "-C", str(REPOSITORY))
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "before"
        subprocess.run([*git, "worktree", "add", "--quiet", "--detach", str(tree), commit], check=True)
        if (REPOSITORY.parent / "shared").exists():
            (Path(folder) / "shared").symlink_to((REPOSITORY.parent / "shared").resolve())
        try:
            yield tree
        finally:
            subprocess.run([*git, "worktree", "remove", "--force", str(tree)], check=True)


def compare(before: Path, words: Sequence[str], rounds: int) -> None:
    """Run and print everything."""
    names = {path.stem for tree in (before, REPOSITORY) for path in (tree / "tests" / "benchmarks").glob("bench_*.py")}
    chosen = sorted(name for name in names if not words or any(word in name for word in words))
    print("| benchmark | what | before | now | now / before |\n|---|---|---|---|---|", flush=True)
    for name in chosen:
        runs: tuple[list[list[Figure]], list[list[Figure]]] = ([], [])
        for _ in range(rounds):
            for tree, found in zip((before, REPOSITORY), runs, strict=True):
                found.append(figures(run(tree, name)))
        for row in rows(name, *runs):
            print(row, flush=True)


def main(arguments: Sequence[str]) -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commit", help="what to compare with")
    parser.add_argument("words", nargs="*", help="run the benchmarks whose names hold one of them; none: all")
    parser.add_argument("--rounds", type=int, default=3, help="how often each is run on both sides")
    parser.add_argument("--tree", type=Path, help="a checkout of the commit; none: one is made and removed")
    given = parser.parse_intermixed_args(arguments)
    if given.tree is not None:
        compare(given.tree.resolve(), given.words, given.rounds)
        return
    with checkout(given.commit) as tree:
        compare(tree, given.words, given.rounds)


if __name__ == "__main__":
    main(sys.argv[1:])
