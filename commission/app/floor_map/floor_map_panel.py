"""Loading a floor map: from the server's computer or from the browser's; progress, cancel, what came of it."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiEvent

from commission.app.base import actions as page_actions
from commission.app.base import theme
from commission.app.base.inputs import write_html
from commission.app.base.panel import BasePanel, Post, escaped, from_browser, posting
from commission.app.base.reach import typed_path
from commission.app.base.uploads import Uploads
from commission.app.base.view import PageView
from commission.app.floor_map import actions
from commission.app.floor_map.draft import ENDINGS, MapFile, MapLoading, MapTrouble
from commission.app.floor_map.draft_fields import MapDraftFields
from commission.site.project import Project
from commission.site.quantity import PERCENT

UPLOAD_LIMIT = 256_000_000
"""Bytes of one upload: it is held in memory until it is read."""
JOBS = ("Reading ", "Loading ")
"""How the names of the jobs of `work` begin."""
KINDS = (
    "<div class='c-note' style='padding:0 6px 4px'>ROS map (.yaml and its image), plain image, CAD drawing (.dxf), "
    "3D model (.stl .obj .glb .ply).</div>"
)


class FloorMapPanel(BasePanel):
    """The folder with which a floor map is loaded."""

    def __init__(self, gui: GuiApi, post: Post, project: Project) -> None:
        self._shown: MapLoading | None = None
        with gui.add_folder("Floor map", expand_by_default=project.floor_map is None):
            kinds = gui.add_html(KINDS)
            mark = gui.add_html(theme.path_mark("map"))
            path = gui.add_text("Map file", "", hint="Path of a file on the computer that serves this page.")
            opened = gui.add_button("Open", hint="Read the file of this path.")

            def open_path(_event: GuiEvent[Any]) -> page_actions.Action:
                typed = path.value.strip()
                if not typed:
                    return page_actions.Report("no file was named; expected its path on the server's computer")
                return actions.OpenMap(MapFile(typed_path(typed)))

            opened.on_click(posting(post, open_path))
            Uploads(gui, lambda browser, text: post(from_browser(actions.MapFailed(text), browser))).add(
                "Upload a map",
                lambda browser, upload: post(from_browser(actions.OpenMap(MapFile(upload)), browser)),
                limit=UPLOAD_LIMIT,
                endings=tuple(f".{ending}" for ending in ENDINGS),
                note="Of a ROS map the .yaml and its image, one after the other.",
            )
            self._source = (kinds, mark, path, opened)
            self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
            self._cancel = gui.add_button("Cancel", color="gray", visible=False, hint="Stop reading; nothing changes.")
            self._cancel.on_click(posting(post, lambda _event: actions.StopMapJob()))
            self._said = gui.add_html("", visible=False)
            self._fields = MapDraftFields(gui, post)
            self._discard = gui.add_button("Discard", color="gray", visible=False, hint="Forget the file.")
            self._discard.on_click(posting(post, lambda _event: actions.DiscardMap()))

    def draw(self, view: PageView) -> None:
        """Show how far a job is without delay."""
        job = next((job for job in view.jobs if job.name.startswith(JOBS)), None)
        for widget in (self._bar, self._cancel):
            if widget.visible is not (job is not None):
                widget.visible = job is not None
        if job is not None:
            self._bar.value = PERCENT.of(job.fraction)

    def draw_slowly(self, view: PageView) -> None:
        """Show what is under way and what came of it."""
        loading = view.state.part(MapLoading)
        self._fields.refresh()
        if loading is self._shown:
            return
        self._shown = loading
        self._said.content = said(loading)
        self._said.visible = bool(self._said.content)
        for widget in self._source:  # a small screen has no room for both
            widget.visible = loading.draft is None
        self._discard.visible = loading.draft is not None or loading.waiting is not None
        self._fields.show(loading.draft)


class MapTroublePanel(BasePanel):
    """Says to one browser alone, above everything else of the tab, why its file did not become a floor map."""

    def __init__(self, gui: GuiApi, browser: int) -> None:
        self._browser = browser
        self._said = gui.add_html("", order=-1.0, visible=False)

    def draw_slowly(self, view: PageView) -> None:
        """Follow what the browser asks for."""
        text = view.state.of_browser(self._browser, MapTrouble).text
        style = f"font-size:12px;padding:2px 8px;color:{theme.css(theme.REFUSED)};overflow-wrap:anywhere"
        write_html(self._said, text and f"<div style='{style}'>No floor map: {escaped(text)}</div>")


def said(loading: MapLoading) -> str:
    """Return what there is to say to everybody, as html."""
    lines: list[str] = []
    if loading.waiting is not None:
        name, image = escaped(loading.waiting.file.name), escaped(loading.waiting.image)
        # Where both were dropped together, the page's script sends it by that name (web_assets/files.js).
        mark = f"class='c-needs-image' data-map='{name}' data-image='{image}'"
        lines.append(f"<div {mark}><b>{name}</b> needs its image: upload <b>{image}</b>, too.</div>")
    lines += [f"<div class='c-note'>{escaped(note)}</div>" for note in loading.notes]
    return f"<div style='font-size:12px;padding:2px 6px;overflow-wrap:anywhere'>{''.join(lines)}</div>" if lines else ""
