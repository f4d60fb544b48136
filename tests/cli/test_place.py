import numpy as np
import pytest
from PIL import Image

from commission.io.project_file import load_project
from commission.planning.ambiguity import ambiguous_poses
from commission.planning.vehicle_visibility import vehicle_visibility


@pytest.fixture
def walled(project):
    """The project with a hall of 8 x 6 m around its route."""
    pixels = np.full((60, 80), 254, dtype=np.uint8)
    pixels[[0, -1]] = 0
    pixels[:, [0, -1]] = 0
    Image.fromarray(pixels).save(project / "map.png")
    (project / "map.yaml").write_text(
        "image: map.png\nresolution: 0.1\norigin: [-1.0, -3.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )
    text = (project / "project.yaml").read_text(encoding="utf-8")
    (project / "project.yaml").write_text(text.replace("reflectors:", "floor_map: map.yaml\nreflectors:"))
    return project


def test_a_layout_is_suggested_as_a_project_that_loads(commission, walled, tmp_path):
    words = ("--no-extend", "--visible", 2, "--keep-out", "-1,-3,3,0")
    code, told, err = commission("place", walled, "--out", tmp_path / "placed", *words)
    assert (code, err) == (0, "")
    assert "Not met" not in told
    placed, before = load_project(tmp_path / "placed"), load_project(walled)
    assert 3 <= len(placed.reflectors) <= 4
    assert placed.routes == before.routes
    assert not ((placed.reflectors.centers <= (3.0, 0.0)).all(axis=1)).any()


def test_what_the_project_asks_for_holds_unless_the_command_says_otherwise(commission, walled, tmp_path):
    with (walled / "project.yaml").open("a", encoding="utf-8") as file:
        file.write(
            "layout:\n  demands: {visible: 3}\n  candidates:\n    radius: 0.03\n    keep_out: [[-1, -3, 3, 0]]\n"
        )
    assert commission("place", walled, "--out", tmp_path / "placed", "--no-extend")[0] == 0
    placed = load_project(tmp_path / "placed")
    assert len(placed.reflectors) >= 4
    assert {each.radius for each in placed.reflectors.reflectors} == {0.03}
    assert not ((placed.reflectors.centers <= (3.0, 0.0)).all(axis=1)).any()
    assert placed.layout == load_project(walled).layout
    words = ("--no-extend", "--visible", 1, "--no-survive-failure", "--radius", 0.05, "--position-limit", 1.0)
    assert commission("place", walled, "--out", tmp_path / "fewer", *words)[0] == 0
    fewer = load_project(tmp_path / "fewer").reflectors
    assert len(fewer) < len(placed.reflectors)
    assert {each.radius for each in fewer.reflectors} == {0.05}


def test_a_project_without_a_route_that_counts_is_refused(refused, walled, tmp_path):
    with (walled / "project.yaml").open("a", encoding="utf-8") as file:
        file.write("layout: {ignored_routes: [Straight]}\n")
    assert "no route that counts" in refused("place", walled, "--out", tmp_path / "placed")


def test_reflectors_that_are_enough_stay_alone(commission, project, tmp_path):
    code, told, _ = commission("place", project, "--out", tmp_path / "placed")
    assert code == 0
    assert "0 suggested" in told
    assert load_project(tmp_path / "placed").reflectors == load_project(project).reflectors


def test_chosen_places_are_told_from_all_others(commission, walled, tmp_path):
    with (walled / "project.yaml").open("a", encoding="utf-8") as file:
        file.write("stations:\n  - {name: Dock, x: 6.0, y: 0.0}\n")
    words = ("--no-extend", "--visible", 1, "--no-survive-failure")
    words += ("--unambiguous", "stations", "--unambiguous", "starts", "--unambiguous", "3,1.5,90")
    code, told, err = commission("place", walled, "--out", tmp_path / "placed", *words)
    assert (code, err) == (0, "")
    assert "Not met" not in told
    poses = [(6.0, 0.0, 0.0), (0.0, 0.0, 0.0), (3.0, 1.5, np.pi / 2)]
    assert not ambiguous_poses(vehicle_visibility(load_project(tmp_path / "placed")), poses).ambiguous.any()


def test_a_place_that_nothing_clears_is_named(commission, walled, tmp_path):
    words = ("--no-extend", "--keep-out", "-9,-9,9,9", "--unambiguous", "starts")
    code, told, _ = commission("place", walled, "--out", tmp_path / "placed", *words)
    assert code == 0
    assert "Not met      start of 'Straight'" in told


def test_reflectors_are_put_up_at_the_heights_that_are_allowed(commission, walled, tmp_path):
    # Below the route's middle only above 0.25 m, where a reflector of 0.2 m is still met at 0.2 m; beyond it nowhere.
    words = ("--no-extend", "--visible", 1, "--heights", "0.25,2", "--heights", "0.5,2,4,-3,9,3")
    assert commission("place", walled, "--out", tmp_path / "placed", *words)[0] == 0
    placed = load_project(tmp_path / "placed").reflectors
    assert {each.height for each in placed.reflectors} == {0.25}
    assert placed.centers[:, 0].max() < 4.0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--visible", "0"], "demands.visible is 0"),
        (["--keep-out", "1,2,3"], "--keep-out is '1,2,3'; expected X1,Y1,X2,Y2 (metres)"),
        (["--spacing", "0"], "candidates.spacing is 0"),
        (["--position-limit", "-1"], "demands.position_limit is -1"),
        (["--route", "Loop"], "no route is called 'Loop'"),
        (["--unambiguous", "everywhere"], "--unambiguous is 'everywhere'; expected stations, starts, X,Y"),
        (["--heights", "2,1"], "allowed_heights are 2 to 1 m; expected lowest <= highest"),
        (["--heights", "1"], "--heights is '1'; expected LOW,HIGH"),
        (["--length", "0"], "candidates.length is 0"),
        (["--blocked-per-m", "2"], "prediction.blocked_per_m is 2"),
    ],
)
def test_a_bad_option_is_refused_by_name(words, said, refused, project, tmp_path):
    assert said in refused("place", project, "--out", tmp_path / "placed", *words)
    assert not (tmp_path / "placed").exists()


