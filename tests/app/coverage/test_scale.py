import numpy as np
import pytest

from commission.app.coverage.scale import (
    FIRST,
    NO_FIX,
    NOTHING,
    QUANTITIES,
    Scale,
    colors,
    picture,
    round_bounds,
    scale_for,
)
from commission.app.coverage.settings import Figure

FLOOR = np.ones(4, bool)


@pytest.mark.parametrize("low, high", [(1.9, 31.0), (2.0, 2.05), (0.0004, 900.0), (7.0, 7.0)])
def test_bounds_are_few_round_and_ascending(low: float, high: float) -> None:
    bounds = round_bounds(low, high)
    assert 1 <= len(bounds) <= 9
    assert list(bounds) == sorted(set(bounds))
    assert all(f"{bound:.1e}"[:3] in {"1.0", "1.5", "2.0", "3.0", "5.0", "7.0"} for bound in bounds)


def test_colors_grow_evenly_in_lightness() -> None:
    # Relative luminance of sRGB (IEC 61966-2-1, without its toe).
    luminance = ((colors(9) / 255.0) ** 2.2) @ np.array([0.2126, 0.7152, 0.0722])
    assert np.all(np.diff(luminance ** (1 / 3)) > 0.03)


def test_bright_asks_for_attention_whichever_way_a_figure_is_good() -> None:
    errors = scale_for(Figure.POSITION_SIGMA, np.array([0.002, 0.05])).colors().sum(axis=1, dtype=int)
    counts = scale_for(Figure.VISIBLE, np.array([1.0, 20.0])).colors().sum(axis=1, dtype=int)
    assert errors[0] < errors[-1]
    assert counts[0] > counts[-1]


def test_no_fix_and_no_floor_have_classes_of_their_own() -> None:
    scale = Scale(Figure.POSITION_SIGMA, (5.0, 10.0))
    values = np.array([0.004, np.inf, 0.02, 0.007])
    assert scale.classes(values, np.array([True, True, True, False])).tolist() == [FIRST, NO_FIX, FIRST + 2, NOTHING]


def test_a_count_is_in_the_class_that_bears_its_name() -> None:
    scale = scale_for(Figure.VISIBLE, FLOOR.astype(float))
    assert scale.classes(np.array([0, 1, 2, 3.0]), FLOOR).tolist() == [NO_FIX, FIRST, FIRST + 1, FIRST + 2]


def test_a_floor_without_any_fix_still_has_a_scale() -> None:
    assert scale_for(Figure.HEADING_DOP, np.full(4, np.inf)).bounds


def test_picture_hatches_what_has_no_fix_and_leaves_out_what_is_no_floor() -> None:
    classes = np.full((6, 6), NO_FIX, np.uint8)
    classes[0] = NOTHING
    image = picture(classes, scale_for(Figure.VISIBLE, FLOOR.astype(float)), 0.5)
    assert np.all(image[0, :, 3] == 0)
    assert np.all(image[1:, :, 3] == 128)
    assert len(np.unique(image[1:, :, :3].reshape(-1, 3), axis=0)) == 2


def test_every_figure_says_how_it_is_shown() -> None:
    assert set(QUANTITIES) == set(Figure) - {Figure.NONE}
