// A press on the floor is answered before it is drawn: viser draws a frame as soon as a button goes down or up, in which
// nothing has changed yet. Without a graphics card that frame takes a tenth of a second and more, and what the program
// answers waits behind it. So that frame comes a little later, and not at all where the answer has been drawn by then.
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

  function begin() {
    const viewer = window.__viserMutable;
    if (viewer?.requestRender && !viewer.requestRender.isPostponing)
      viewer.requestRender = postponing(viewer.requestRender);
    isPressing = true;
    setTimeout(end); // whoever stops an event keeps it from the listeners below
  }
  const end = () => { isPressing = false; };
  for (const kind of ["pointerdown", "pointerup"]) {
    addEventListener(kind, begin, true);
    addEventListener(kind, end);
  }
})();
