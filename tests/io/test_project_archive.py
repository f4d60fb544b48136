"""Projects that strangers send as a zip: what is taken, and what is refused before anything is unpacked."""

from __future__ import annotations

import io
import stat
import tracemalloc
import zipfile
from pathlib import Path

import pytest
from hypothesis import given, settings

from commission.errors import CommissionError, FileFormatError
from commission.io import project_archive
from commission.io.exports import Format, export
from commission.io.project_archive import read_project_archive
from commission.site.fields import in_file
from commission.site.project import Project
from tests.app.sites import room
from tests.io.projects import projects

MINIMAL = "schema: 1\nname: Hall\n"


def written(folder: Path, files: dict[str, str]) -> Path:
    path = folder / "hall.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return path


@given(project=projects().map(in_file))
@settings(max_examples=40)
def test_project_as_a_file_has_it_is_equal_when_it_is_exported_and_imported_again(
    tmp_path_factory: pytest.TempPathFactory, project: Project
) -> None:
    path = tmp_path_factory.mktemp("sent") / "hall.zip"
    path.write_bytes(export(project, Format.PROJECT).content)
    assert read_project_archive(path).project == project


@pytest.mark.parametrize("folder", ["", "hall/"])
def test_project_lies_at_the_top_or_in_a_folder_and_other_files_do_not_matter(tmp_path: Path, folder: str) -> None:
    files = {f"{folder}project.yaml": MINIMAL, "readme.txt": "x", f"{folder}notes/deep/a.txt": "x"}
    assert read_project_archive(written(tmp_path, files)).project == Project(name="Hall")


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"a.txt": "x"}, "holds no project.yaml; expected one, at the top or in a folder at the top"),
        ({"a/project.yaml": MINIMAL, "b/project.yaml": MINIMAL}, "holds 2 project.yaml"),
        ({"a/b/project.yaml": MINIMAL}, "holds no project.yaml"),
        ({"project.yaml": MINIMAL, "../evil.txt": "x"}, "holds '../evil.txt'; expected names that stay inside"),
        ({"project.yaml": MINIMAL, "/etc/cron.d/evil": "x"}, "holds '/etc/cron.d/evil'"),
        ({"project.yaml": MINIMAL, "a/../../evil": "x"}, "holds 'a/../../evil'"),
        ({"project.yaml": MINIMAL, "..\\evil": "x"}, "names that stay inside its folder"),
        ({"project.yaml": MINIMAL, "C:evil": "x"}, "holds 'C:evil'"),
        ({"project.yaml": MINIMAL, "./project.yaml": MINIMAL}, "twice"),
        ({}, "holds 0 files; expected 1 to 200"),
        ({"project.yaml": MINIMAL, **{f"{i}.txt": "" for i in range(200)}}, "holds 201 files; expected 1 to 200"),
        (
            {"project.yaml": f"{MINIMAL}floor_map: ../../../etc/hostname\n"},
            "project.yaml, line 3, floor_map: '../../../etc/hostname' leads out of the folder",
        ),
        (
            {"project.yaml": f"{MINIMAL}reflectors: /etc/passwd\n"},
            "project.yaml, line 3, reflectors: '/etc/passwd' leads out of the folder",
        ),
        (
            {
                "project.yaml": f"{MINIMAL}floor_map: map.yaml\n",
                "map.yaml": "image: ../../x.png\nresolution: 0.05\norigin: [0, 0, 0]\n",
            },
            "map.yaml, line 1, image: '../../x.png' leads out of the folder",
        ),
        ({"project.yaml": "schema: 3\n"}, "hall.zip: project.yaml, line 1, schema: is 3; expected 1"),
    ],
)
def test_what_is_no_project_or_leads_elsewhere_is_refused_in_one_line(
    tmp_path: Path, files: dict[str, str], message: str
) -> None:
    with pytest.raises(FileFormatError) as caught:
        read_project_archive(written(tmp_path, files))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "commission." not in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["hall.zip"]


def test_link_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, {"project.yaml": f"{MINIMAL}reflectors: r.csv\n"})
    link = zipfile.ZipInfo("r.csv")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(FileFormatError, match=r"holds the link 'r.csv'; expected plain files"):
        read_project_archive(path)


def test_zip_that_would_unpack_into_far_more_than_it_is_is_refused_before_that(tmp_path: Path) -> None:
    path = tmp_path / "bomb.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("project.yaml", MINIMAL)
        with archive.open("reflectors.csv", "w") as file:
            for _ in range(100):
                file.write(bytes(1_000_000))
    tracemalloc.start()
    with pytest.raises(FileFormatError, match=r"would unpack \d+ bytes into 1000000\d\d; expected at most"):
        read_project_archive(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2_000_000


def test_zip_whose_directory_lies_about_a_size_gives_no_more_than_it_announced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("project.yaml", MINIMAL + "# " + "x" * 5_000_000)
    size = len(MINIMAL) + 2 + 5_000_000
    data = content.getvalue().replace(size.to_bytes(4, "little"), (20).to_bytes(4, "little"))
    path = tmp_path / "hall.zip"
    path.write_bytes(data)
    with pytest.raises(CommissionError) as caught:
        read_project_archive(path)
    assert "\n" not in str(caught.value)
    monkeypatch.setattr(project_archive, "SIZE_LIMIT", 10)
    with pytest.raises(FileFormatError, match="bytes; expected at most 10 bytes"):
        read_project_archive(path)


@pytest.mark.parametrize("content", [b"", b"PK", b"PK\x03\x04" + bytes(100)])
def test_what_is_no_zip_is_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "hall.zip"
    path.write_bytes(content)
    with pytest.raises(FileFormatError, match="is no readable zip"):
        read_project_archive(path)


def test_reading_can_be_stopped(tmp_path: Path) -> None:
    class Stopped(Exception):
        pass

    def stop(_fraction: float, _message: str) -> None:
        raise Stopped

    path = tmp_path / "hall.zip"
    path.write_bytes(export(room(), Format.PROJECT).content)
    with pytest.raises(Stopped):
        read_project_archive(path, progress=stop)
