"""Fresh names: the numbering that is there goes on. Names are never taken from something deleted that came last."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable

_NUMBERED = re.compile(r"(.*?)([0-9]*)", re.DOTALL)


def fresh_names(taken: Iterable[str], count: int, like: str) -> tuple[str, ...]:
    """Names that are not taken, numbered on from the highest number in use.

    Parameters
    ----------
    taken : names in use.
    count : how many are wanted.
    like : its text before the number is kept, and the number's width: like `R07` come `R08`, `R09`.

    Returns
    -------
    names : all different, none of them taken.
    """
    match = _NUMBERED.fullmatch(like)
    stem, digits = (match[1], match[2]) if match else (like, "")
    used = set(taken)
    numbers = [int(name[len(stem) :]) for name in used if name.startswith(stem) and _is_number(name[len(stem) :])]
    candidates = (f"{stem}{number:0{len(digits)}d}" for number in itertools.count(max(numbers, default=0) + 1))
    return tuple(itertools.islice((name for name in candidates if name not in used), count))


def _is_number(text: str) -> bool:
    """Whether a text is a number that may be counted on; beyond 18 digits it is a serial number, not a count."""
    return text.isascii() and text.isdigit() and len(text) <= 18
