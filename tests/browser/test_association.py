"""The association view as a person reads it: which reflector, inside or outside, its numbers; keys, buttons, tabs."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import pytest

from commission.app.base.actions import Envelope, Sender
from commission.app.editing.actions import SelectReflectors
from commission.app.run.association_panel import NEXT, associated, detected_ids
from tests.app.sites import room
from tests.browser.page import SMALL, OpenPage
from tests.browser.serving import Served, standing_drive

LEAST_PX = 9
"""Height of letters that can still be read."""
SMALL_OR_CUT = f"""() => {{
  const picture = document.querySelector('.c-a-picture'), box = picture.getBoundingClientRect();
  const scale = box.width / picture.viewBox.baseVal.width;
  const view = picture.closest('.mantine-ScrollArea-viewport').getBoundingClientRect();
  return [...picture.querySelectorAll('text')].flatMap((each) => {{
    const its = each.getBoundingClientRect(), size = scale * parseFloat(getComputedStyle(each).fontSize);
    return [...(size < {LEAST_PX} ? [`${{size.toFixed(1)}} px: ${{each.textContent}}`] : []),
      ...(its.left < box.left - 1 || its.right > box.right + 1 ? [`cut: ${{each.textContent}}`] : [])];
  }}).concat(box.bottom > view.bottom + 1 ? ['the picture is cut'] : []);
}}"""
"""Words of the picture that are too small to be read, or cut; and whether it is cut itself."""


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with standing_drive(room(), at=6.0) as opened:
        yield opened


def wait_for(page: OpenPage, reflector: str) -> None:
    page.page.wait_for_selector(f".c-a-picture[data-reflector='{reflector}']")


def test_a_person_reads_which_reflector_is_worst_turns_to_the_next_and_back(
    served: Served, window: Callable[..., OpenPage]
) -> None:
    page = window(served.server, SMALL)
    client = page.open()
    run = served.view
    assert run is not None
    assert page.page.locator(".c-a-picture").count() == 0, "its tab is not in front"
    page.open_tab("Association")
    worst = associated(run, "")
    assert worst is not None
    assert worst.detection is not None
    wait_for(page, worst.reflector.id)
    text = page.text()
    assert f"{worst.reflector.id} worst d² of this scan" in re.sub(r"\s+", " ", text)
    where = "inside" if worst.detection.d2 <= worst.estimate.gate else "outside"
    assert f"d² {worst.detection.d2:.2f} {'≤' if where == 'inside' else '>'} gate {worst.estimate.gate:.2f}" in text
    assert where in text
    row = page.page.locator(".c-a-rows tr", has_text="Innovation").first
    assert row.inner_text().split("\t")[-1].strip() == f"{1000 * worst.detection.length:.1f} mm"
    box = page.page.locator(".c-a-picture").bounding_box()
    assert box is not None
    assert box["y"] + box["height"] <= SMALL[1] - 190, "all of the picture is above the plots in a small window"
    assert box["width"] == pytest.approx(box["height"], abs=1.0)

    for width, height in ((1024, 700), SMALL, (1600, 900)):
        page.page.set_viewport_size({"width": width, "height": height})
        page.page.wait_for_timeout(400)
        assert page.page.evaluate(SMALL_OR_CUT) == [], (width, height)
    page.page.set_viewport_size({"width": SMALL[0], "height": SMALL[1]})
    page.page.wait_for_timeout(400)

    ids = detected_ids(run, "")
    following = ids[(ids.index(worst.reflector.id) + 1) % len(ids)]
    page.press(NEXT)
    wait_for(page, following)
    assert served.editor(client.client_id).selected == (following,), "the floor's selection goes along"
    page.page.keyboard.press("h")
    wait_for(page, worst.reflector.id)
    assert "selected" in page.page.locator(".c-a-head").inner_text()
    served.runtime.post(Envelope(SelectReflectors((ids[0],)), Sender(client.client_id)))
    wait_for(page, ids[0])
    page.press("Worst")
    page.page.wait_for_function("document.querySelector('.c-a-head').innerText.includes('worst')")
    assert page.errors == []


def test_scene_and_numbers_are_of_the_scan_at_the_cursor_and_a_hidden_view_comes_back_with_it(
    served: Served, window: Callable[..., OpenPage]
) -> None:
    page = window(served.server)
    page.open()
    page.open_tab("Association")
    page.page.wait_for_selector(".c-a-picture")
    for seconds in (3.0, 5.0):
        page.open_tab("Layers")
        page.page.wait_for_selector(".c-a-picture", state="hidden")
        served.seek(seconds)
        page.open_tab("Association")
        run = served.view
        assert run is not None
        time = float(run.result.times[run.newest])
        shown = f"{time:.2f} s"
        page.page.wait_for_function(
            "shown => document.querySelector('.c-a-head')?.innerText.includes(shown)", arg=shown
        )
    assert page.errors == []
