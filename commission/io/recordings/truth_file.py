"""The file `truth.json` of a virtual drive: the constants that were drawn for it. Read back as the frozen value.

Numbers keep all their digits; the file says its version, so that later ones can hold more.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from commission.io.atomic import write_text
from commission.io.conversion import convert
from commission.io.reading import read_text
from commission.io.recordings.versioned_json import json_of, refuse_other_versions
from commission.site.disturbances import ScannerError
from commission.site.truth import TAG_CAMERA, TruePlace, TrueTag, TrueWheels, Truth

TRUTH = "truth.json"
SCHEMA = 1
"""Version of the file."""
SIZE_LIMIT = 32_000_000
"""Bytes of the file; 10,000 reflectors need 1,000,000."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TruthDocument:
    """Keys of `truth.json`, in SI units and radians."""

    schema: int
    """Version of the file."""
    seed: int
    """Seed of the drive."""
    route: str
    """Route that was driven."""
    wheels: TrueWheels = field(default_factory=TrueWheels)
    """Noise and scale of the wheels."""
    scanners: tuple[ScannerError, ...] = ()
    """Errors of each scanner."""
    reflectors: tuple[TruePlace, ...] = ()
    """Reflectors that do not stand where the map says."""
    tags: tuple[TrueTag, ...] = ()
    """Tags that do not stand where the map says."""
    tag_camera: ScannerError = field(default_factory=lambda: ScannerError(scanner=TAG_CAMERA))
    """Errors of the camera that looks for them."""


def write_truth(path: Path, truth: Truth) -> None:
    """Write what is true in a virtual drive; raises FileFormatError when the file cannot be written."""
    write_text(path, truth_text(truth))


def truth_text(truth: Truth) -> str:
    """Return what is true in a virtual drive as the text of the file."""
    values = {"schema": SCHEMA, **msgspec.to_builtins(truth)}
    return json.dumps(values, indent=1, ensure_ascii=False) + "\n"


def read_truth(path: Path) -> Truth:
    """Read what is true in a virtual drive.

    Raises
    ------
    FileFormatError
        the file is damaged, of another version, or holds something that is not expected; names the key.
    """
    return truth_of(path, read_text(path, SIZE_LIMIT))


def truth_of(path: Path, text: str) -> Truth:
    """Return what the text of such a file says; raises FileFormatError like `read_truth`, naming the path."""
    values, document = json_of(path, text, "what this program wrote")
    if not isinstance(values, dict) or "schema" not in values:
        raise document.error(("schema",), "is missing", f"an object that begins with schema {SCHEMA}")
    refuse_other_versions(document, values["schema"], SCHEMA)
    keys = convert(document, TruthDocument)
    return Truth(
        seed=keys.seed,
        route=keys.route,
        wheels=keys.wheels,
        scanners=keys.scanners,
        reflectors=keys.reflectors,
        tags=keys.tags,
        tag_camera=keys.tag_camera,
    )
