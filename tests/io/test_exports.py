from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest

from commission.errors import FileFormatError, UsageError
from commission.io.exports import Format, export, safe_stem
from commission.io.project_file import load_project
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from tests.app.sites import room


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("Hall 3", "Hall_3"),
        ("Müller & Söhne", "Muller_Sohne"),
        ("../../etc/passwd", "etc_passwd"),
        ("<script>alert(1)</script>", "script_alert_1_script"),
        ("工場", "site"),
        ("..", "site"),
        ("x" * 200, "x" * 48),
    ],
)
def test_name_of_a_file_holds_nothing_but_letters_digits_and_dashes(name: str, stem: str) -> None:
    assert safe_stem(name) == stem


def test_project_goes_out_as_a_zip_that_unpacks_into_the_same_project(tmp_path: Path) -> None:
    made = export(room(), Format.PROJECT)
    assert made.name == "Room.zip"
    with zipfile.ZipFile(io.BytesIO(made.content)) as archive:
        assert sorted(archive.namelist()) == [
            "Room/map.png",
            "Room/map.yaml",
            "Room/project.yaml",
            "Room/reflectors.csv",
        ]
        archive.extractall(tmp_path)
    assert load_project(tmp_path / "Room") == room()


def test_each_format_says_what_it_cannot_carry() -> None:
    project = Project(name="Hall", reflectors=ReflectorMap((Reflector(id="north", x=0.0004, y=2.0, note="pillar"),)))
    assert export(project, Format.TABLE).losses == ()
    losses = export(project, Format.IMK).losses
    assert "note of 1 reflector is not carried by the format" in losses
    assert any("ids become numbers" in loss for loss in losses)
    layout = export(room(), Format.LIF)
    assert layout.name == "Room.lif"
    assert "4 reflectors are not carried: LIF knows no localization" in layout.losses
    assert "the floor map is not carried" in layout.losses


@pytest.mark.parametrize("wanted", [Format.TABLE, Format.IMK, Format.LIF])
def test_nothing_is_written_of_nothing(wanted: Format) -> None:
    with pytest.raises(UsageError, match="there are no"):
        export(Project(), wanted)


def test_work_can_be_stopped() -> None:
    class Stopped(Exception):
        pass

    def stop(_fraction: float, _message: str) -> None:
        raise Stopped

    with pytest.raises(Stopped):
        export(room(), Format.PROJECT, progress=stop)


def test_what_a_format_cannot_hold_is_one_line_that_names_the_file() -> None:
    far = Project(name="Hall", reflectors=ReflectorMap((Reflector(id="1", x=3e6, y=0.0),)))
    with pytest.raises(FileFormatError, match=r"^Hall.imk: reflector '1': x is 3e\+06 m; expected at most 2147483 m$"):
        export(far, Format.IMK)
