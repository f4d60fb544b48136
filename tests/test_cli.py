import os
import subprocess
import sys
from pathlib import Path

import pytest

import commission
from commission import cli
from commission.errors import FileFormatError


def run(arguments):
    with pytest.raises(SystemExit) as finished:
        cli.main(arguments)
    return finished.value.code


def test_version_is_printed_and_the_command_succeeds(capsys):
    assert run(["version"]) == 0
    assert capsys.readouterr().out == f"commission {commission.__version__}\n"


@pytest.mark.parametrize("arguments", [["no-such-command"], ["version", "--no-such-option"], []])
def test_bad_arguments_exit_with_two_and_say_something_on_stderr(arguments, capsys):
    assert run(arguments) == 2
    assert capsys.readouterr().err


def test_help_succeeds_and_names_the_commands(capsys):
    assert run(["--help"]) == 0
    assert "version" in capsys.readouterr().out


def test_an_error_of_the_tree_becomes_one_line_and_exit_code_two(monkeypatch, capsys):
    def broken() -> None:
        raise FileFormatError("hall.yaml", "resolution", "is\n0", "metres per pixel > 0")

    monkeypatch.setitem(cli.COMMANDS, "broken", broken)
    assert run(["broken"]) == 2
    assert capsys.readouterr().err == "commission: hall.yaml: resolution: is 0; expected metres per pixel > 0\n"


def test_installed_command_runs_outside_the_checkout_and_has_its_folders(tmp_path):
    python = Path(sys.executable)
    command = python.with_name("commission")
    if not command.is_file():
        reason = f"commission is not installed in {python.parent}: `bash tests/run` installs it"
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    finished = subprocess.run(
        [command, "version"], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60, check=True
    )
    assert finished.stdout == f"commission {commission.__version__}\n"
    question = "from commission.io.bundled import bundled_folder as f; print(f('maps')); print(f('web_assets'))"
    finished = subprocess.run(
        [python, "-c", question], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60, check=True
    )
    for line in finished.stdout.split():
        assert "_data" in line
        assert any(Path(line).iterdir())
