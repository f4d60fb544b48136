"""Takes pictures of the page, every panel at both sizes that it is made for.

    python -m tests.tools.take_pictures FOLDER [WORD ...]

Words choose the pictures whose names hold one of them. The README's are those at 1600x900, named alike in `web_assets`.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

from commission.app.ambiguity.service import AmbiguityService
from commission.app.base.actions import Envelope, Sender
from commission.app.coverage.service import CoverageService
from commission.app.editing.actions import DeleteSelected, SelectReflectors
from commission.app.editing.editor import editors_of
from commission.app.editing.site_tools import MeasureTool, StationTool
from commission.app.failures.actions import ShowFailure
from commission.app.failures.service import FailureService
from commission.app.floor_map.tools import ObstacleTool
from commission.app.layouts.actions import SetComparison
from commission.app.layouts.service import LayoutsService
from commission.app.placement.actions import SetLayout
from commission.app.placement.service import PlacementService
from commission.app.prediction.service import PredictionService
from commission.app.prediction.settings import PredictRoute
from commission.app.run.actions import Cover, Play, Seek, VirtualDrive
from commission.app.run.service import RunService
from commission.app.run.variant_actions import KeepVariant
from commission.app.runtime import Runtime
from commission.app.tune.actions import SetParameter
from commission.io.bundled import bundled_folder
from commission.io.project_file import load_project
from commission.site.disturbances import ConstantErrors, Disturbances, ScannerError
from commission.site.project import Project
from commission.site.stations import Station
from commission.studies.variants import VariantsResult
from tests.browser.page import CHROMIUM, FLAGS, SMALL, WIDE, OpenPage
from tests.browser.serving import Served

Steps = Callable[[OpenPage, Runtime], None]


@dataclass(frozen=True, slots=True)
class Picture:
    """What is in a picture."""

    name: str
    """Name of its file, without the size."""
    site: str
    """Bundled site that is open."""
    steps: Steps
    """What is done on the page before it is taken."""
    time: float = 30.0
    """Time of the drive [s]."""
    world: Callable[[Project], Project] = lambda project: project
    """What is otherwise than in the bundled site."""


def until(reached: Callable[[], bool], seconds: float = 180.0) -> None:
    """Wait for the server."""
    end = time.monotonic() + seconds
    while not reached():
        if time.monotonic() > end:
            raise TimeoutError(f"it did not happen within {seconds:g} s")
        time.sleep(0.05)


def tab(*names: str) -> Steps:
    """Bring tabs to the front."""

    def steps(page: OpenPage, _runtime: Runtime) -> None:
        for name in names:
            page.open_tab(name)

    return steps


def folded(page: OpenPage, runtime: Runtime) -> None:
    """The plots are folded away, for the sake of the panels."""
    selected(page, runtime)
    page.page.locator(".c-fold").click()


def unfolded(page: OpenPage, _runtime: Runtime) -> None:
    """The plots are folded away, so that the numbers of the run have room down to those of each scanner."""
    page.open_tab("Run")
    page.page.locator(".c-fold").click()
    page.page.get_by_text("rear right, to reference").scroll_into_view_if_needed()


def rear_turned(project: Project) -> Project:
    """The rear scanner is mounted one degree otherwise than the project says, and nobody walks about."""
    turned = ScannerError(scanner="rear right", mounting=(0.0, 0.0, math.radians(1.0)))
    return replace(project, disturbances=Disturbances(constants=ConstantErrors(scanners=(turned,))))


def matched(project: Project) -> Project:
    """Walls correct the pose, too."""
    parameters = project.parameters
    walls = replace(parameters.contour, enabled=True)
    return replace(project, parameters=replace(parameters, contour=walls))


def folded_at_run(page: OpenPage, _runtime: Runtime) -> None:
    """The plots are folded away, and the layers are listed."""
    page.open_tab("Run")
    page.open_tab("Layers")
    page.page.locator(".c-fold").click()


def predicted_by_every_kind(page: OpenPage, runtime: Runtime) -> None:
    """The first route is predicted, and driven by every kind."""
    page.open_tab("Plan")
    page.fold("Prediction along a route")
    page.page.locator(".c-fold").click()
    route = runtime.state.project.routes[0].name
    runtime.post(PredictRoute(route))
    until(lambda: getattr(runtime.service(PredictionService).view, "driven", None) is not None)
    page.page.locator(".c-every-kind").scroll_into_view_if_needed()


def three_d(page: OpenPage, _runtime: Runtime) -> None:
    page.press("3D")


def covered(page: OpenPage, runtime: Runtime) -> None:
    """Nothing has been seen for a while."""
    page.open_tab("Run")
    page.open_tab("Layers")
    runtime.post(Seek(5.0))
    until(lambda: _is_at(runtime, 5.0))
    runtime.post(Cover(covered=True))
    runtime.post(Seek(30.0))


def selected(page: OpenPage, runtime: Runtime) -> None:
    """One reflector is selected."""
    reflector = runtime.state.project.reflectors.reflectors[4]
    page.click_at((reflector.x, reflector.y))
    until(lambda: any(editor.selected for editor in editors_of(runtime.state)))


def on_route(page: OpenPage, runtime: Runtime) -> None:
    """A control point of a route is selected."""
    selected(page, runtime)
    point = runtime.state.project.routes[1].segments[0].control_points[1]
    page.click_at((float(point[0]), float(point[1])))
    until(lambda: any(editor.point for editor in editors_of(runtime.state)))


def measured(page: OpenPage, runtime: Runtime) -> None:
    """A distance has been measured."""
    page.press(MeasureTool.name)
    until(lambda: any(isinstance(editor.tool, MeasureTool) for editor in editors_of(runtime.state)))
    first, second = runtime.state.project.reflectors.reflectors[:2]
    for reflector in (first, second):
        page.click_at((reflector.x, reflector.y))
    until(lambda: any(len(editor.points) == 2 for editor in editors_of(runtime.state)))


def heatmap(page: OpenPage, runtime: Runtime) -> None:
    """The position error all over the floor."""
    page.open_tab("Plan")
    page.choose("Show", "Position error, 1σ [mm]")
    until(lambda: runtime.service(CoverageService).view.heat is not None)


def predicted(page: OpenPage, runtime: Runtime) -> None:
    """What the filter will say along a route."""
    page.open_tab("Plan")
    page.fold("Prediction along a route")
    page.choose("Route", runtime.state.project.routes[1].name)
    until(lambda: runtime.service(PredictionService).view is not None)


def budget(page: OpenPage, runtime: Runtime) -> None:
    """What the error along a route comes from."""
    predicted(page, runtime)
    page.page.locator(".c-sources").scroll_into_view_if_needed()


def rejecting(page: OpenPage, runtime: Runtime) -> None:
    """A drive whose filter believes in too little noise: what the Run panel, numbers and trail say of it."""
    page.open_tab("Run")
    page.open_tab("Layers")
    page.choose("Trail shows", "share rejected")
    page.page.locator(".c-summary").scroll_into_view_if_needed()


def vain(project: Project) -> Project:
    """A filter that believes in a quarter of the noise, on a site with two stations along its route."""
    observation = replace(project.parameters.observation, range_sigma=0.003, bearing_sigma=0.0004)
    filtered = replace(project.parameters.filter, consider=False)
    points = project.routes[0].segments[0].control_points
    stations = tuple(
        Station(name=name, x=float(x), y=float(y), heading=heading)
        for name, (x, y), heading in (("Dock", points[0], 0.0), ("Press", points[-1], 0.0))
    )
    parameters = replace(project.parameters, observation=observation, filter=filtered)
    return replace(project, parameters=parameters, stations=stations)


def suggested(page: OpenPage, runtime: Runtime) -> None:
    """A layout from nothing, before it is accepted."""
    page.open_tab("Plan")
    page.fold("Heatmap of the floor")
    page.fold("Suggested layout")
    runtime.post(SetLayout("extend", value=False))
    page.press("Suggest reflectors")
    until(lambda: runtime.service(PlacementService).view is not None)


def ambiguous(page: OpenPage, runtime: Runtime) -> None:
    """Where a cold start may go wrong."""
    page.open_tab("Plan")
    page.fold("Heatmap of the floor")
    page.fold("Ambiguous places")
    page.press("Find ambiguous places")
    until(lambda: runtime.service(AmbiguityService).view is not None)


def along(page: OpenPage, runtime: Runtime) -> None:
    """The selected route over its metres."""
    on_route(page, runtime)
    page.open_tab("Route")
    page.open_tab("Routes")


def files(page: OpenPage, _runtime: Runtime) -> None:
    """Loading a floor map, imports and exports."""
    page.open_tab("Site")
    page.fold("Floor map")
    page.fold("Exchange")


def drawing(page: OpenPage, runtime: Runtime) -> None:
    """An obstacle is being drawn."""
    page.press(ObstacleTool.name)
    until(lambda: any(isinstance(editor.tool, ObstacleTool) for editor in editors_of(runtime.state)))
    for count, place in enumerate(((9.0, 4.0), (11.0, 4.0), (10.0, 5.5)), start=1):
        page.click_at(place)
        until(lambda count=count: any(len(editor.points) == count for editor in editors_of(runtime.state)))


def failing(page: OpenPage, runtime: Runtime) -> None:
    """What depends on each reflector; the first of the list has failed."""
    page.open_tab("Plan")
    page.fold("Heatmap of the floor")
    page.fold("What if one reflector fails")
    page.press("Rank reflectors")
    service = runtime.service(FailureService)
    until(lambda: service.view is not None)
    if service.view is not None:
        runtime.post(ShowFailure(service.view.names[0]))
    until(lambda: service.view is not None and service.view.chosen is not None)


def equipment(page: OpenPage, _runtime: Runtime) -> None:
    """Vehicle and scanner, with the plots out of the way."""
    page.open_tab("Site")
    page.fold("Vehicle")
    page.fold("Scanner")
    page.open_tab("Layers")
    page.page.locator(".c-fold").click()


def at_station(page: OpenPage, runtime: Runtime) -> None:
    """A station has been placed, and is selected."""
    page.press(StationTool.name)
    until(lambda: any(isinstance(editor.tool, StationTool) for editor in editors_of(runtime.state)))
    page.click_at((9.0, 6.5))
    until(lambda: len(runtime.state.project.stations) == 1)
    page.page.locator(".c-fold").click()


def several(page: OpenPage, runtime: Runtime) -> None:
    """Some reflectors are selected together."""
    ids = tuple(reflector.id for reflector in runtime.state.project.reflectors.reflectors[:4])
    runtime.post(Envelope(SelectReflectors(ids), Sender(next(iter(runtime.state.browsers)))))
    until(lambda: any(editor.selected == ids for editor in editors_of(runtime.state)))
    page.page.locator(".c-fold").click()
    page.fold("Mirror, repeat")
    page.fold("Snapping")


def importing(page: OpenPage, _runtime: Runtime) -> None:
    """What a pasted table would change."""
    page.open_tab("Site")
    page.fold("Exchange")
    page.row("Paste a table").locator("textarea").fill("Nr\tX [mm]\tY [mm]\nS01\t3900\t9400\nNew\t6000\t4000")
    page.press("Read pasted")
    page.wait_for_text("Nothing has changed yet")


def layouts(page: OpenPage, runtime: Runtime) -> None:
    """A layout is kept, and three of its reflectors are gone: what that does to the floor and the routes."""
    page.open_tab("Plan")
    page.fold("Heatmap of the floor")
    page.fold("Compare layouts")
    page.press("Keep this layout")
    ids = tuple(reflector.id for reflector in runtime.state.project.reflectors.reflectors[2:5])
    me = Sender(next(iter(runtime.state.browsers)))
    for action in (SelectReflectors(ids), DeleteSelected(), SetComparison("figure", "position_sigma")):
        runtime.post(Envelope(action, me))
    until(
        lambda: (
            (view := runtime.service(LayoutsService).view) is not None
            and view.difference is not None
            and not view.outdated
        )
    )


def listed(name: str) -> Steps:
    """Events or reflectors of the drive beside the plots; of reflectors the NIS colors the floor."""

    def steps(page: OpenPage, _runtime: Runtime) -> None:
        page.page.wait_for_function("() => /Events \\d/.test(document.querySelector('.c-views').innerText)")
        page.page.locator(".c-views button", has_text=name).click()
        if name == "Reflectors":
            page.page.get_by_label("Color by NIS").click()

    return steps


PICTURES = (
    Picture("page_laboratory", "laboratory", tab("Run", "Layers")),
    Picture("page_3d", "shop_floor", three_d),
    Picture("covered", "shop_floor", covered),
    Picture("events", "shop_floor", listed("Events"), world=vain),
    Picture("reflectors", "shop_floor", listed("Reflectors")),
    Picture("site", "shop_floor", tab("Site", "Problems")),
    Picture("tune", "shop_floor", tab("Tune", "Reflectors")),
    Picture("page_shop_floor", "shop_floor", selected),
    Picture("folded", "shop_floor", folded),
    Picture("page_two_scanners", "loading_bay", unfolded, world=rear_turned),
    Picture("page_tags_and_walls", "assembly", folded_at_run, time=21.0, world=matched),
    Picture("page_every_kind", "assembly", predicted_by_every_kind, time=21.0, world=matched),
    Picture("route", "shop_floor", on_route),
    Picture("measured", "laboratory", measured),
    Picture("page_plan", "shop_floor", heatmap),
    Picture("plan_route", "warehouse", predicted),
    Picture("budget", "warehouse", budget),
    Picture("rejecting", "shop_floor", rejecting, world=vain),
    Picture("page_suggested", "shop_floor", suggested),
    Picture("ambiguous", "laboratory", ambiguous),
    Picture("along", "shop_floor", along),
    Picture("files", "shop_floor", files),
    Picture("drawing", "shop_floor", drawing),
    Picture("failing", "warehouse", failing),
    Picture("equipment", "shop_floor", equipment),
    Picture("station", "shop_floor", at_station),
    Picture("several", "shop_floor", several),
    Picture("importing", "shop_floor", importing),
    Picture("page_layouts", "shop_floor", layouts),
)


def _with_gate(runtime: Runtime, probability: float) -> None:
    """Move the gate, and wait for the run with it."""
    runtime.post(SetParameter("association.gate_probability", probability))
    until(
        lambda: (
            (view := runtime.service(RunService).view()) is not None
            and view.result.inputs.segments[-1].setup.parameters.association.gate_probability == probability
        )
    )


def variants(page: OpenPage, runtime: Runtime, shown: str = "Variants 2") -> None:
    """Two variants are kept beside the run of now."""
    page.open_tab("Tune")
    runtime.post(KeepVariant())
    _with_gate(runtime, 0.3)
    runtime.post(KeepVariant())
    _with_gate(runtime, 0.6)
    until(lambda: any(isinstance(p, VariantsResult) for p in runtime.service(RunService).parts(slowly=True)))
    page.page.locator(".c-views button", has_text=shown).click()


PICTURES += (
    Picture("variants", "shop_floor", variants),
    Picture("variant_plots", "shop_floor", lambda page, runtime: variants(page, runtime, "Plots")),
)


def _is_at(runtime: Runtime, seconds: float) -> bool:
    view = runtime.service(RunService).view()
    return view is not None and view.time >= seconds - 0.1


@contextmanager
def served(picture: Picture) -> Iterator[Served]:
    """A page of a bundled site, as `commission demo` opens it."""
    project = picture.world(load_project(bundled_folder("maps") / picture.site))
    page = Served(project, source=VirtualDrive(project.routes[0].name))
    page.until(lambda: page.runtime.service(RunService).view() is not None)
    try:
        yield page
    finally:
        page.close()


def take(browser: Browser, picture: Picture, size: tuple[int, int], path: Path) -> None:
    """Take one picture with a window of a size [pixels]."""
    with served(picture) as site:
        # At full resolution, which viser lowers while the machine is busy.
        runtime, page = site.runtime, OpenPage(browser, site.server, size, 1.0)
        page.page.set_default_timeout(60_000)
        page.open(nodes=("/floor/map", "/vehicle/outline"))
        runtime.post(Play(playing=False))
        runtime.post(Seek(picture.time))
        until(lambda: _is_at(runtime, picture.time))
        picture.steps(page, runtime)
        page.page.mouse.move(0, 0)  # no hint of what was pressed last over the floor
        page.page.wait_for_timeout(1500)
        page.wait_until_drawn()
        page.screenshot(path)
        page.close()
    sys.stdout.write(f"{path}\n")


if __name__ == "__main__":
    chosen = [p for p in PICTURES if not sys.argv[2:] or any(word in p.name for word in sys.argv[2:])]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        for each in chosen:
            for width, height in (WIDE, SMALL):
                take(chromium, each, (width, height), Path(sys.argv[1]) / f"{each.name}_{width}x{height}.png")
        chromium.close()
