import functools
import os
import signal
import socket
import subprocess
import sys
import threading
import urllib.error
import urllib.parse
import urllib.request

import pytest

from tests.conftest import REPOSITORY, few_of

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


SITES = sorted(folder.name for folder in (REPOSITORY / "maps").iterdir() if folder.is_dir())


@pytest.mark.parametrize("site", few_of(SITES, ("warehouse",)))
def test_the_demo_of_every_bundled_site_opens(site):
    process, line = serve("demo", "--site", site)
    code, err = closed(process)
    assert line.startswith("page at "), (line, err)
    assert (code, err) == (0, "")


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
        (["--token", "fifteen letters"], "the token has 15 letters; expected at least 16"),
        (["--token", "auto", "--token-file", "token"], "both --token and --token-file are given"),
        (["--token-file", "nowhere"], "nowhere: no such file or directory"),
        (["--public-url", "https://agv.example.com"], "expected a token"),
        (["--public-url", "agv.example.com", "--token", "auto"], "expected https://name"),
        (["--host", "no.such.host.invalid", "--token", "auto"], "no.such.host.invalid"),
        (["--recording", os.devnull], "is no recording"),
        (["--recording", "nowhere"], "nowhere"),
    ],
)
def test_what_cannot_be_served_is_refused_at_once(words, said, refused, project):
    assert said in refused("serve", project, "--no-open", *words)


def test_a_token_that_the_program_makes_is_printed_and_lets_in(project):
    process, line = serve("serve", project, "--token", "auto")
    try:
        address = line.removeprefix("page at ").strip()
        assert "?token=" in address
        assert len(address.partition("?token=")[2]) >= 32
        with urllib.request.urlopen(address, timeout=10) as answer:
            assert "Set-Cookie" in answer.headers
        with pytest.raises(urllib.error.HTTPError, match="401"):
            urllib.request.urlopen(address.partition("?")[0], timeout=10)
    finally:
        code, err = closed(process)
    assert (code, err) == (0, "")


@pytest.mark.parametrize("way", ["--token", "--token-file", "environment"])
def test_a_token_that_was_given_is_not_printed(way, project, tmp_path, monkeypatch):
    secret = "a secret of sixteen letters"
    file = tmp_path / "token"
    file.write_text(secret)
    file.chmod(0o600)
    if way == "environment":
        monkeypatch.setenv("COMMISSION_TOKEN", secret)
    process, line = serve("serve", project, *{"--token": [way, secret], "--token-file": [way, file]}.get(way, []))
    try:
        address = line.removeprefix("page at ").partition("?token=...")[0]
        assert secret not in line
        with urllib.request.urlopen(f"{address}?token={urllib.parse.quote(secret)}", timeout=10) as answer:
            assert answer.status == 200
    finally:
        code, err = closed(process)
    assert (code, err) == (0, "")


def test_who_lets_others_in_is_told_that_the_token_can_be_read_and_by_which_address_they_come(project):
    process, line = serve("serve", project, "--host", "0.0.0.0", "--token", "auto")
    code, err = closed(process)
    assert code == 0
    assert err.count("\n") == 1
    assert "anyone on this network can read the token, since there is no TLS" in err
    assert "0.0.0.0" not in line


def test_behind_a_proxy_its_address_is_printed(project):
    process, line = serve("serve", project, "--public-url", "https://agv.example.com", "--token", "auto")
    code, err = closed(process)
    assert line.startswith("page at https://agv.example.com/?token=")
    assert (code, err) == (0, "")


def test_an_address_of_version_six_is_printed_in_brackets(project):
    if not socket.has_ipv6:
        pytest.skip("this computer has no IPv6")
    process, line = serve("serve", project, "--host", "::1")
    try:
        assert line.startswith("page at http://[::1]:")
        with urllib.request.urlopen(line.removeprefix("page at ").strip(), timeout=10) as answer:
            assert answer.status == 200
    finally:
        closed(process)


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
