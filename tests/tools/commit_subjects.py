"""Check that the subject of each commit fits into one line of `git log`: at most 72 characters.

Without arguments, all commits since the one from which this holds. With the file of a message, that message: so it is
called by the hook `commit-msg` of `.pre-commit-config.yaml`.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

LONGEST = 72
SINCE = "6a7952b"
"""The last commit before the rule."""


def subjects_since(commit: str, repository: Path) -> list[str] | None:
    """Subjects of all commits after one; None where git does not know it (an archive, a shallow clone, no git)."""
    command = ["git", "-C", str(repository), "log", "--format=%h %s", f"{commit}..HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return None
    return done.stdout.splitlines() if done.returncode == 0 else None


def subject_of(message: str) -> str:
    """First line of a message that is being written; its comments are git's."""
    return next((line for line in message.splitlines() if line.strip() and not line.startswith("#")), "")


def faults(subjects: Iterable[str]) -> list[str]:
    """One line for each subject that is too long."""
    return [f"subject of {len(s)} characters; expected at most {LONGEST}: {s}" for s in subjects if len(s) > LONGEST]


def main(arguments: list[str]) -> int:
    """Return the exit code, after a line for each fault."""
    if arguments:
        found = faults([subject_of(Path(arguments[0]).read_text(encoding="utf-8"))])
    else:
        logged = subjects_since(SINCE, Path(__file__).resolve().parents[2])
        if logged is None:
            sys.stdout.write(f"not checked: git does not know commit {SINCE} here\n")
            return 0
        found = faults(line.partition(" ")[2] for line in logged)
    sys.stderr.writelines(f"{fault}\n" for fault in found)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
