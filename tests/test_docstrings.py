"""Docstrings hold what a reader needs before he calls a function, as far as a machine can tell."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from tests.conftest import REPOSITORY

MANY = 3
"""Parameters from which on each of them is described."""

HANDLED = "reduce.register"
"""Decorator of the handlers of actions: all have the parameters of `reduce`, which describes them."""

HANDED_ON = re.compile(r"[Pp]arameters (and errors )?(as )?(in|for|there|of) ")
"""A function that hands all on may name the one that describes them."""

SOURCE = re.compile(
    r"equation|[Aa]lgorithm|section|\b(18|19|20)\d\d\b|[Dd]erived|by definition|by induction|at the top of the module"
)
"""Where a formula comes from: paper, book, derivation, or nothing but the meaning of the words."""

FORMULA = re.compile(r"[=<>^/]|\w\(")
"""What a line with a formula has in it."""


@dataclass(frozen=True)
class Function:
    """A public function of the package."""

    where: str
    node: ast.FunctionDef
    is_method: bool = False
    """Whether the first parameter is the instance or the class."""
    owner: ast.ClassDef | None = None
    """Class of a method."""

    @property
    def parameters(self) -> list[str]:
        given = self.node.args
        names = [argument.arg for argument in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
        return names[1:] if self.is_method else names

    @property
    def variadic(self) -> list[str]:
        return [argument.arg for argument in (self.node.args.vararg, self.node.args.kwarg) if argument is not None]

    @property
    def docstring(self) -> str:
        return inspect.cleandoc(ast.get_docstring(self.node) or "")

    @property
    def is_handler(self) -> bool:
        return HANDLED in map(ast.unparse, self.node.decorator_list)

    @property
    def is_kernel(self) -> bool:
        names = [decorator.id for decorator in self.node.decorator_list if isinstance(decorator, ast.Name)]
        return any(name.startswith("compiled") for name in names)

    def section(self, title: str) -> str:
        """Content of a section of the docstring; empty when there is none."""
        found = re.search(rf"^{title}\n-+\n(.*?)(?=^\w+\n-+\n|\Z)", self.docstring, re.MULTILINE | re.DOTALL)
        return found[1].strip() if found else ""

    @property
    def described(self) -> set[str]:
        """Names before the colons of the section on parameters."""
        heads = re.findall(r"^(\S.*?) :", self.section("Parameters"), re.MULTILINE)
        return {name.strip(" *") for head in heads for name in head.split(",")}


def functions() -> Iterator[Function]:
    """Public functions and methods of all rooms."""
    package = REPOSITORY / "commission"
    for path in sorted(package.rglob("*.py")):
        yield from _public(ast.parse(path.read_text(encoding="utf-8")), path.relative_to(package).as_posix())


def _public(node: ast.AST, where: str) -> Iterator[Function]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.ClassDef | ast.FunctionDef) and not child.name.startswith("_"):
            name = f"{where}:{child.name}"
            if isinstance(child, ast.ClassDef):
                yield from _public(child, name)
            else:
                is_static = any(isinstance(d, ast.Name) and d.id == "staticmethod" for d in child.decorator_list)
                owner = node if isinstance(node, ast.ClassDef) else None
                yield Function(name, child, owner is not None and not is_static, owner)


ALL = list(functions())
WITH_MANY = [function for function in ALL if len(function.parameters) >= MANY]
METHODS = {(f.owner.name, f.node.name): f for f in ALL if f.owner is not None}
CLASSES = {f.owner.name: f.owner for f in ALL if f.owner is not None}
KERNELS = [function for function in ALL if function.is_kernel]


def test_functions_are_found() -> None:
    assert len(WITH_MANY) > 150
    assert len(KERNELS) > 60


def test_each_of_three_or_more_parameters_is_described() -> None:
    missing = {
        f.where: sorted(set(f.parameters) - f.described - described_above(f))
        for f in WITH_MANY
        if not f.is_handler and not HANDED_ON.search(f.docstring)
    }
    assert {where: names for where, names in missing.items() if names} == {}


def described_above(function: Function) -> set[str]:
    """What the method that a method overrides describes, when it has the same parameters; class names are unique."""
    names = [base.id for base in function.owner.bases if isinstance(base, ast.Name)] if function.owner else []
    while names:
        name = names.pop()
        overridden = METHODS.get((name, function.node.name))
        if overridden is not None and overridden.described and overridden.parameters == function.parameters:
            return overridden.described
        names += [base.id for base in CLASSES[name].bases if isinstance(base, ast.Name)] if name in CLASSES else []
    return set()


def test_handlers_have_the_parameters_that_reduce_describes() -> None:
    (reduce,) = [function for function in ALL if function.where == "app/base/reducer.py:reduce"]
    assert reduce.described == set(reduce.parameters)
    handlers = [function for function in ALL if function.is_handler]
    assert len(handlers) > 90
    assert {tuple(name.lstrip("_") for name in f.parameters) for f in handlers} == {tuple(reduce.parameters)}


def test_what_is_described_is_a_parameter() -> None:
    others = {f.where: sorted(f.described - set(f.parameters) - set(f.variadic)) for f in ALL}
    assert {where: names for where, names in others.items() if names} == {}


def test_kernel_says_its_formula_and_where_it_comes_from() -> None:
    assert {f.where: problem for f in KERNELS if (problem := problem_of(f))} == {}


def problem_of(kernel: Function) -> str:
    """Say what a kernel's docstring lacks.

    The formula stands under `Notes`, with its source. A kernel that is made of others names one in its first line; one
    that only searches or counts says that there is no formula.
    """
    notes = " ".join(kernel.section("Notes").split())
    if not notes:
        return "" if "`" in kernel.docstring.splitlines()[0] else "no section `Notes`, nor a kernel in the first line"
    if notes.startswith("No formula:"):
        return ""
    if not FORMULA.search(notes):
        return "`Notes` hold no formula"
    return "" if SOURCE.search(notes) else "`Notes` do not say where the formula comes from"


@pytest.mark.parametrize(
    ("docstring", "is_complete"),
    [
        ("Sum.\n\nNotes\n-----\na + b = c: Author 1999, equation 3.", True),
        ("Sum.\n\nNotes\n-----\na + b = c, by\ndefinition.", True),
        ("Sum.\n\nNotes\n-----\na + b = c.", False),
        ("Sum.\n\nNotes\n-----\nAs Author 1999 says.", False),
        ("Sum.\n\nNotes\n-----\nNo formula: it counts.", True),
        ("Sums: `add` for each.", True),
        ("Sum.", False),
    ],
)
def test_a_formula_without_its_source_is_seen(docstring: str, is_complete: bool) -> None:
    (node,) = ast.parse(f"def f():\n    {docstring!r}\n").body
    assert isinstance(node, ast.FunctionDef)
    assert (problem_of(Function("f", node)) == "") == is_complete
