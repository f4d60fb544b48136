"""What the README tells a newcomer to type does what it says."""

import json
import re
import shlex
from pathlib import Path

import pytest

from commission import cli
from commission.cli import parsing
from commission.cli.localize import Localize
from commission.cli.simulate import Simulate
from tests.conftest import REPOSITORY

README = (REPOSITORY / "README.md").read_text(encoding="utf-8")
COMMANDS = [shlex.split(line)[1:] for line in README.splitlines() if line.startswith("    commission ")]


def test_the_readme_shows_the_two_commands_to_begin_with():
    assert "python3 -m venv .venv && .venv/bin/pip install . && .venv/bin/commission demo\n" in README
    assert "    bash tests/run\n" in README


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_every_command_line_in_the_readme_is_understood(words):
    parsing.parse(cli.COMMANDS, words)


def test_the_command_lines_that_end_by_themselves_succeed_one_after_the_other(tmp_path, monkeypatch, capsys):
    (tmp_path / "maps").symlink_to(REPOSITORY / "maps")
    monkeypatch.chdir(tmp_path)
    ran = [words for words in COMMANDS if isinstance(parsing.parse(cli.COMMANDS, words), Simulate | Localize)]
    assert len(ran) >= 4
    for words in ran:
        with pytest.raises(SystemExit) as finished:
            cli.main(words)
        assert (finished.value.code, capsys.readouterr().err) == (0, ""), words
    shown = json.loads(Path("result/summary.json").read_text(encoding="utf-8"))
    assert [key for key in shown if f"`{key}`" not in README] == []
    told = re.search(r"position ([0-9.]+) mm RMS.*?([0-9.]+) at most", README)
    assert told
    # One drive is an example: whoever changes a draw of the simulation need not change the README, unless it misleads.
    assert shown["position_rmse_m"] * 1e3 == pytest.approx(float(told[1]), rel=0.25)
    assert shown["position_max_m"] * 1e3 == pytest.approx(float(told[2]), rel=0.5)


def test_files_that_the_readme_names_exist():
    named = set(re.findall(r"`((?:tests|maps|commission|web_assets)/[\w./-]+)`", README))
    named |= set(re.findall(r"\]\(([\w./-]+)\)", README))
    assert [name for name in sorted(named) if not (REPOSITORY / name).exists()] == []
