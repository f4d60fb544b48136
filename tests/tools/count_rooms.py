"""Counts the rooms of `commission/app`, the import arrows between them, and the arrows against the order of the rooms.

Run as `python -m tests.tools.count_rooms [FOLDER]`, where FOLDER may be the `commission/app` of another checkout.
A room is a folder of app or a module beside them. An arrow leads from a room to another one that any of its modules
imports, however often and wherever. It is against the order unless it leads from a higher row of `ORDER` to a lower
one: rooms of one row do not see each other. `lint-imports` holds the order; this says how much there is of it.
"""

from __future__ import annotations

import ast
import sys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

PACKAGE = "commission.app"
REPOSITORY = Path(__file__).parents[2]
APP = REPOSITORY / "commission" / "app"

Order = Sequence[Sequence[str]]


def order_of_contract() -> Order:
    """The rows of the import contract `features`, from the top to the bottom."""
    with (REPOSITORY / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    (features,) = [contract for contract in contracts if contract["id"] == "features"]
    return [row.split(" | ") for row in features["layers"]]


ORDER = order_of_contract()

ORDER_BEFORE: Order = [
    [room]
    for room in (
        "launch page runtime background panels cameras layers inspection checking keeping drives session history "
        "reducer exchange mapping editing plan reduction view store actions jobs uploads drawing extent theme server"
    ).split()
]
"""The order that the rooms had as long as app was cut by kind and by feature at once (up to commit 6a7952b)."""


@dataclass(frozen=True, slots=True)
class Count:
    """What was counted."""

    rooms: frozenset[str]
    """Folders and modules of app."""
    arrows: frozenset[tuple[str, str]]
    """From importing to imported room."""
    against: frozenset[tuple[str, str]]
    """Those against the order."""


def rooms_of(app: Path) -> frozenset[str]:
    """Return the folders and modules of app."""
    entries = (path for path in app.iterdir() if path.suffix == ".py" or (path / "__init__.py").is_file())
    return frozenset(path.stem for path in entries if path.stem != "__init__")


def imported(module: Path) -> Iterator[str]:
    """Yield the full names of what a module imports of app."""
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def arrows_of(app: Path) -> frozenset[tuple[str, str]]:
    """Return which room imports which."""
    rooms, arrows = rooms_of(app), set[tuple[str, str]]()
    for module in app.rglob("*.py"):
        source = module.relative_to(app).with_suffix("").parts[0]
        for name in imported(module):
            target = name.removeprefix(f"{PACKAGE}.").partition(".")[0]
            if name.startswith(f"{PACKAGE}.") and source in rooms and target in rooms - {source}:
                arrows.add((source, target))
    return frozenset(arrows)


def count(app: Path = APP, order: Order = ORDER) -> Count:
    """Count the rooms and arrows of an app; a room that the order does not know is against it wherever it occurs."""
    arrows, row = arrows_of(app), {room: number for number, rooms in enumerate(order) for room in rooms}
    allowed = {(a, b) for a, b in arrows if a in row and b in row and row[a] < row[b]}
    return Count(rooms_of(app), arrows, arrows - allowed)


def main(arguments: Sequence[str]) -> None:
    """Print the three numbers, and which arrows are against the order."""
    app = Path(arguments[0]) if arguments else APP
    counted = count(app, ORDER_BEFORE if "store" in rooms_of(app) else ORDER)
    rooms, arrows, against = len(counted.rooms), len(counted.arrows), len(counted.against)
    sys.stdout.write(f"{rooms} rooms, {arrows} arrows, {against} against the order\n")
    for source, target in sorted(counted.against):
        sys.stdout.write(f"  {source} -> {target}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
