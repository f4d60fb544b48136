"""Reflector tables of any origin: `reflectors.csv` by its strict rules, others as if pasted from a spreadsheet."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from commission.errors import FileFormatError
from commission.io.csv_table import is_row, read_table, stated_delimiter
from commission.io.findings import Findings
from commission.io.imk import ReflectorImport
from commission.io.pasted_table import parse_table
from commission.io.reading import read_text
from commission.io.reflector_tables import OPTIONAL, REQUIRED, SIZE_LIMIT, reflectors_of


def read_any_table(path: Path) -> ReflectorImport:
    """Read a reflector table.

    Parameters
    ----------
    path : file whose cells are separated by commas, semicolons or tabs.

    Returns
    -------
    imported : with the columns of `reflectors.csv`, exactly what it says; otherwise what `parse_table` makes of it.
        Columns that the table lacks are not among the `fields`: about those it says nothing.

    Raises
    ------
    FileFormatError
        names line and column, what was found and what is expected.
    """
    found = Findings()
    lines = read_text(path, SIZE_LIMIT, found).replace("\r", "\n").split("\n")
    header = next((line for line in lines if is_row(line) and stated_delimiter(line) is None), "")
    names = {cell.strip(' "').lower() for cell in header.split(";" if ";" in header else ",")} - {""}
    if not set(REQUIRED) <= names <= {*REQUIRED, *OPTIONAL}:
        try:
            imported = parse_table("\n".join(line if is_row(line) else "" for line in lines))
        except FileFormatError as error:
            raise FileFormatError(path, error.where, error.problem, error.remedy) from error
        return dataclasses.replace(imported, warnings=(*found.lines(), *imported.warnings))
    blocks = list(read_table(path, REQUIRED, OPTIONAL, size_limit=SIZE_LIMIT, found=found))
    fields = tuple(blocks[0].columns) if blocks else REQUIRED
    reflectors = reflectors_of(blocks, found)
    return ReflectorImport(reflectors, found.lines(), fields)
