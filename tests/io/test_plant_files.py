"""Files as plants have them: saved by Excel, made on another computer, in drafts of a standard, or not for us."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from commission.errors import FileFormatError, UsageError
from commission.io.findings import Findings
from commission.io.interchange import ConvertOptions, convert_file
from commission.io.lif import read_lif
from commission.io.map_server import read_floor_map
from commission.io.mesh import read_model
from commission.io.project_file import load_project, open_project
from commission.io.table_import import read_any_table
from commission.site.floor_map import FREE, OCCUPIED, UNKNOWN
from commission.site.routes import Direction


def table(folder: Path, content: bytes | str, name: str = "t.csv") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def places(path: Path) -> list[tuple[str, float, float]]:
    return [(r.id, r.x, r.y) for r in read_any_table(path).reflectors.reflectors]


TWO = [("R1", 1.5, 2.25), ("R2", 3.0, 4.0)]


@pytest.mark.parametrize(
    "content",
    [
        "id;x;y;radius;;\nR1;1,5;2,25;0,04;;\n;;;;;\nR2;3;4;0,04;;\n;;;;;\n",
        "id;x;y;radius\nR1;1,5;2,25;0,04;;\nR2;3;4;0,04\n",
        "sep=;\nid;x;y;radius\nR1;1,5;2,25;0,04\nR2;3;4;0,04\n",
        "SEP=,\nid,x,y,radius\nR1,1.5,2.25,0.04\nR2,3,4,0.04\n",
        '"sep=;"\r\nid;x;y;radius\r\nR1;1,5;2,25;0,04\r\nR2;3;4;0,04\r\n',
        "Name;x;y;;\nR1;1,5;2,25;;\n;;;;\nR2;3;4;;\n",
        "R1;1,5;2,25;;\nR2;3;4;;\n",
        "id;x;y;radius\nR1;1,5;2,25;0,04\n;;;\nR2;3;4;0,04\n",
        "sep=\t\nid\tx\ty\tradius\nR1\t1,5\t2,25\t0,04\nR2\t3\t4\t0,04\n",
        "id\tx\ty\tradius\nR1\t1,5\t2,25\t0,04\nR2\t3\t4\t0,04\n".encode("utf-16"),
    ],
)
def test_what_excel_adds_is_passed_over(tmp_path: Path, content: str | bytes) -> None:
    assert places(table(tmp_path, content)) == TWO


def test_cell_behind_the_last_named_column_is_no_empty_column(tmp_path: Path) -> None:
    path = table(tmp_path, "id;x;y;radius;\nR1;1,5;2,25;0,04;forgotten\n")
    with pytest.raises(
        FileFormatError, match="line 2: has 5 cells; expected 4 cells, one for each of: id, x, y, radius"
    ):
        read_any_table(path)


def test_text_of_windows_1252_is_read_with_a_note_and_utf_8_without(tmp_path: Path) -> None:
    text = "id;x;y;radius;note\nR1;1;2;0,04;S\u00e4ule\nR2;3;4;0,04;T\u00fcr\n"
    for encoding, notes in (("cp1252", 1), ("utf-8", 0)):
        read = read_any_table(table(tmp_path, text.encode(encoding)))
        assert [r.note for r in read.reflectors.reflectors] == ["S\u00e4ule", "T\u00fcr"]
        assert len(read.warnings) == notes
    assert "Windows-1252" in read_any_table(table(tmp_path, text.encode("cp1252"))).warnings[0]


def test_note_of_a_project_says_that_its_table_was_read_as_windows_1252(tmp_path: Path) -> None:
    (tmp_path / "project.yaml").write_text("schema: 1\nreflectors: r.csv\n")
    table(tmp_path, "id,x,y,radius,note\nR1,1,2,0.04,T\u00fcr\n".encode("cp1252"), "r.csv")
    opened = open_project(tmp_path)
    assert opened.project.reflectors.reflectors[0].note == "T\u00fcr"
    assert opened.notes == ("r.csv is not UTF-8; it was read as Windows-1252, as Excel saves text",)


def test_headings_beyond_a_turn_are_degrees_and_that_is_said(tmp_path: Path) -> None:
    head = "id,x,y,radius,kind,heading\n"
    read = read_any_table(table(tmp_path, head + "A,1,2,0.04,flat,90\nB,3,4,0.04,flat,2\n"))
    assert [r.heading for r in read.reflectors.reflectors] == pytest.approx([0.5 * math.pi, math.radians(2.0)])
    assert "taken for degrees" in read.warnings[0]
    radians = read_any_table(table(tmp_path, head + "A,1,2,0.04,flat,6.28\nB,3,4,0.04,flat,2\n"))
    assert [r.heading for r in radians.reflectors.reflectors] == pytest.approx([6.28, 2.0])
    assert radians.warnings == ()


def test_points_for_thousands_before_a_decimal_comma_are_read(tmp_path: Path) -> None:
    assert places(table(tmp_path, "id;x;y;radius\nR1;1.234,5;-2.000,25;0,04\n")) == [("R1", 1234.5, -2000.25)]


def test_point_that_may_be_one_for_thousands_is_refused_beside_decimal_commas(tmp_path: Path) -> None:
    path = table(tmp_path, "id;x;y;radius\nR1;1.234;2;0,04\nR2;2,5;2;0,04\n")
    with pytest.raises(FileFormatError, match=r"line 2, column x: is '1\.234' in a column of decimal commas"):
        read_any_table(path)
    # Where the column has no comma, a point is a decimal point as anywhere.
    assert places(table(tmp_path, "id;x;y;radius\nR1;1.234;2;0,04\n")) == [("R1", 1.234, 2.0)]


def test_z_beside_radius_is_the_height(tmp_path: Path) -> None:
    (reflector,) = read_any_table(table(tmp_path, "id,x,y,z,radius\n1,1.5,2.25,0.3,0.05\n")).reflectors.reflectors
    assert (reflector.height, reflector.radius) == (0.3, 0.05)


def test_tab_separated_table_becomes_a_csv(tmp_path: Path) -> None:
    convert_file(
        table(tmp_path, "id\tx\ty\tradius\nR1\t1,5\t2,25\t0,04\n", "t.tsv"), tmp_path / "o.csv", ConvertOptions()
    )
    assert places(tmp_path / "o.csv") == TWO[:1]


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("plan.dwg", "saved as DXF"),
        ("drive.log", "as a CSV folder"),
        ("hall.dae", "the model as .stl"),
        ("map.xml", "reflectors as a table"),
        ("t.xlsx", "saved as CSV"),
        ("thing.foo", "a folder, or a file that ends in .csv"),
    ],
)
def test_ending_that_is_not_read_is_named_with_what_to_bring_instead(tmp_path: Path, name: str, remedy: str) -> None:
    with pytest.raises(FileFormatError) as caught:
        convert_file(table(tmp_path, "x", name), tmp_path / "map.yaml", ConvertOptions())
    assert f"ends in {Path(name).suffix!r}, which is not read" in str(caught.value)
    assert remedy in str(caught.value)


GRAYS = np.array([[0, 0, 0, 0], [0, 254, 205, 0], [0, 254, 205, 0]], np.uint8)


def floor_map(folder: Path, image: str = "hall.pgm", free: float = 0.196, grays: np.ndarray = GRAYS) -> Path:
    Image.fromarray(grays).save(folder / Path(image.replace("\\", "/")).name)
    (folder / "map.yaml").write_text(
        f"image: {image}\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: {free}\n"
    )
    return folder / "map.yaml"


def counts(cells: np.ndarray) -> list[int]:
    return [int(np.count_nonzero(cells == kind)) for kind in (OCCUPIED, FREE, UNKNOWN)]


@pytest.mark.parametrize("image", ["/home/robot/maps/hall.pgm", "C:\\maps\\hall.pgm", "/elsewhere/hall.bmp"])
def test_image_named_by_a_path_of_another_computer_is_taken_from_beside_the_map(tmp_path: Path, image: str) -> None:
    found = Findings()
    assert counts(read_floor_map(floor_map(tmp_path, image), found=found).cells) == [8, 2, 2]
    assert "is not read" in found.lines()[0]


def test_absolute_image_that_does_not_lie_beside_the_map_is_refused(tmp_path: Path) -> None:
    path = floor_map(tmp_path, "/home/robot/maps/hall.pgm")
    (tmp_path / "hall.pgm").unlink()
    with pytest.raises(FileFormatError, match="leads out of the folder"):
        read_floor_map(path)


@pytest.mark.parametrize(("free", "notes"), [(0.196, 0), (0.25, 1)])
def test_unknown_cells_that_map_saver_wrote_stay_unknown_whatever_the_threshold(
    tmp_path: Path, free: float, notes: int
) -> None:
    found = Findings()
    assert counts(read_floor_map(floor_map(tmp_path, free=free), found=found).cells) == [8, 2, 2]
    assert len(found.lines()) == notes


@pytest.mark.parametrize("kind", ["16 bits", "palette"])
def test_unknown_cells_stay_unknown_however_the_grays_are_stored(tmp_path: Path, kind: str) -> None:
    path = floor_map(tmp_path, "hall.png", free=0.25)
    image = Image.fromarray(GRAYS)
    image = Image.fromarray(GRAYS.astype(np.uint16) * 257) if kind == "16 bits" else image.convert("P")
    image.save(tmp_path / "hall.png")
    assert counts(read_floor_map(path).cells) == [8, 2, 2]


def test_grays_of_a_drawn_map_are_judged_by_its_thresholds_alone(tmp_path: Path) -> None:
    grays = GRAYS.copy()
    grays[1, 1] = 240
    found = Findings()
    assert counts(read_floor_map(floor_map(tmp_path, free=0.25, grays=grays), found=found).cells) == [8, 4, 0]
    assert found.lines() == ()


def test_map_becomes_a_project_and_another_map(tmp_path: Path) -> None:
    path = floor_map(tmp_path)
    convert_file(path, tmp_path / "project", ConvertOptions())
    made = load_project(tmp_path / "project").floor_map
    assert made is not None
    assert counts(made.cells) == [8, 2, 2]
    convert_file(path, tmp_path / "other.yaml", ConvertOptions())
    assert read_floor_map(tmp_path / "other.yaml") == made


def hall(folder: Path, name: str, low: tuple[float, float, float], high: tuple[float, float, float]) -> Path:
    trimesh.creation.box(bounds=[low, high]).export(folder / name)
    return folder / name


def test_elevated_model_says_from_where_to_where_it_reaches(tmp_path: Path) -> None:
    path = hall(tmp_path, "hall.stl", (0, 0, 100), (20, 10, 103))
    with pytest.raises(FileFormatError, match=r"reaches from z = 100 to 103 m; .* such as --height 100.2"):
        convert_file(path, tmp_path / "map.yaml", ConvertOptions())
    convert_file(path, tmp_path / "map.yaml", ConvertOptions(heights=(100.2,)))
    assert read_floor_map(tmp_path / "map.yaml").size == pytest.approx((22.0, 12.0))


def test_model_with_y_up_is_suspected_and_read_once_that_is_said(tmp_path: Path) -> None:
    path = hall(tmp_path, "hall.obj", (0, 0, -10), (20, 3, 0))
    with pytest.raises(FileFormatError, match=r"reaches from z = -10 to 0 m; .* made with y up \(--up y\)"):
        convert_file(path, tmp_path / "map.yaml", ConvertOptions())
    convert_file(path, tmp_path / "map.yaml", ConvertOptions(up="y"))
    assert read_floor_map(tmp_path / "map.yaml").size == pytest.approx((22.0, 12.0))
    with pytest.raises(UsageError, match="up is 'x'; expected y or z"):
        convert_file(path, tmp_path / "other.yaml", ConvertOptions(up="x"))


def test_glb_is_in_metres_unless_another_unit_is_said(tmp_path: Path) -> None:
    path = hall(tmp_path, "hall.glb", (0, 0, 0), (2000, 300, 1000))
    assert np.ptp(read_model(path).bounds, axis=0) == pytest.approx([2000, 1000, 300])
    assert np.ptp(read_model(path, unit="cm").bounds, axis=0) == pytest.approx([20, 10, 3])


def layout(folder: Path, edge: dict[str, Any], *, version: str = "2.0.0", floors: tuple[str, ...] = ("m",)) -> Path:
    def one(name: str) -> dict[str, Any]:
        nodes = [
            {
                "nodeId": f"{name}{i}",
                "mapId": name,
                "nodePosition": {"x": 10 * i, "y": 0},
                "vehicleTypeNodeProperties": [],
            }
            for i in range(2)
        ]
        ends = {"edgeId": f"{name}e", "startNodeId": f"{name}0", "endNodeId": f"{name}1"}
        edges = [{**ends, "vehicleTypeEdgeProperties": [edge]}]
        return {"layoutId": name, "layoutLevelId": name, "nodes": nodes, "edges": edges, "stations": []}

    content = {"metaInformation": {"lifVersion": version}, "layouts": [one(name) for name in floors]}
    path = folder / "layout.lif"
    path.write_text(json.dumps(content))
    return path


def test_draft_of_lif_2_is_driven_as_its_orientations_say_and_that_it_is_a_draft_is_said(tmp_path: Path) -> None:
    edge = {"vehicleTypeIds": ["T", "U"], "vehicleOrientations": [math.pi, 0.0], "orientationType": "TANGENTIAL"}
    read = read_lif(layout(tmp_path, edge), vehicle_type="U")
    assert read.routes[0].segments[0].direction is Direction.REVERSE
    assert read.vehicle_types == ("T", "U")
    said = " ".join(read.warnings)
    assert "lifVersion is '2.0.0'" in said
    assert "several vehicleOrientations" in said


@pytest.mark.parametrize("suffix", [".lif", ".json"])
def test_draft_of_lif_2_with_origins_and_mobile_robots_is_read_as_version_1(tmp_path: Path, suffix: str) -> None:
    edge = {"vehicleTypeIds": ["T"], "vehicleOrientations": [3.14159], "orientationType": "TANGENTIAL"}
    old = layout(tmp_path, edge)
    content = json.loads(old.read_text().replace("vehicleOrientations", "mobileRobotOrientations"))
    text = json.dumps({**content, "origins": [{"originId": "O", "layouts": content.pop("layouts")}], "layouts": 0})
    text = text.replace(', "layouts": 0', "").replace("vehicleTypeIds", "mobileRobotTypes")
    text = text.replace('["T"]', '[{"manufacturer": "T", "seriesName": "1"}]').replace("vehicleType", "mobileRobotType")
    (tmp_path / f"draft{suffix}").write_text(text)
    convert_file(tmp_path / f"draft{suffix}", tmp_path / "project", ConvertOptions(vehicle_type="T 1"))
    (route,) = load_project(tmp_path / "project").routes
    assert route.segments[0].direction is Direction.REVERSE


def test_published_version_of_lif_is_read_without_a_word(tmp_path: Path) -> None:
    edge = {"vehicleTypeId": "T", "vehicleOrientation": math.pi, "rotationAllowed": False}
    read = read_lif(layout(tmp_path, edge, version="1.0.0"))
    assert read.routes[0].segments[0].direction is Direction.REVERSE
    assert read.warnings == ()


def test_layouts_of_two_floors_are_told_as_such(tmp_path: Path) -> None:
    edge = {"vehicleTypeId": "T", "rotationAllowed": False}
    read = read_lif(layout(tmp_path, edge, version="1.0.0", floors=("ground", "first")))
    assert "2 layouts ('ground', 'first') of 2 floors are laid over one another; choose one" in read.warnings
