"""One meaning per class name: who reads `Segment` must not have to look where it was imported from."""

import ast
from collections import defaultdict

from tests.conftest import REPOSITORY


def test_no_class_name_stands_for_two_things():
    modules = defaultdict[str, list[str]](list)
    for path in sorted((REPOSITORY / "commission").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                modules[node.name].append(str(path.relative_to(REPOSITORY)))
    twice = {name: where for name, where in modules.items() if len(where) > 1}
    assert twice == {}
