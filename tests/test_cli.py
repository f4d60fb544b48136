import os
import re
import subprocess
import sys
from dataclasses import dataclass

import pytest

import commission
from commission import cli
from commission.cli import parsing
from commission.errors import FileFormatError, UsageError

COMMANDS = tuple(cli.COMMANDS)


def run(arguments):
    with pytest.raises(SystemExit) as finished:
        cli.main(arguments)
    return finished.value.code


def complaint(capsys):
    """The one line on stderr."""
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("commission: ")
    assert not lines[0].startswith("commission: unexpected")
    return lines[0]


def test_version_is_printed_and_the_command_succeeds(capsys):
    assert run(["version"]) == 0
    assert capsys.readouterr().out == f"commission {commission.__version__}\n"


def test_help_succeeds_and_names_the_commands(capsys):
    assert run(["--help"]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself_and_each_of_its_options(name, capsys):
    assert run([name, "--help"]) == 0
    shown = capsys.readouterr()
    assert f"usage: commission {name}" in shown.out
    assert shown.err == ""


def test_help_does_not_wait_for_slow_packages():
    script = (
        "import sys\nfrom commission import cli\n"
        "try:\n    cli.main(['--help'])\nexcept SystemExit:\n    pass\n"
        "slow = {'numpy', 'scipy', 'numba', 'viser', 'trimesh', 'PIL'} & set(sys.modules)\n"
        "sys.exit(' '.join(sorted(slow)) or 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False)
    assert done.stderr == ""
    assert done.returncode == 0


def test_the_page_does_not_wait_for_what_only_some_files_need():
    script = (
        "import sys\nimport commission.cli.serve, commission.app.launch\n"
        "slow = {'scipy.stats', 'scipy.interpolate', 'matplotlib', 'trimesh', 'rosbags', 'ezdxf'} & set(sys.modules)\n"
        "sys.exit(' '.join(sorted(slow)) or 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False)
    assert done.stderr == ""
    assert done.returncode == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "Expected one of"),
        (["no-such-command"], "no-such-command"),
        (["version", "--no-such-option"], "--no-such-option"),
        (["serve"], "PATH"),
        (["serve", "hall", "--port", "http"], "--port"),
        (["serve", "hall", "--port", "70000"], "--port is 70000; expected 0 to 65535"),
        (["demo", "--site", "moon"], "no bundled site is called 'moon'; there are:"),
    ],
)
def test_a_bad_command_line_exits_with_two_and_one_line_that_says_what_is_wrong(arguments, said, capsys):
    assert run(arguments) == 2
    assert said in complaint(capsys)


@dataclass(frozen=True)
class _Broken:
    """Raise what the test wants."""

    def run(self):
        raise _Broken.error


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (
            FileFormatError("hall.yaml", "resolution", "is\n0", "metres per pixel > 0"),
            "commission: hall.yaml: resolution: is 0; expected metres per pixel > 0\n",
        ),
        (PermissionError(13, "Permission denied", "/out"), "commission: /out: Permission denied\n"),
        (
            KeyError("x"),
            "commission: a fault of the program (KeyError: 'x', test_cli.py line LINE); "
            "COMMISSION_TRACEBACK=1 shows more\n",
        ),
    ],
)
def test_an_error_becomes_one_line_and_exit_code_two(error, said, monkeypatch, capsys):
    monkeypatch.delenv(cli.SHOW_TRACEBACK, raising=False)
    monkeypatch.setattr(_Broken, "error", error, raising=False)
    monkeypatch.setitem(cli.COMMANDS, "broken", _Broken)
    assert run(["broken"]) == 2
    assert re.sub(r"line \d+", "line LINE", capsys.readouterr().err) == said


def test_an_unexpected_error_shows_its_origin_when_asked(monkeypatch):
    monkeypatch.setenv(cli.SHOW_TRACEBACK, "1")
    monkeypatch.setattr(_Broken, "error", KeyError("x"), raising=False)
    monkeypatch.setitem(cli.COMMANDS, "broken", _Broken)
    with pytest.raises(KeyError):
        cli.main(["broken"])


def test_an_interrupted_command_exits_as_a_shell_expects(monkeypatch):
    monkeypatch.setattr(_Broken, "error", KeyboardInterrupt(), raising=False)
    monkeypatch.setitem(cli.COMMANDS, "broken", _Broken)
    assert run(["broken"]) == 130


def test_the_module_and_the_command_are_the_same():
    done = subprocess.run(
        [sys.executable, "-m", "commission", "serve", "hall", "--port", "-1"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == "commission: --port is -1; expected 0 to 65535\n"


@pytest.mark.parametrize(
    ("text", "pose", "sigmas"),
    [
        ("-1,2,0.5", (-1.0, 2.0, 0.5), None),
        ("1e1, -2 ,3.5,0.01,0.02,0.03", (10.0, -2.0, 3.5), (0.01, 0.02, 0.03)),
    ],
)
def test_an_initial_pose_has_three_or_six_numbers(text, pose, sigmas):
    assert parsing.initial_pose(text) == parsing.InitialPose(pose, sigmas)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected numbers"),
        ("here", "expected numbers"),
        ("1,2", "has 2 numbers"),
        ("1,2,3,4", "has 4 numbers"),
        ("1,2,nan", "that no place has"),
        ("1,2,inf", "that no place has"),
        ("1e10,2,0", "that no place has"),
        ("1,2,3,0.1,0,0.1", "not positive"),
        ("1,2,3,0.1,-1,0.1", "not positive"),
        ("1;2;3", "expected numbers"),
    ],
)
def test_a_malformed_initial_pose_is_shown_with_the_form_expected(text, said):
    with pytest.raises(UsageError, match=said):
        parsing.initial_pose(text)


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="threads are counted in /proc, which only Linux has")
@pytest.mark.parametrize(("asked", "more"), [({}, 0), ({"OPENBLAS_NUM_THREADS": "3"}, 2)])
def test_small_matrices_occupy_one_core_unless_somebody_asks_for_more(asked, more):
    """Spread over all cores, matrices of a few dozen rows make threads wait for each other most of the time."""
    count = "import commission, numpy, os; print(len(os.listdir('/proc/self/task')))"
    plain = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    said = subprocess.run([sys.executable, "-c", count], env=plain | asked, capture_output=True, text=True, check=True)
    # More threads than cores are never made.
    assert int(said.stdout) == 1 + min(more, (os.cpu_count() or 1) - 1)
