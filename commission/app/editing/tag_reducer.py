"""What actions about tags mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.effects import FlyTo
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.editing import tag_actions as actions
from commission.app.editing.editor import editor_of
from commission.app.editing.tag_gestures import tag_of
from commission.errors import UsageError
from commission.site.editing.named import TAGS
from commission.site.fields import with_field
from commission.site.tags import Tag

WORDS = {"x": "place", "y": "place", "sigma": "1σ of the place", "heading_sigma": "1σ of the heading"}
"""What the fields of a tag are called in an undo step, where not by their names."""


def _selected(state: AppState, sender: Sender) -> Tag:
    """Return the tag that a browser has selected; raises UsageError for none."""
    tag = tag_of(state.project, editor_of(state, sender.browser))
    if tag is None:
        raise UsageError("no tag is selected; expected one")
    return tag


def _with_tags(state: AppState, tags: tuple[Tag, ...], edit: Edit, selected: str) -> Outcome:
    """Return what follows from other tags: one undo step, and one of them is selected."""
    if tags == state.project.tags:
        return Outcome(state)
    after = edited(state, replace(state.project, tags=tags), edit)
    browser = edit.sender.browser
    return Outcome(after.with_browser(browser, editor_of(after, browser).selecting(tag=selected)))


@reduce.register
def select_tag(action: actions.SelectTag, state: AppState, sender: Sender) -> Outcome:
    editor = editor_of(state, sender.browser).selecting(tag=action.id)
    selecting, tag = state.with_browser(sender.browser, editor), tag_of(state.project, editor)
    if not action.fly or tag is None:
        return Outcome(selecting)
    return Outcome(selecting, (FlyTo((tag.x, tag.y)),))


@reduce.register
def place_tag(action: actions.PlaceTag, state: AppState, sender: Sender) -> Outcome:
    tags = state.project.tags
    name = TAGS.fresh(tags)
    x, y = action.place
    placed = replace(tags[-1], id=name, x=x, y=y) if tags else Tag(id=name, x=x, y=y)
    return _with_tags(state, TAGS.put(tags, placed), Edit(f"place tag {name}", sender), name)


@reduce.register
def move_tag(action: actions.MoveTag, state: AppState, sender: Sender) -> Outcome:
    tag = _selected(state, sender)
    verb = "turn" if action.place == (tag.x, tag.y) else "move"
    moved = replace(tag, x=action.place[0], y=action.place[1], heading=action.heading)
    tags = TAGS.put(state.project.tags, moved, tag.id)
    return _with_tags(state, tags, Edit(f"{verb} tag {tag.id}", sender), tag.id)


@reduce.register
def set_tag(action: actions.SetTag, state: AppState, sender: Sender) -> Outcome:
    tag = _selected(state, sender)
    changed = with_field(tag, action.field, action.value, "field of a tag")
    is_name = action.field == "id"
    what = f"rename tag {tag.id}" if is_name else f"set {WORDS.get(action.field, action.field)} of tag {tag.id}"
    edit = Edit(what, sender, "" if is_name else f"tag {tag.id}:{action.field}")
    return _with_tags(state, TAGS.put(state.project.tags, changed, tag.id), edit, changed.id)


@reduce.register
def delete_tag(_action: actions.DeleteTag, state: AppState, sender: Sender) -> Outcome:
    tag = _selected(state, sender)
    return _with_tags(state, TAGS.remove(state.project.tags, tag.id), Edit(f"delete tag {tag.id}", sender), "")
