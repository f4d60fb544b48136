"""What a click or a drag hits of the tags, and where it puts them. Pure."""

from __future__ import annotations

from dataclasses import replace

from commission.app.editing.editor import Editor, Grab, Point
from commission.app.editing.posed_gestures import nearest_posed, turned_to
from commission.site.project import Project
from commission.site.tags import Tag


def tag_at(project: Project, place: Point, reach: float) -> str | None:
    """Return the id of the nearest tag within reach [m] of a place; none when there is none.

    Parameters
    ----------
    project : has the tags.
    place : point [m], map frame.
    reach : largest distance [m].
    """
    found = nearest_posed(project.tags, place, reach)
    return None if found is None else project.tags[found].id


def tag_of(project: Project, editor: Editor) -> Tag | None:
    """Return the selected tag; none when that is nothing, or it is gone."""
    return next((tag for tag in project.tags if tag.id == editor.tag), None)


def moved_tag(project: Project, editor: Editor) -> Tag | None:
    """Return the selected tag as the drag under way would leave it."""
    tag, drag = tag_of(project, editor), editor.drag
    if tag is None or drag is None:
        return tag
    if drag.grab is Grab.HEADING:
        return replace(tag, heading=turned_to(tag, drag.now))
    return replace(tag, x=drag.now[0], y=drag.now[1]) if drag.grab is Grab.POSED else tag
