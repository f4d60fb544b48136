"""The command `ambiguity`."""

import csv
import json

import numpy as np
import pytest
from PIL import Image

CORNERS = [(0.2, 0.2), (11.8, 0.2), (11.8, 7.8), (0.2, 7.8)]

PROJECT = """\
schema: 1
name: Symmetric hall
floor_map: map.yaml
reflectors: reflectors.csv
scanner: {field_of_view_deg: [-180.0, 180.0], reflector_range: 20.0, rate: 5.0}
routes:
  - name: Across
    speed: 1.0
    segments:
      - {direction: forward, degree: 1, control_points: [[3, 4], [9, 4]]}
"""


def write_reflectors(folder, places):
    rows = [f"R{index},{x},{y},0.04" for index, (x, y) in enumerate(places)]
    (folder / "reflectors.csv").write_text("\n".join(["id,x,y,radius", *rows]) + "\n", encoding="utf-8")


@pytest.fixture
def hall(tmp_path):
    """A hall of 12 x 8 m with a reflector in each corner: half a turn about its middle changes nothing."""
    folder = tmp_path / "hall"
    folder.mkdir()
    (folder / "project.yaml").write_text(PROJECT, encoding="utf-8")
    pixels = np.full((80, 120), 254, dtype=np.uint8)
    pixels[[0, -1]] = 0
    pixels[:, [0, -1]] = 0
    Image.fromarray(pixels).save(folder / "map.png")
    (folder / "map.yaml").write_text(
        "image: map.png\nresolution: 0.1\norigin: [0.0, 0.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )
    write_reflectors(folder, CORNERS)
    return folder


def table(path):
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def summary(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def test_a_symmetric_hall_is_flagged_with_its_pairs_and_moving_one_reflector_by_half_a_metre_clears_it(
    commission, hall, tmp_path
):
    code, told, err = commission("ambiguity", hall, "--out", tmp_path / "flagged")
    assert (code, err) == (0, "")
    assert "R0, R1, R2, R3 as R2, R3, R0, R1" in told
    assert summary(tmp_path / "flagged")["share_with_rival"] > 0.95
    first = table(tmp_path / "flagged" / "ambiguous_pairs.csv")[0]
    assert (first["constellation"], first["image"]) == ("R0 R1 R2 R3", "R2 R3 R0 R1")
    example, partner = ([float(first[prefix + axis]) for axis in "xy"] for prefix in ("", "partner_"))
    np.testing.assert_allclose(np.add(example, partner), (12.0, 8.0), atol=1e-4)

    write_reflectors(hall, [(0.7, 0.2), *CORNERS[1:]])
    code, told, err = commission("ambiguity", hall, "--out", tmp_path / "cleared")
    assert (code, err) == (0, "")
    assert "Alike" not in told
    assert summary(tmp_path / "cleared")["share_with_rival"] == 0.0
    assert table(tmp_path / "cleared" / "ambiguous_pairs.csv") == []


def test_table_arrays_and_image_say_the_same(commission, hall, tmp_path):
    assert commission("ambiguity", hall, "--spacing", 1, "--out", tmp_path / "out")[0] == 0
    rows = table(tmp_path / "out" / "ambiguity.csv")
    with np.load(tmp_path / "out" / "ambiguity.npz") as arrays:
        assert arrays["ambiguous_share"].shape == (8, 12)
        drivable, share = arrays["drivable"], arrays["ambiguous_share"]
        assert [float(row["ambiguous_share"]) for row in rows] == share[drivable].tolist()
        middle = next(row for row in rows if (row["x"], row["y"]) == ("5.5", "3.5"))
        np.testing.assert_allclose(arrays["partner"][3, 5, :2], (6.5, 4.5), atol=1e-6)
    assert middle["visible"] == "4"
    with Image.open(tmp_path / "out" / "ambiguity.png") as image:
        assert image.size == (96, 64)


def test_neighbors_that_mislead_on_a_route_are_listed_with_probability_and_metres(commission, hall, tmp_path):
    write_reflectors(hall, [*CORNERS, (6.0, 7.8), (6.08, 7.8)])
    code, told, err = commission("ambiguity", hall, "--route", "Across", "--out", tmp_path / "out")
    assert (code, err) == (0, "")
    assert "worst R" in told
    first, second = table(tmp_path / "out" / "neighbors.csv")[:2]
    assert (
        {first["reflector_id"], first["neighbor_id"]}
        == {"R4", "R5"}
        == {second["reflector_id"]} | {second["neighbor_id"]}
    )
    assert 0.0 < float(first["probability_max"]) <= 0.5
    metres = [int(metre) for metre in first["metres"].split()]
    assert metres
    assert set(metres) <= set(range(7))
    assert int(float(first["metre_of_max"])) in metres
    (route,) = summary(tmp_path / "out")["routes"]
    assert route["worst_probability"] == pytest.approx(float(first["probability_max"]), rel=1e-5)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--spacing", "0"), "spacing is 0"),
        (("--tolerance", "0"), "ambiguity.tolerance is 0"),
        (("--turn", "-1"), "ambiguity.turn is -0.0"),
        (("--headings", "0"), "ambiguity.headings is 0"),
        (("--route", "Loop"), "no route is called 'Loop'"),
    ],
)
def test_a_bad_option_is_refused_by_name(words, said, refused, hall, tmp_path):
    assert said in refused("ambiguity", hall, "--out", tmp_path / "out", *words)
    assert not (tmp_path / "out").exists()
