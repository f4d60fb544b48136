import functools
import os
import signal
import socket
import subprocess
import sys
import threading
import urllib.request

import pytest

FIRST_ANSWER = 30.0
"""Seconds until the address is printed; the machine may be busy with other tests."""


def serve(*words):
    """Start a command that serves; returns the process and the line that it prints first."""
    process = subprocess.Popen(
        [sys.executable, "-m", "commission", *(str(word) for word in words), "--no-open", "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A suite that runs in the background of a shell ignores Ctrl-C, and what it starts would inherit that.
        preexec_fn=functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509 - no threads here
    )
    too_late = threading.Timer(FIRST_ANSWER, process.kill)
    too_late.start()
    line = process.stdout.readline()
    too_late.cancel()
    return process, line


def closed(process):
    """Press Ctrl-C; returns exit code and what was said on stderr."""
    process.send_signal(signal.SIGINT)
    try:
        _, err = process.communicate(timeout=FIRST_ANSWER)
    finally:
        process.kill()
    return process.returncode, err


@pytest.mark.parametrize("with_recording", [False, True])
def test_serve_prints_its_address_answers_there_and_ends_well_on_ctrl_c(with_recording, project, recording):
    words = ["--recording", recording] if with_recording else []
    process, line = serve("serve", project, *words)
    try:
        assert line.startswith("page at http://127.0.0.1:"), line
        with urllib.request.urlopen(line.removeprefix("page at ").strip(), timeout=10) as answer:
            assert answer.status == 200
    finally:
        code, err = closed(process)
    assert (code, err) == (0, "")


def test_the_demo_of_every_bundled_site_opens(repository):
    for site in sorted(folder.name for folder in (repository / "maps").iterdir() if folder.is_dir()):
        process, line = serve("demo", "--site", site)
        code, err = closed(process)
        assert line.startswith("page at "), (site, line, err)
        assert (code, err) == (0, ""), site


def test_a_port_that_is_taken_is_refused(refused, project):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert str(port) in refused("serve", project, "--no-open", "--port", port)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--host", "0.0.0.0"], "expected a token"),
        (["--token", ""], "--token is empty"),
        (["--host", "no.such.host.invalid", "--token", "x"], "no.such.host.invalid"),
        (["--recording", os.devnull], "is no recording"),
        (["--recording", "nowhere"], "nowhere"),
    ],
)
def test_what_cannot_be_served_is_refused_at_once(words, said, refused, project):
    assert said in refused("serve", project, "--no-open", *words)


@pytest.mark.parametrize("exists", [False, True])
def test_a_folder_without_a_project_begins_one_and_nothing_is_written(tmp_path, exists):
    folder = tmp_path / "new hall"
    if exists:
        folder.mkdir()
        (folder / "notes.txt").write_text("of somebody else")
    process, line = serve("serve", folder)
    code, err = closed(process)
    assert line.startswith("page at http://127.0.0.1:"), line
    assert (code, err) == (0, "")
    assert [path.name for path in tmp_path.rglob("*")] == (["new hall", "notes.txt"] if exists else [])


def test_a_file_that_is_no_project_is_refused(refused, tmp_path):
    (tmp_path / "notes.txt").write_text("name: hall")
    assert "notes.txt: is a file; expected the folder of a project" in refused(
        "serve", tmp_path / "notes.txt", "--no-open"
    )
    assert "is no folder" in refused("serve", tmp_path / "notes.txt" / "project.yaml", "--no-open")