def test_the_project_itself_is_never_overwritten(refused, project):
    assert "another folder" in refused("place", project, "--out", project)


def test_before_and_after_are_told_side_by_side(commission, walled, tmp_path):
    code, told, _ = commission("place", walled, "--out", tmp_path / "placed", "--no-extend", "--visible", 2)
    assert code == 0
    before, after = (len(load_project(each).reflectors) for each in (walled, tmp_path / "placed"))
    lines = told.split("Before and after\n")[1].splitlines()
    assert lines[0].split(None, 1) == ["Reflectors", f"{before} -> {after}"]
    assert lines[1].startswith("Straight ")
    assert "in sight" in lines[1]
    assert lines[2].startswith("... any one failing")
    assert any(line.startswith("Stop if failing") for line in lines)
    assert any(line.startswith("Ambiguous") for line in lines)


def test_a_preset_and_pairs_and_spread_are_demanded_on_the_command_line(commission, walled, tmp_path):
    words = ("--no-extend", "--preset", "nav350", "--pairs-differ", 0.1, "--wall-reach", 4)
    code, told, err = commission("place", walled, "--out", tmp_path / "placed", *words)
    assert (code, err) == (0, "")
    placed = load_project(tmp_path / "placed")
    assert len(placed.reflectors) >= 4
    delta = placed.reflectors.centers[:, np.newaxis] - placed.reflectors.centers
    distances = np.sort(np.hypot(delta[..., 0], delta[..., 1])[np.triu_indices(len(placed.reflectors), 1)])
    assert np.diff(distances).min() > 0.1 or "two pairs in sight with nearly the same distance" in told
    code, _, err = commission("place", walled, "--out", tmp_path / "none", "--preset", "NAV999")
    assert code == 2
    assert "preset of the demands is 'NAV999'; expected one of NAV350" in err
