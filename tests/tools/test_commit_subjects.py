"""The check of commit subjects, which the test command and a hook of git run."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from tests.tools.commit_subjects import LONGEST, faults, main, subject_of, subjects_since

AUTHOR = {f"GIT_{who}_{what}": "someone@example.org" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}


def git(folder: Path, *words: str) -> str:
    """Run git in a folder, without the settings of this computer."""
    environment = {**os.environ, **AUTHOR, "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull}
    return subprocess.run(
        ["git", "-C", str(folder), *words], env=environment, capture_output=True, text=True, check=True
    ).stdout


def test_seventy_two_characters_fit_and_one_more_does_not() -> None:
    assert faults(["x" * LONGEST]) == []
    (fault,) = faults(["x" * LONGEST, "x" * (LONGEST + 1)])
    assert fault.startswith("subject of 73 characters; expected at most 72: xxx")


def test_commits_after_a_commit_are_read(tmp_path: Path) -> None:
    git(tmp_path, "init", "--quiet")
    for subject in ("First", "Second", "Third"):
        git(tmp_path, "commit", "--quiet", "--allow-empty", "-m", f"{subject}\n\nIts reason.")
    first = git(tmp_path, "rev-list", "--max-parents=0", "HEAD").strip()
    assert [line.partition(" ")[2] for line in subjects_since(first, tmp_path) or ()] == ["Third", "Second"]


def test_a_folder_without_history_is_no_fault(tmp_path: Path) -> None:
    assert subjects_since("6a7952b", tmp_path) is None


@pytest.mark.parametrize(("length", "code"), [(LONGEST, 0), (LONGEST + 1, 1)])
def test_hook_judges_the_first_line_of_a_message(tmp_path: Path, length: int, code: int) -> None:
    path = tmp_path / "COMMIT_EDITMSG"
    path.write_text(f"\n# Please enter the commit message\n{'x' * length}\n\n{'y' * 100}\n")
    assert main([str(path)]) == code


def test_message_without_a_line_has_an_empty_subject() -> None:
    assert subject_of("# only comments\n\n") == ""
