"""Colors of the page: each has one meaning, and what is drawn can be told from what it lies on.

Contrast after WCAG 2.1 and distance after CIE 1976 are computed here, from the standards.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from viser import LineSegmentsHandle

import commission
from commission.app.base import style, theme
from commission.app.base.drawing import NO_SEGMENTS
from commission.app.base.grid_layer import GridLayer
from commission.app.base.layer import Layer
from commission.app.base.marks import Cased, add_cased_lines
from commission.app.base.paints import PAINTS, Floor, Paint, Plan, Run, Surface, Worded
from commission.app.base.ramp import colors
from commission.app.base.relight import light_color
from commission.app.base.server import start_server
from commission.app.floor_map.draft_layer import MapDraftLayer
from commission.app.launch import FEATURES
from commission.app.prediction.ribbon_layer import RibbonLayer
from commission.io.bundled import bundled_folder

LEAST = 3.0
"""What WCAG 2.1, 1.4.11, asks of graphical objects."""
LEAST_OF_WORDS = 4.5
"""What it asks of words, 1.4.3."""
NOT_WORDS = (0.3, 0.35, 0.45, 0.5, 0.55, 0.6)
"""Opacities of what cannot be pressed now or is switched off, and of marks."""
TOLD_APART = 12.0
"""Distance of colors that are told apart beside each other: 2.3 is just noticed (Mahy et al. 1994)."""
THEMES = ("dark", "light")
ON_A_DRIVE = (
    Floor.WALL,
    Floor.STATION,
    Floor.REFLECTOR,
    Floor.ZONE,
    Floor.SELECTED,
    Floor.VEHICLE,
    Run.GATE,
    Run.POSE,
    Run.HEADING,
    Run.INLIER,
    Run.OUTLIER,
    Run.OUTLIER_DETECTOR,
    Run.SCAN,
    Run.TRAIL,
    Run.REFERENCE,
    Plan.OVER_LIMIT,
)
"""What a person has to tell apart while a vehicle drives. The route is a thin line, told from a wall by its shape."""


def luminance(color: theme.Color) -> float:
    """Relative luminance after WCAG 2.1."""
    linear = [v / 12.92 if v <= 0.03928 else ((v + 0.055) / 1.055) ** 2.4 for v in (c / 255.0 for c in color)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: theme.Color, other: theme.Color) -> float:
    dark, bright = sorted((luminance(one), luminance(other)))
    return (bright + 0.05) / (dark + 0.05)


def lab(color: theme.Color) -> np.ndarray:
    """CIE 1976 L*a*b* of an sRGB color under D65."""
    linear = np.array([v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in np.array(color) / 255.0])
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    shares = to_xyz @ linear / (0.9505, 1.0, 1.089)
    x, y, z = np.where(shares > 0.008856, np.cbrt(shares), 7.787 * shares + 16.0 / 116.0)
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


def test_black_and_white_have_the_contrast_that_the_standard_names() -> None:
    assert contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21.0)
    assert contrast((119, 119, 119), (255, 255, 255)) == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("shown", THEMES)
def test_no_two_meanings_share_a_color(shown: str) -> None:
    meanings: dict[theme.Color, set[str]] = {}
    for paint in PAINTS.values():
        meanings.setdefault(getattr(paint, shown), set()).add(paint.meaning)
    shared = {color: found for color, found in meanings.items() if len(found) > 1}
    assert shared == {}


def test_no_meaning_has_two_colors() -> None:
    assert len({paint.meaning for paint in PAINTS.values()}) == len(PAINTS)


@pytest.mark.parametrize("shown", THEMES)
def test_what_a_drive_shows_is_told_apart(shown: str) -> None:
    near = {
        (one.meaning, other.meaning): round(distance, 1)
        for one, other in combinations(ON_A_DRIVE, 2)
        if (distance := float(np.linalg.norm(lab(getattr(one, shown)) - lab(getattr(other, shown))))) < TOLD_APART
    }
    assert near == {}


@pytest.mark.parametrize("shown", THEMES)
@pytest.mark.parametrize("below", [Floor.BACKGROUND, Floor.UNKNOWN, Floor.FREE])
@pytest.mark.parametrize(
    "drawn",
    [
        *(Floor.WALL, Floor.ROUTE, Floor.REFLECTOR, Floor.STATION, Floor.ZONE, Floor.SELECTED, Floor.VEHICLE),
        *(Floor.TAG, Run.MATCHED, Run.UNMATCHED),
        *(Run.GATE, Run.POSE, Run.HEADING, Run.INLIER, Run.OUTLIER, Run.SCAN, Run.TRAIL, Run.REFERENCE),
        *(Run.OFFSET, Run.OUTLIER_DETECTOR, Run.FURTHER_SCAN, Run.FIELD, Run.FAR_FIELD, Run.NOT_KNOWN),
        *(Run.VARIANT_A, Run.VARIANT_B, Run.VARIANT_C, Run.HYPOTHESIS, Run.GOODS, Run.GOODS_SIGMA, Run.EDIT),
        *(Run.CAMERA_BY_LASER, Run.CAMERA_BY_CONTOUR, Floor.PREVIEW, Floor.WALL_3D, Floor.TRUCK),
        *(Plan.SUGGESTED, Plan.OVER_LIMIT, Plan.KEPT, Plan.TAKEN_DOWN, Plan.KEEP_OUT, Plan.DEPENDENT, Plan.RISK),
        *(Plan.TOO_LITTLE, Plan.RECOVERY, Plan.FIRST_TWIN, Plan.SECOND_TWIN),
    ],
    ids=lambda paint: paint.meaning,
)
def test_marks_stand_out_from_the_floor(drawn: Paint, below: Paint, shown: str) -> None:
    assert contrast(getattr(drawn, shown), getattr(below, shown)) >= LEAST


@pytest.mark.parametrize("shown", THEMES)
def test_words_can_be_read_on_what_they_stand_on(shown: str) -> None:
    panel = Surface.HEAD
    on_panels = (
        *(Worded.DONE, Worded.NOTE, Worded.REFUSED, Worded.DOUBTFUL, Worded.BETTER, Worded.WORSE, Worded.DIFFERENT),
        *(Worded.SETTING, Worded.WORD, Worded.INK, Worded.LACKING, Surface.AXIS, Run.FAIL_EVENT, Run.RECOVERED_EVENT),
        # Above the plots each curve's value has the curve's color.
        *(Run.FIRST_CURVE, Run.SECOND_CURVE, Run.THIRD_CURVE, Run.WHOLE_CURVE, Run.INLIER, Run.OUTLIER, Run.EDIT),
        *(Run.VARIANT_A, Run.VARIANT_B, Run.VARIANT_C, Run.REFERENCE, Plan.OVER_LIMIT),
    )
    pairs = [
        *((word, ground) for word in on_panels for ground in (panel, Surface.PLOT)),
        *((word, Floor.BACKGROUND) for word in (Run.GATE, Plan.OVER_LIMIT, Worded.LACKING, Worded.STATUS, Worded.NOTE)),
        *((word, Surface.CARD) for word in (Worded.DONE, Worded.NOTE, Worded.LACKING)),
        (Surface.AXIS, Floor.BACKGROUND),
        (Worded.ON_LACKING, Worded.LACKING),
        (Surface.ON_DISABLED, Surface.CARD),
    ]
    found = {
        f"{word.meaning} on {ground.meaning}": round(contrast(getattr(word, shown), getattr(ground, shown)), 2)
        for word, ground in pairs
    }
    assert {name: value for name, value in found.items() if value < LEAST_OF_WORDS} == {}


@pytest.mark.parametrize("shown", THEMES)
@pytest.mark.parametrize("ground", [Run.OPERATIONAL, Run.FAIL, Run.IDLE, Worded.PRESS, Worded.BRAND])
def test_white_words_can_be_read_and_their_ground_is_seen_on_a_panel(ground: Paint, shown: str) -> None:
    color = getattr(ground, shown)
    assert contrast((255, 255, 255), color) >= LEAST_OF_WORDS
    if ground in (Run.OPERATIONAL, Run.FAIL, Worded.BRAND):  # the strip of the drive; what can be pressed
        assert contrast(color, getattr(Surface.HEAD, shown)) >= LEAST


def test_pale_words_can_be_read() -> None:
    pale = [float(each) for each in re.findall(r"[;{]opacity:(0?\.\d+)", theme.STYLE + style.BAR_AND_GUIDE)]
    assert len(pale) > 10
    ink, panel = {"dark": 201.0, "light": 0.0}, {"dark": 36.0, "light": 255.0}  # viser's own
    for opacity in {each for each in pale if each not in NOT_WORDS}:
        for shown in THEMES:
            grey = round(panel[shown] + opacity * (ink[shown] - panel[shown]))
            assert contrast((grey,) * 3, (round(panel[shown]),) * 3) >= LEAST_OF_WORDS, (opacity, shown)


@dataclass(eq=False)
class Drawn:
    """A node of a scene that is only written down."""

    name: str
    kind: str
    color: theme.Color
    width: float
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    visible: bool = True


class Sketch:
    """A scene that writes down the lines and marks that a layer adds."""

    def __init__(self) -> None:
        self.nodes: list[Drawn] = []

    def add_line_segments(self, name: str, *, colors: theme.Color, thickness: float, **_: Any) -> Drawn:
        self.nodes.append(Drawn(name, "line", colors, thickness))
        return self.nodes[-1]

    def add_point_cloud(self, name: str, *, colors: theme.Color, **_: Any) -> Drawn:
        pixels = re.search(r"/(\d+)px$", name)
        self.nodes.append(Drawn(name, "mark" if pixels else "disc", colors, float(pixels[1]) if pixels else 0.0))
        return self.nodes[-1]

    def __getattr__(self, name: str) -> Any:
        """Whatever else a layer adds stays unseen."""
        return lambda *_, **__: Drawn(name, "other", (0, 0, 0), 0.0)


def is_lost_on_a_heatmap(color: theme.Color) -> bool:
    """Whether there is a color of a heatmap on which it is not seen, in either theme."""
    grounds = [tuple(map(int, each)) for each in colors(9)]
    grounds += [each.dark for each in (Plan.EVERY, Plan.SOME, Plan.NO_FIX, Plan.WORSE_3, Plan.BETTER_3)]
    shown = [(color, each) for each in grounds] + [(light_color(color), light_color(each)) for each in grounds]
    return min(contrast(one, other) for one, other in shown) < LEAST


QUIET = {GridLayer, MapDraftLayer}
"""Not to stand out; lies on the map that is being placed, where no heatmap is."""


@pytest.mark.parametrize(
    "make",
    [layer for feature in FEATURES for layer in feature.layers if layer not in QUIET],
    ids=lambda make: make.__name__,
)
def test_thin_marks_are_seen_on_heatmaps_by_a_casing(make: Callable[[Any], Layer]) -> None:
    scene = Sketch()
    shown = make(scene).nodes()
    around = [node for node in scene.nodes if node.color in (theme.CASING, theme.RIM)]
    assert all(node in shown for node in around), "a casing is hidden and shown with its marks"
    if make is RibbonLayer:  # all pieces of one ribbon share its rim
        assert around[0].width > max(node.width for node in scene.nodes if node not in around)
        return
    free = list(around)
    for node in scene.nodes:
        if node.kind != "disc" and node not in around and is_lost_on_a_heatmap(node.color):
            below = [each for each in free if each.kind == node.kind and node.width < each.width <= node.width + 5]
            assert below, f"nothing is around {node.name}"
            free.remove(below[0])


@pytest.fixture
def cased_lines() -> Iterator[Cased]:
    """Lines in a scene of viser's, and not in a sketch of one: what moves is written past its setters."""
    server = start_server("127.0.0.1", 0)
    yield add_cased_lines(server.scene, "/lines", theme.TRAIL, 1.5)
    server.stop()


