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
    Mutant(
        name="the heatmap forgets how many beams a reflector must get",
        file=FOLDER + "coverage/settings.py",
        find="            visibility=conditions.visibility,\n",
        replace="",
        tests=(TESTS + "coverage/test_service.py::test_under_other_conditions_the_floor_is_computed_anew",),
    ),
    Mutant(
        name="a kept result counts as that of any input",
        file=FOLDER + "base/kept.py",
        find="return self.inputs == inputs",
        replace="return self.inputs is not None",
        tests=(TESTS + "base/test_kept.py::test_it_is_computed_once_for_one_input_and_again_for_another",),
    ),
    Mutant(
        name="what is cancelled after its end is heard of",
        file=FOLDER + "base/jobs.py",
        find="if each.key != key}",
        replace="if number not in self._unfinished or each.key != key}",
        tests=(TESTS + "base/test_jobs.py::test_nothing_follows_from_a_job_that_is_cancelled_after_its_end",),
    ),
    Mutant(
        name="without a map the heatmap keeps its edge when a reflector moves it",
        file=FOLDER + "coverage/following.py",
        find="now.floor_map is None and now.lattice() != self.live.coverage.lattice",
        replace="False",
        tests=(
            TESTS + "coverage/test_service.py::"
            "test_without_a_map_a_reflector_that_moves_the_floors_edge_is_computed_anew",
        ),
    ),
)
