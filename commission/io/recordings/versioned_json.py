"""JSON beside a recording that states its version."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import msgspec

from commission.errors import FileFormatError
from commission.io.yaml_document import YamlDocument

_NO_NUMBER = re.compile(r"[\[:,]\s*(-?(?:NaN|nan|Infinity|inf))\b")


def json_of(path: Path, text: str, expected: str) -> tuple[Any, YamlDocument]:
    """Return what a text of JSON holds: its content, and the same as a document that names its keys in errors.

    Parameters
    ----------
    path : where it was read, for messages.
    text : of the file.
    expected : said of a text that is no JSON.

    Raises
    ------
    FileFormatError
        it is no JSON.
    """
    try:
        values = msgspec.json.decode(text)
    except (msgspec.DecodeError, RecursionError) as error:
        word = _NO_NUMBER.search(text)
        if word is not None:
            raise FileFormatError(path, "", f"holds {word[1]}, for which JSON has no word", "finite numbers") from error
        raise FileFormatError(path, "", f"is no JSON ({error})", expected) from error
    return values, YamlDocument(path, values)


def refuse_other_versions(document: YamlDocument, stated: object, known: int) -> None:
    """Raise FileFormatError where a file is of a version that this program does not know.

    Parameters
    ----------
    document : the file.
    stated : its key `schema`.
    known : the version that this program knows.
    """
    if stated != known or isinstance(stated, bool):
        raise document.error(("schema",), f"is {stated!r}", f"{known}, the version this program knows")
