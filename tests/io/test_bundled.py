import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from commission.errors import FileFormatError
from commission.io.bundled import bundled_folder


@pytest.mark.parametrize("name", ["maps", "web_assets"])
def test_bundled_folder_is_found_in_the_checkout(name, repository):
    assert bundled_folder(name) == repository / name


def test_bundled_folder_inside_an_installed_package_wins(tmp_path):
    package = tmp_path / "commission"
    (package / "_data" / "maps").mkdir(parents=True)
    (tmp_path / "maps").mkdir()
    assert bundled_folder("maps", package) == package / "_data" / "maps"


def test_folder_of_another_package_in_site_packages_is_not_taken_for_ours(tmp_path):
    (tmp_path / "maps").mkdir()
    with pytest.raises(FileFormatError, match=re.escape("the bundled folder is missing")):
        bundled_folder("maps", tmp_path / "commission")


@pytest.mark.slow
def test_wheel_contains_every_bundled_file(repository, tmp_path):
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "--wheel-dir",
        str(tmp_path),
        str(repository),
    ]
    subprocess.run(command, check=True, capture_output=True, timeout=200)
    (wheel,) = tmp_path.glob("commission-*.whl")
    packed = set(zipfile.ZipFile(wheel).namelist())
    tracked = subprocess.run(
        ["git", "-C", str(repository), "ls-files", "maps", "web_assets"], check=True, capture_output=True, text=True
    ).stdout.split("\n")
    expected = {f"commission/_data/{name}" for name in tracked if name and Path(repository, name).is_file()}
    assert expected
    assert expected <= packed
