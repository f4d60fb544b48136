"""One deliberate fault: where it is put, and who must see it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """One deliberate fault."""

    name: str
    """What is wrong, in words."""
    file: str
    """Module, relative to the checkout."""
    find: str
    """Text that occurs exactly once in it."""
    replace: str
    """What stands there instead."""
    tests: tuple[str, ...]
    """Tests of which each must fail: `tests/room/test_file.py::test_name`."""

    def applied_to(self, text: str) -> str:
        """Return the module's text with the fault in it; raises ValueError unless `find` occurs exactly once."""
        count = text.count(self.find)
        if count != 1 or self.find == self.replace:
            raise ValueError(f"{self.file}: {self.find!r} occurs {count} times; expected once, for {self.name!r}")
        return text.replace(self.find, self.replace)
