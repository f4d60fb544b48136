"""The result of `tune` as files: parameters for the project, for ROS 2, for a controller, and the figures behind them.

Each file names the project, the recording and the variant that it is of; nothing is computed in here.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from commission.io.atomic import write_text
from commission.io.residual_charts import page_of
from commission.site.fields import field_info, get_field, walk_fields
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.studies.calibration import Calibration
from commission.studies.diagnosis import Diagnosis
from commission.studies.residual_study import ResidualStudy
from commission.studies.residual_words import residual_lines
from commission.studies.variants import VariantsResult

PARAMETERS, ROS, TABLE, COMPARISON, REFLECTORS, RESIDUALS, SUMMARY = (
    *("parameters.yaml", "ros_parameters.yaml", "parameters.csv"),
    *("comparison.csv", "reflectors.csv", "residuals.html", "summary.json"),
)
"""Names of the files."""
FITTED = (
    "the comparison is over the drive that the values were fitted to, and flatters them; compare on another drive: "
    "localize PROJECT OTHER, with and without them"
)
"""What is said beside the figures of both."""
FILES = (PARAMETERS, ROS, TABLE, COMPARISON, REFLECTORS, RESIDUALS, SUMMARY)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TuneResult:
    """All that is written."""

    project: Project
    """With the proposed values in it."""
    project_digest: str
    """SHA-256 of the files of the project that was tuned."""
    recording_digest: str
    """SHA-256 of the recording."""
    variant: str
    """Name of the variant that the parameters are."""
    calibration: Calibration
    """Where the values come from."""
    diagnosis: Diagnosis
    """What is wrong with the site."""
    compared: VariantsResult
    """The project as it is against the variant."""
    residuals: ResidualStudy
    """Residuals of the drive with the project as it is."""

    @property
    def origin(self) -> dict[str, str]:
        """Project, recording and variant, as each file names them."""
        return {"project": self.project_digest, "recording": self.recording_digest, "variant": self.variant}


def write_tuned(folder: Path, result: TuneResult) -> None:
    """Write all files.

    Parameters
    ----------
    folder : exists.
    result : what was found.
    """
    texts = {
        PARAMETERS: _yaml(result),
        ROS: _ros(result),
        TABLE: _table(result),
        COMPARISON: _comparison(result.compared),
        REFLECTORS: _reflectors(result.diagnosis),
        RESIDUALS: page_of(
            result.residuals, residual_lines(result.residuals), [*map(": ".join, result.origin.items())]
        ),
        SUMMARY: json.dumps(_summary(result), indent=2) + "\n",
    }
    for name, text in texts.items():
        write_text(folder / name, text)


def _yaml(result: TuneResult) -> str:
    """Parameters as they stand in a project.yaml, and what else of the project the variant changes."""
    lines = [*_comments(result), "parameters:", *_groups(result.project, "  ")]
    site = [each for each in result.calibration.proposed if each.key.startswith(("scanners.", "reflectors."))]
    lines += [f"# project: {each.key} = {each.proposed:.9g} (was {each.before:.9g})" for each in site]
    return "\n".join(lines) + "\n"


def _ros(result: TuneResult) -> str:
    """The same as parameters of any node of ROS 2, with the mounting and the clock of each scanner."""
    lines = [*_comments(result), "/**:", "  ros__parameters:", *_groups(result.project, "    "), "    scanners:"]
    for scanner in result.project.scanners:
        mounting = ", ".join(_number(float(each)) for each in scanner.mounting)
        lines += [
            f"      {json.dumps(scanner.name)}:",
            f"        mounting: [{mounting}]",
            f"        clock_offset: {_number(scanner.clock_offset)}",
        ]
    return "\n".join(lines) + "\n"


def _comments(result: TuneResult) -> list[str]:
    """Lines that say what a file is of."""
    return ["# SI units and radians", *(f"# {name}: {text}" for name, text in result.origin.items())]


def _groups(project: Project, indent: str) -> Iterator[str]:
    """Parameters as nested YAML; what is None is left out, as a node of ROS knows no such value."""
    group = ""
    for key, content in _parameters(project):
        owner, _, name = key.partition(".")
        if owner != group:
            group = owner
            yield f"{indent}{group}:"
        yield f"{indent}  {name}: {_scalar(content)}"


def _parameters(project: Project) -> Iterator[tuple[str, Any]]:
    """Each parameter that has a value."""
    for key, _ in walk_fields(Parameters):
        content = get_field(project.parameters, key)
        if content is not None:
            yield key, content


def _scalar(content: Any) -> str:
    """Return a value as YAML."""
    if isinstance(content, bool):
        return str(content).lower()
    if isinstance(content, Enum):
        return json.dumps(str(content.value))
    if isinstance(content, float):
        return _number(content)
    return str(content) if isinstance(content, int) else json.dumps(str(content))


def _number(value: float) -> str:
    """Return a number that every reader of YAML takes for a float."""
    text = f"{value:.9g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa if '.' in mantissa else mantissa + '.0'}e{exponent}"
    return text if "." in text else text + ".0"


def _table(result: TuneResult) -> str:
    """All figures with unit, and where they come from, for the controller of the vehicle."""
    found = {each.key: each for each in result.calibration.values}
    rows = ["key,value,unit,before,sigma,verdict"]

    def row(key: str, content: Any, unit: str) -> str:
        value = found.get(key)
        said = ",," if value is None else f"{value.before:.9g},{value.sigma:.6g},{_cell(value.verdict.value)}"
        return f"{_cell(key)},{_scalar(content)},{unit},{said}"

    for key, content in _parameters(result.project):
        quantity = field_info(result.project.parameters, key).quantity
        rows.append(row(key, content, "" if quantity is None else quantity.unit))
    for scanner in result.project.scanners:
        name = f"scanners.{scanner.name}"
        for axis, unit, content in zip(("x", "y", "heading"), ("m", "m", "rad"), scanner.mounting, strict=True):
            rows.append(row(f"{name}.mounting.{axis}", float(content), unit))
        rows.append(row(f"{name}.clock_offset", scanner.clock_offset, "s"))
    # As comments would be cells of a table: in its last rows.
    rows += [f"origin.{name},{_cell(text)},,,," for name, text in result.origin.items()]
    return "\n".join(rows) + "\n"


def _cell(text: str) -> str:
    """Return text as a cell of a table: quoted where it has to be."""
    return '"' + text.replace('"', '""') + '"' if any(each in text for each in ',"\n') else text


def _comparison(compared: VariantsResult) -> str:
    """Figures of the project as it is and of the variant."""
    rows = [",".join(("figure", *map(_cell, compared.inputs.names), "verdict"))]
    for each in compared.figures:
        values = ",".join("" if math.isnan(value) else f"{value:.9g}" for value in each.values)
        rows.append(f"{each.figure.key},{values},{each.verdicts[-1].value}")
    return "\n".join(rows) + "\n"


def _reflectors(found: Diagnosis) -> str:
    """Reflectors, one a row."""
    rows = ["id,expected,seen,accepted,range_mean,range_spread,across_mean,across_spread,suspicion"]
    for each in found.reflectors:
        numbers = (each.range_mean, each.range_spread, each.across_mean, each.across_spread)
        cells = ["" if math.isnan(number) else f"{number:.6g}" for number in numbers]
        counts = (str(each.expected), str(each.seen), str(each.accepted))
        rows.append(",".join((_cell(each.id), *counts, *cells, each.suspicion.value if each.suspicion else "")))
    return "\n".join(rows) + "\n"


def _summary(result: TuneResult) -> dict[str, Any]:
    """What was named and proposed, for programs."""
    clusters = result.diagnosis.clusters
    return {
        **result.origin,
        "comparison": FITTED,
        "findings": list(result.diagnosis.lines),
        "proposed": {
            each.key: {"before": each.before, "value": each.proposed, "sigma": each.sigma, "reason": each.reason}
            for each in result.calibration.proposed
        },
        "not_shown": {each.key: each.reason for each in result.calibration.values if each.verdict.name == "NOT_SHOWN"},
        "residuals": list(residual_lines(result.residuals)),
        "things": [{"x": each.x, "y": each.y, "count": each.count, "near": each.near} for each in clusters],
        "notes": list(result.calibration.notes),
    }
