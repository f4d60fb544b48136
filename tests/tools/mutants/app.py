"""Faults of the page: what it edits, shows and keeps."""

from tests.tools.mutants.mutant import Mutant

FOLDER, TESTS = "commission/app/", "tests/app/"

APP = (
    Mutant(
        name="middle of a drag counts locked reflectors",
        file=FOLDER + "editing/reducer.py",
        find="if not r.locked]\n    if not movable:\n        return 0.0",
        replace="]\n    if not movable:\n        return 0.0",
        tests=(TESTS + "editing/test_editing.py::test_the_handle_stands_in_the_middle_of_what_moves_with_it",),
    ),
)
