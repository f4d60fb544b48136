"""`localize` says what it had to mend of a recording."""

from __future__ import annotations

from pathlib import Path

from commission.io.project_file import save_project
from tests.studies.recorded import PROJECT

TABLES = {
    "odometry.csv": "stamp_ns,dx,dy,dtheta\n0,0,0,0\n1000000000,0,0,0\n1000000000,0,0,0\n",
    "detections.csv": "stamp_ns,range,bearing\n1000000000,5,0\n",
}


def test_rows_of_one_stamp_are_noted(tmp_path: Path, commission) -> None:
    save_project(PROJECT, tmp_path / "site")
    (tmp_path / "drive").mkdir()
    for name, text in TABLES.items():
        (tmp_path / "drive" / name).write_text(text, encoding="utf-8")
    code, told, _ = commission(
        "localize", tmp_path / "site", tmp_path / "drive", "--out", tmp_path / "out", "--initial-pose", "0,0,0"
    )
    assert code == 0
    assert "Note         odometry.csv: 1 rows have a stamp that is taken and are one motion after the other" in told
