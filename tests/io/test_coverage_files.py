"""Coverage as files: arrays, table and image say the same."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from commission.errors import FileFormatError
from commission.io.coverage_files import NO_FIX, NO_FLOOR, write_coverage
from commission.planning.coverage import Lattice, coverage
from commission.planning.dilution import FixOptions
from commission.planning.vehicle_visibility import vehicle_visibility
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.coverage import CoverageResult

LATTICE = Lattice(x=-2.0, y=-1.0, spacing=1.0, rows=3, columns=40)


@pytest.fixture
def found() -> CoverageResult:
    """A strip of 40 m; its far end is out of reach of the two reflectors at its start."""
    reflectors = ReflectorMap((Reflector(id="a", x=0.0, y=2.0), Reflector(id="b", x=4.0, y=2.0)))
    project = Project(reflectors=reflectors, scanners=(Scanner(resolution_deg=0.1),))
    return of(project)


def of(project: Project) -> CoverageResult:
    """Figures of a project over the lattice, all of which is floor."""
    visible = vehicle_visibility(project)
    found = coverage(visible, LATTICE, FixOptions())
    return CoverageResult(coverage=found, visible=visible, drivable=np.ones(len(LATTICE), dtype=bool))


def test_files_hold_the_figures_of_the_floor(found, tmp_path):
    drivable = np.ones(len(LATTICE), dtype=bool)
    drivable[:40] = False
    write_coverage(tmp_path / "new", replace(found, drivable=drivable), {"points": 80, "share": None})
    with np.load(tmp_path / "new" / "coverage.npz") as arrays:
        np.testing.assert_array_equal(arrays["position_sigma_m"], found.coverage.image("position_sigma"))
        np.testing.assert_array_equal(arrays["x"], np.arange(-2.0, 38.0))
        assert arrays["drivable"].tolist() == drivable.reshape(3, 40).tolist()
    rows = list(csv.DictReader((tmp_path / "new" / "coverage.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == 80
    assert (float(rows[0]["x"]), float(rows[0]["y"])) == (-2.0, 0.0)
    assert float(rows[0]["heading_sigma_rad"]) == pytest.approx(found.coverage.fixes.heading_sigma[40], rel=1e-5)
    assert (rows[39]["visible"], rows[39]["position_sigma_m"]) == ("0", "")
    assert json.loads((tmp_path / "new" / "summary.json").read_text(encoding="utf-8")) == {"points": 80, "share": None}


def test_image_has_north_up_and_a_color_of_its_own_for_no_fix(found, tmp_path):
    drivable = np.ones(len(LATTICE), dtype=bool)
    drivable[:40] = False
    write_coverage(tmp_path, replace(found, drivable=drivable), {})
    image = Image.open(tmp_path / "coverage.png").convert("RGB")
    scale = image.width // 40
    assert image.size == (40 * scale, 3 * scale)
    assert image.getpixel((0, image.height - 1)) == NO_FLOOR
    assert image.getpixel((image.width - 1, 0)) == NO_FIX
    assert image.getpixel((0, 0)) not in (NO_FIX, NO_FLOOR)


def test_image_of_floor_without_any_fix_is_drawn(tmp_path):
    write_coverage(tmp_path, of(Project()), {})
    assert Image.open(tmp_path / "coverage.png").convert("RGB").getpixel((0, 0)) == NO_FIX


def test_a_folder_that_is_a_file_is_one_clear_error(found, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(FileFormatError, match="cannot be written"):
        write_coverage(tmp_path / "file", found, {})
