"""What the page has without any feature: grid, layers with their legend, choice of the view, work under way."""

from __future__ import annotations

import json

from viser import GuiApi

from commission.app.base import page_reducer, viser_private
from commission.app.base.actions import Camera, HoldSlider, NameWindow, SetCamera, StopJob
from commission.app.base.feature import LAYERS, Docked, Feature
from commission.app.base.grid_layer import GridLayer
from commission.app.base.inputs import show
from commission.app.base.layers_panel import LayersPanel
from commission.app.base.panel import BasePanel, Post, posting, shortened, write_label
from commission.app.base.view import PageView

LONGEST_JOB = 16
"""Letters of a job's name that fit on a button."""


class JobButton(BasePanel):
    """The work under way as the button that stops it: wherever the engineer is on the page, it is in sight."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._job: int | None = None
        self._stop = gui.add_button("", hint="Background work; press to stop it.", color="gray", visible=False)
        self._stop.on_click(posting(post, lambda _event: StopJob(self._job or 0)))

    def draw_slowly(self, view: PageView) -> None:
        """Show the oldest job."""
        job = view.jobs[0] if view.jobs else None
        self._job = None if job is None else job.number
        show(self._stop, visible=job is not None)
        if job is not None:
            write_label(self._stop, f"✕ {job.fraction:.0%} {shortened(job.name, LONGEST_JOB)}")


class CameraButtons(BasePanel):
    """What the browser looks at."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        # What is lit, the browser's own cameras say (`cameras`), since each looks at something else.
        gui.add_html("<div class='c-wide c-cameras'></div>")
        buttons = gui.add_button_group("", tuple(camera.value for camera in Camera))
        buttons.on_click(posting(post, lambda event: SetCamera(Camera(event.target.value))))


class SliderHold(BasePanel):
    """A check box that nobody sees, which the page's script ticks while a slider is held (web_assets/sliders.js)."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        held = gui.add_checkbox("A slider is held", False, visible=False)
        held.on_update(posting(post, lambda event: HoldSlider(bool(event.target.value))))
        script = f"window.commissionHold = {json.dumps(viser_private.identifier(held))}"
        viser_private.run_on_page(viser_private.server_of(gui), browser, script)


class WindowName(BasePanel):
    """A text that nobody sees, in which the page's script says which window it is (web_assets/kept_view.js)."""

    def __init__(self, gui: GuiApi, post: Post, browser: int) -> None:
        name = gui.add_text("Name of this window", "", visible=False)
        name.on_update(posting(post, lambda event: NameWindow(str(event.target.value))))
        script = f"window.commissionWindow = {json.dumps(viser_private.identifier(name))}"
        viser_private.run_on_page(viser_private.server_of(gui), browser, script)


FEATURE = Feature(
    name="base",
    reducers=(page_reducer,),
    layers=(GridLayer,),
    panels=(
        Docked(make=lambda at: JobButton(at.gui, at.post), tab=None, rank=20),
        Docked(make=lambda at: SliderHold(at.gui, at.post, at.browser), tab=None, own=True),
        Docked(make=lambda at: WindowName(at.gui, at.post, at.browser), tab=None, own=True),
        Docked(make=lambda at: CameraButtons(at.gui, at.post), tab=None, rank=40),
        Docked(make=lambda at: LayersPanel(at.gui, at.post, at.layers, at.state), tab=LAYERS, rank=20),
    ),
)
