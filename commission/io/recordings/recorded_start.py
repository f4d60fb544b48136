"""Where a recording began, as a text within it: the pose that the localizer was started with, to the last bit."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from commission.errors import FileFormatError
from commission.io.conversion import convert
from commission.io.recordings.versioned_json import json_of, refuse_other_versions
from commission.site.recorded_start import RecordedStart

SCHEMA = 1
"""Version of the text."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StartDocument:
    """Keys of the text, in SI units."""

    schema: int = SCHEMA
    """Version."""
    pose: tuple[float, ...]
    """x [m], y [m], theta [rad] of base, map frame."""
    covariance: tuple[tuple[float, ...], ...]
    """Its 3 x 3 covariance."""
    sought: bool = False
    """Whether the vehicle looked where it is."""


def recorded_start_text(start: RecordedStart) -> str:
    """Return a start as text; what is read from it is the same to the last bit."""
    text = {"schema": SCHEMA, "pose": start.pose.tolist(), "covariance": start.covariance.tolist()}
    return json.dumps(text | ({"sought": True} if start.sought else {}))


def recorded_start_of(path: Path, text: str) -> RecordedStart:
    """Return what a text says; raises FileFormatError that names the recording and the key."""
    values, document = json_of(path, text, '{"pose": [x, y, theta], "covariance": 3 x 3}')
    if not isinstance(values, dict):
        raise document.error((), f"is {values!r}", "an object with pose and covariance")
    refuse_other_versions(document, values.get("schema", SCHEMA), SCHEMA)
    keys = convert(document, StartDocument)
    try:
        return RecordedStart(keys.pose, keys.covariance, keys.sought)  # pyright: ignore[reportArgumentType]
    except ValueError as error:
        found, _, expected = str(error).partition("; expected ")
        raise FileFormatError(path, "start", found, expected) from error
