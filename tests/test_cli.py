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