def test_a_casing_lies_below_every_mark_at_the_same_places(cased_lines: Cased) -> None:
    cased_lines.points = np.array([[(1.0, 2.0, theme.Height.TRAIL), (3.0, 4.0, theme.Height.TRAIL)]])
    casing, marks = (cast("LineSegmentsHandle", node) for node in cased_lines.nodes)
    np.testing.assert_array_equal(casing.points[..., :2], marks.points[..., :2])
    heights = {name: value for name, value in vars(theme.Height).items() if name.isupper()}
    assert {name for name, value in heights.items() if value < casing.points[0, 0, 2]} == {"FLOOR", "HEAT", "GRID"}
    cased_lines.points = NO_SEGMENTS
    assert casing.points.max() <= -1000.0


def test_what_moves_has_a_casing_while_the_floor_is_colored(cased_lines: Cased) -> None:
    casing, marks = (cast("LineSegmentsHandle", node) for node in cased_lines.nodes)
    drawn = np.array([[(1.0, 2.0, theme.Height.TRAIL), (3.0, 4.0, theme.Height.TRAIL)]])
    for colored in (False, True, False):
        cased_lines.draw(drawn, cased=colored)
        np.testing.assert_array_equal(marks.points, drawn.astype(np.float32))
        assert bool(casing.points.max() > 0.0) is colored


