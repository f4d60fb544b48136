"""What is drawn on the floor can be told from what it lies on: contrast after WCAG 2.1, computed here."""

from __future__ import annotations

import pytest

from commission.app.base import theme

LEAST = 3.0
"""What WCAG 2.1, 1.4.11, asks of graphical objects."""


def luminance(color: theme.Color) -> float:
    """Relative luminance after WCAG 2.1."""
    linear = [v / 12.92 if v <= 0.03928 else ((v + 0.055) / 1.055) ** 2.4 for v in (c / 255.0 for c in color)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: theme.Color, other: theme.Color) -> float:
    dark, bright = sorted((luminance(one), luminance(other)))
    return (bright + 0.05) / (dark + 0.05)


def test_black_and_white_have_the_contrast_that_the_standard_names() -> None:
    assert contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21.0)
    assert contrast((119, 119, 119), (255, 255, 255)) == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("below", [theme.BACKGROUND, theme.UNKNOWN, theme.FREE])
@pytest.mark.parametrize(
    "drawn", [theme.WALL, theme.ROUTE, theme.REFLECTOR, theme.GATE, theme.INLIER, theme.OUTLIER_ASSOCIATION, theme.SCAN]
)
def test_marks_stand_out_from_the_floor(drawn: theme.Color, below: theme.Color) -> None:
    assert contrast(drawn, below) >= LEAST


@pytest.mark.parametrize("drawn", [theme.ROUTE, theme.REFLECTOR])
def test_reflectors_and_routes_stand_out_on_walls_and_heatmaps_by_their_casing(drawn: theme.Color) -> None:
    assert contrast(drawn, theme.CASING) >= LEAST


@pytest.mark.parametrize("steps", [theme.WORSE, theme.BETTER])
def test_each_step_of_a_difference_is_brighter_than_the_one_before_and_the_last_stands_out(
    steps: tuple[theme.Color, ...],
) -> None:
    brightness = [luminance(color) for color in (theme.NO_DIFFERENCE, *steps)]
    assert brightness == sorted(set(brightness))
    assert contrast(steps[-1], theme.NO_DIFFERENCE) >= LEAST


@pytest.mark.parametrize("below", [theme.BACKGROUND, theme.FREE, theme.NO_DIFFERENCE])
def test_reflectors_of_a_kept_layout_stand_out_from_the_floor(below: theme.Color) -> None:
    assert contrast(theme.KEPT, below) >= LEAST
