"""A number that people read gets its unit from `commission.site.quantity`: nobody multiplies by a thousand of his own.

A factor beside a text is how a slider in degrees came to be scaled as milliradians, and why a heading was written in
degrees where its limit was not.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "commission"
ROOMS = ("app", "cli", "studies")
FACTORS = (100.0, 1000.0)
CONVERSIONS = ("degrees", "rad2deg")
"""Names of functions that turn radians into degrees."""
GEOMETRY = {
    "app/run/vehicle_layer.py": "how many strokes an arc has",
    "studies/plausibility.py": "what is a thousand times too fast",
}
"""Where such a factor is no unit of a shown number, and what it is instead."""


def own_factors(source: str) -> list[str]:
    """Return the expressions in a source that change a unit by a factor of their own."""
    found: list[str] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in CONVERSIONS:
            found.append(ast.unparse(node))
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
            sides = (node.left, node.right)
            if any(isinstance(side, ast.Constant) and side.value in FACTORS for side in sides):
                found.append(ast.unparse(node))
    return found


def test_a_factor_and_a_conversion_are_found() -> None:
    """Or the test below could not fail."""
    assert own_factors("f'{error * 1000:.1f} mm, {np.degrees(angle):.1f}, {100.0 * share:.0f} %, {2.0 * sigma}'") == [
        "error * 1000",
        "np.degrees(angle)",
        "100.0 * share",
    ]


@pytest.mark.parametrize("room", ROOMS)
def test_what_is_shown_gets_its_unit_from_a_quantity(room: str) -> None:
    """No text or curve has a factor of its own."""
    for path in sorted((PACKAGE / room).rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if name not in GEOMETRY:
            assert own_factors(path.read_text(encoding="utf-8")) == [], name
