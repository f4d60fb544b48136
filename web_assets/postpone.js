// A press on the floor is answered before it is drawn: viser draws a frame as soon as a button goes down or up, in which
// nothing has changed yet, and one when the pointer comes over something that can be pressed, or leaves it. Without a
// graphics card such a frame takes a tenth of a second and more, and what the program answers waits behind it. So it comes
// a little later, when the pointer rests, and not at all where the answer has been drawn by then.
(() => {
  if (window.commissionPostpones) return; // the server sends this script again after each reconnection
  window.commissionPostpones = true;
  const LATER_MS = 150;
  let isPressing = false, timer = 0;

  function postponing(plain) {
    const request = function (...given) {
      clearTimeout(timer);
      if (!isPressing) return plain.apply(this, given);
      timer = setTimeout(() => plain.apply(this, given), LATER_MS);
    };
    request.isPostponing = true;
    return request;
  }

  function begin(event) {
    if (event.type === "pointermove" && event.buttons) return; // something is dragged, which is to be seen at once
    const viewer = window.__viserMutable;
    if (viewer?.requestRender && !viewer.requestRender.isPostponing)
      viewer.requestRender = postponing(viewer.requestRender);
    isPressing = true;
    setTimeout(end); // whoever stops an event keeps it from the listeners below
  }
  const end = () => { isPressing = false; };
  // Not all that move over the page come to its window again: R3F hears them at the floor, and leaves it by `pointerleave`.
  for (const kind of ["pointerdown", "pointerup", "pointermove", "pointerleave"]) {
    addEventListener(kind, begin, true);
    addEventListener(kind, end);
  }
})();
