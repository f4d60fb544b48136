"""What every layer has: a name, entries in the legend, nodes in the shared scene and in a browser's own."""

from __future__ import annotations

from enum import StrEnum
from typing import Protocol

from viser import SceneApi, SceneNodeHandle

from commission.app.base.theme import Legend
from commission.app.base.view import PageView
from commission.site.project import Project


class LayerGroup(StrEnum):
    """What a layer belongs to: the groups of the list of layers, in its order."""

    MAP = "Map"
    SITE = "Site"
    RUN = "Run"
    PLAN = "Plan"


class Layer(Protocol):
    """One drawn thing that can be switched off."""

    name: str
    """Shown beside its switch; unique."""
    group: LayerGroup
    """What it belongs to."""
    rank: int
    """Where it stands in its group: what lies lowest comes first."""
    legend: tuple[Legend, ...]
    """Its entries in the legend."""
    reads: tuple[str, ...]
    """Parts of the project that it draws from: it is drawn anew when one of them is another value."""

    def show_site(self, project: Project) -> None:
        """Draw what depends on the project alone."""

    def draw(self, view: PageView) -> None:
        """Draw what changes with each picture; whatever has not changed costs nothing."""

    def draw_slowly(self, view: PageView) -> None:
        """Draw what may lag some pictures behind: whatever grows with the drive."""

    def is_used(self, view: PageView) -> bool:
        """Whether there is something that the legend has to explain."""
        ...

    def colors_floor(self, view: PageView) -> bool:
        """Whether it colors places on the floor, on which others are seen only with a casing."""
        ...

    def furnish(self, scene: SceneApi, *, three_d: bool) -> tuple[SceneNodeHandle, ...]:
        """Add what only one browser's view needs; the caller removes it when the view changes."""
        ...

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the layer's nodes in the shared scene, to show or hide."""
        ...


class BaseLayer:
    """A layer that draws nothing: each one overrides what it needs."""

    name = ""
    group = LayerGroup.PLAN
    rank = 0
    legend: tuple[Legend, ...] = ()
    reads: tuple[str, ...] = ("floor_map", "reflectors", "routes", "vehicle", "scanners")

    def __init__(self, scene: SceneApi) -> None:
        self.scene = scene

    def show_site(self, project: Project) -> None:
        """Draw what depends on the project alone."""

    def draw(self, view: PageView) -> None:
        """Draw what changes with each picture."""

    def draw_slowly(self, view: PageView) -> None:
        """Draw what may lag some pictures behind."""

    def is_used(self, view: PageView) -> bool:  # noqa: ARG002 - a default
        """Whether there is something that the legend has to explain."""
        return True

    def colors_floor(self, view: PageView) -> bool:  # noqa: ARG002 - a default
        """Whether it colors places on the floor."""
        return False

    def furnish(self, scene: SceneApi, *, three_d: bool) -> tuple[SceneNodeHandle, ...]:  # noqa: ARG002 - a default
        """Add what only one browser's view needs."""
        return ()

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the layer's nodes in the shared scene."""
        return ()
