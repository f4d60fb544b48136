"""The command `monitor` on recordings of a hall whose reflectors have changed."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from commission.cli.monitor import MonitorCommand
from commission.errors import UsageError
from commission.io.project_copy import save_copy
from commission.io.project_file import load_project
from commission.io.recordings.csv_writer import write_recording
from commission.site.reflectors import ReflectorMap
from tests.studies.test_monitor import driven, hall, site


def test_monitor_tells_what_was_moved_and_writes_the_corrected_project(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = ReflectorMap(tuple(replace(each, locked=each.id == "L3") for each in site().reflectors.reflectors))
    save_copy(replace(site(), reflectors=kept), tmp_path / "site", force=False)
    write_recording(tmp_path / "friday", driven(hall(L1=True, L3=None), 2).records())
    command = MonitorCommand(
        project=tmp_path / "site",
        recordings=(tmp_path / "friday",),
        out=tmp_path / "found.csv",
        corrected_project=tmp_path / "corrected",
    )
    command.run()
    told = capsys.readouterr().out
    assert "Found        L1 has moved by" in told
    assert "Found        L3 is missing" in told
    rows = list(csv.DictReader((tmp_path / "found.csv").read_text().splitlines()))
    assert [(row["id"], row["fault"]) for row in rows] == [("L1", "moved"), ("L3", "missing")]
    assert float(rows[0]["x"]) - float(rows[0]["x_before"]) == pytest.approx(0.06, abs=0.012)
    after = {each.id: each for each in load_project(tmp_path / "corrected").reflectors.reflectors}
    # A locked one stays, and that it does is told.
    assert "L3" in after
    assert "As it was    L3: it is locked and stays" in told
    assert after["L1"].x == pytest.approx(float(rows[0]["x"]), abs=1e-4)
    # Nothing that is there is overwritten unasked.
    with pytest.raises(UsageError, match=r"found\.csv exists"):
        command.run()
    # Of many recordings the one that says nothing is named.
    swapped = ReflectorMap(tuple(replace(each, x=each.y, y=each.x) for each in site().reflectors.reflectors))
    write_recording(tmp_path / "elsewhere", driven(swapped, 2).records())
    with pytest.raises(UsageError, match=r"elsewhere: "):
        replace(command, recordings=(tmp_path / "elsewhere",), out=None, corrected_project=None).run()