@pytest.mark.parametrize("shown", THEMES)
def test_a_casing_is_told_from_what_it_is_around(shown: str) -> None:
    assert (theme.CASING, theme.RIM) == (Floor.BACKGROUND.dark, Floor.RIM.dark)
    on_it = (Floor.ROUTE, Floor.REFLECTOR, Floor.VEHICLE, Floor.ZONE, Run.INLIER, Run.OUTLIER, Run.GATE, Run.SCAN)
    for drawn in (*on_it, Run.TRAIL, Run.FIELD, Run.FAR_FIELD):
        assert contrast(getattr(drawn, shown), getattr(Floor.BACKGROUND, shown)) >= LEAST
    # So routes and reflectors are seen on bare walls, too, whose color is near to theirs.
    assert contrast(getattr(Floor.WALL, shown), getattr(Floor.BACKGROUND, shown)) >= LEAST


@pytest.mark.parametrize("shown", THEMES)
@pytest.mark.parametrize(
    "steps", [(Plan.WORSE_1, Plan.WORSE_2, Plan.WORSE_3), (Plan.BETTER_1, Plan.BETTER_2, Plan.BETTER_3)]
)
def test_each_step_of_a_difference_stands_out_more_than_the_one_before(steps: tuple[Paint, ...], shown: str) -> None:
    ground = getattr(Plan.NO_DIFFERENCE, shown)
    contrasts = [contrast(getattr(step, shown), ground) for step in steps]
    assert contrasts == sorted(set(contrasts))
    assert contrasts[-1] >= LEAST


def test_reflectors_of_a_kept_layout_stand_out_where_nothing_differs() -> None:
    assert contrast(Plan.KEPT.dark, Plan.NO_DIFFERENCE.dark) >= LEAST
    assert contrast(Plan.KEPT.light, Plan.NO_DIFFERENCE.light) >= LEAST


def test_every_color_of_a_script_has_a_meaning() -> None:
    known = {theme.css(paint.dark) for paint in PAINTS.values()}
    scripts = sorted(bundled_folder("web_assets").glob("*.js"))
    found = {(path.name, each) for path in scripts for each in re.findall(r"#[0-9a-f]{6}\b", path.read_text())}
    assert len(found) > 5
    assert {each for each in found if each[1] not in known} == set()


def test_no_color_is_written_beside_the_table_of_paints() -> None:
    written = re.compile(r"#[0-9a-f]{6}\b|: (?:theme\.)?Color = \(\d")
    app = Path(commission.__file__).parent / "app"
    lines = {
        f"{path.name}: {line.strip()}"
        for path in app.rglob("*.py")
        if path.name != "paints.py"
        for line in path.read_text(encoding="utf-8").splitlines()
        if written.search(line)
    }
    assert lines == set()
