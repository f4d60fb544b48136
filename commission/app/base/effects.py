"""What has to be done besides changing the state, as frozen values: each names one thing for whoever carries it out.

A feature declares its own effects; the service that carries one out names its type (`base.service`). These are the
page's own. "The browser" is the one whose action led to the effect.
"""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Camera


class Effect:
    """Something to do: the base of frozen dataclasses."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class CancelJob(Effect):
    """Stop a piece of background work."""

    number: int
    """Number of the job."""


@dataclass(frozen=True, slots=True)
class Tell(Effect):
    """Show a notification in the browser that asked, or in all of them where the program itself did."""

    text: str
    """One line; what a file holds is told to nobody but who asked for the file."""
    failed: bool
    """Whether something went wrong."""
    everywhere: bool = False
    """Whether all browsers are told whoever asked."""


@dataclass(frozen=True, slots=True)
class PlaceCamera(Effect):
    """Change what the browser looks at."""

    camera: Camera
    """What it looks at."""
    everywhere: bool = False
    """Whether all browsers do: the site may be elsewhere now."""


@dataclass(frozen=True, slots=True)
class FlyTo(Effect):
    """Bring a place into the browser's view."""

    place: tuple[float, float]
    """Where [m], map frame."""


@dataclass(frozen=True, slots=True)
class SendFile(Effect):
    """Let the browser save a file."""

    name: str
    """Name of the file."""
    content: bytes
    """The file."""
