"""The page stays in few rooms that know little of each other."""

import tomllib
from pathlib import Path

import pytest

from tests.conftest import REPOSITORY
from tests.tools.count_rooms import ORDER, count

MOST_ROOMS, MOST_ARROWS = 18, 64


def app_of(folder: Path, modules: dict[str, str]) -> Path:
    """Write an app of modules, given as their text by their path."""
    for name, text in modules.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        (path.parent / "__init__.py").touch()
        path.write_text(text)
    return folder


def test_the_page_has_few_rooms_and_arrows_and_none_against_the_order():
    counted = count()
    assert len(counted.rooms) <= MOST_ROOMS
    assert len(counted.arrows) <= MOST_ARROWS
    assert counted.against == frozenset()


def test_the_import_contract_has_no_exceptions():
    with (REPOSITORY / "pyproject.toml").open("rb") as file:
        contracts = {each["id"]: each for each in tomllib.load(file)["tool"]["importlinter"]["contracts"]}
    assert "ignore_imports" not in contracts["features"]


def test_the_order_names_each_room_once():
    named = [room for row in ORDER for room in row]
    assert len(named) == len(set(named))
    assert set(named) == count().rooms


@pytest.mark.parametrize(
    ("module", "text", "arrow", "is_against"),
    [
        ("run/panel.py", "from commission.app.base.panel import BasePanel", ("run", "base"), False),
        ("run/panel.py", "import commission.app.editing.editor", ("run", "editing"), False),
        ("run/panel.py", "def f():\n    from commission.app import editing", ("run", "editing"), False),
        ("launch.py", "from commission.app.run.panel import Panel", ("launch", "run"), False),
        ("run/panel.py", "from commission.app.tune.panel import Panel", ("run", "tune"), True),
        ("base/panel.py", "from commission.app.run.panel import Panel", ("base", "run"), True),
        ("editing/panel.py", "from commission.app.run.panel import Panel", ("editing", "run"), True),
        ("run/panel.py", "from commission.app.strange.panel import Panel", ("run", "strange"), True),
        ("strange/panel.py", "from commission.app.base.panel import Panel", ("strange", "base"), True),
    ],
)
def test_an_arrow_against_the_order_is_counted(tmp_path, module, text, arrow, is_against):
    rooms = ("base", "editing", "run", "tune", "strange")
    app = app_of(tmp_path, {"launch.py": "", **{f"{room}/panel.py": "" for room in rooms}, module: text})
    counted = count(app)
    assert counted.rooms == {"launch", *rooms}
    assert counted.arrows == {arrow}
    assert counted.against == ({arrow} if is_against else frozenset())


def test_what_a_room_imports_of_itself_or_of_others_is_no_arrow(tmp_path):
    own = "import commission.app.run.view\nfrom commission.site import project\n"
    assert count(app_of(tmp_path, {"run/panel.py": own, "base/panel.py": ""})).arrows == frozenset()
