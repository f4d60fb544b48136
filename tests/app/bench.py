"""A page of one service that studies the site: tests ask, edit, and hear its jobs out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

from commission.app.base.actions import Action
from commission.app.base.service import Context, Service
from commission.app.base.state import AppState
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from tests.app.asking import after, joined
from tests.app.owning import Owner

Studying = TypeVar("Studying", bound=Service)


class Bench(Owner[Studying]):
    """A service, the state that it follows, and the queue of its jobs."""

    def __init__(self, make: Callable[[Context], Studying], project: Project) -> None:
        self.state = joined(AppState(project=project, saved=project))
        super().__init__(make, self.state)

    @property
    def view(self) -> Any:
        """What the service shows now."""
        return self.service.view  # type: ignore[attr-defined]

    def ask(self, *wishes: Action) -> None:
        self.state = after(self.state, *wishes).state
        self.service.follow(self.state)

    def edit(self, project: Project) -> None:
        self.state = replace(self.state, project=project)
        self.service.follow(self.state)

    def move(self, index: int, dx: float) -> None:
        reflectors = list(self.state.project.reflectors.reflectors)
        reflectors[index] = replace(reflectors[index], x=reflectors[index].x + dx)
        self.edit(replace(self.state.project, reflectors=ReflectorMap(tuple(reflectors))))

    def found(self) -> Any:
        """Hear every job out; return what there is then."""
        self.settle(self.state)
        return self.view
