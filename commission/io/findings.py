"""What an import noticed and could live with: one line for each kind of trouble, however often the file repeats it."""

from __future__ import annotations

SHOWN_LIMIT = 100
"""Different findings that are told; a file that is wrong throughout says so in fewer."""


class Findings:
    """Collects findings while a file is read.

    A finding is a place ("edge 'N1-N2'") and a problem ("maxSpeed is text"). The same problem at many places becomes
    one line that names the first place and counts the others.
    """

    def __init__(self) -> None:
        self._places: dict[str, dict[str, None]] = {}
        self._untold = 0

    def add(self, where: str, problem: str) -> None:
        """Note a problem; `where` may be empty when the file as a whole is meant."""
        problem = " ".join(problem.split())
        if problem in self._places or len(self._places) < SHOWN_LIMIT:
            self._places.setdefault(problem, {})[" ".join(where.split())] = None
        else:
            self._untold += 1

    def lines(self) -> tuple[str, ...]:
        """One line for each problem, in the order in which they were found."""
        lines = [_line(problem, list(places)) for problem, places in self._places.items()]
        if self._untold:
            lines.append(f"and {self._untold} more findings")
        return tuple(lines)


def shown(value: object) -> str:
    """Value from a file as a message shows it: quoted, on one line, short."""
    if isinstance(value, dict | list):
        return "a mapping" if isinstance(value, dict) else "a list"
    # repr of an integer of a million digits would itself be the attack.
    text = "a huge number" if isinstance(value, int) and value.bit_length() > 200 else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _line(problem: str, places: list[str]) -> str:
    if not places[0]:
        return problem
    others = len(places) - 1
    return f"{places[0]}{f' and {others} more' if others else ''}: {problem}"
