// The floor as a map: the wheel zooms to the pointer, the middle button or Space and a drag moves it, and its edge says
// how long things are, how large they are drawn, where the pointer is, and what attracts what is placed there.
(() => {
  if (window.commissionFloor) return; // the server sends this script again after each reconnection
  window.commissionFloor = true;
  const TRUCK = 2; // what the camera's controls call moving along the picture
  const LONGEST_BAR_PX = 150;
  const FLAT_DEGREES = 5; // opening of the plan's camera is far below, that of 3D far above
  const viewer = () => window.__viserMutable;

  const status = document.createElement("div");
  status.className = "c-status";
  status.innerHTML = "<i class='c-ruler'></i><b class='c-length'></b><span class='c-zoom'></span><span class='c-place'></span><span></span>";
  const [ruler, length, zoom, place, snap] = status.children;
  document.body.append(status);

  // Where a point of the window lies on the floor [m]; null beside the floor and where there is none.
  function onFloor(x, y) {
    const { camera, canvas, nodeRefFromName } = viewer();
    const box = canvas.getBoundingClientRect(), root = nodeRefFromName[""];
    const from = camera.position.clone();
    const through = from.clone().set(2 * (x - box.left) / box.width - 1, 1 - 2 * (y - box.top) / box.height, 0.5);
    root.worldToLocal(through.unproject(camera));
    root.worldToLocal(from);
    const share = from.z / (from.z - through.z);
    if (!(share > 0) || !isFinite(share)) return null;
    return [from.x + share * (through.x - from.x), from.y + share * (through.y - from.y)];
  }

  // The longest of 1, 2 or 5 times a power of ten that is no longer than so many metres.
  function rounded(metres) {
    const power = 10 ** Math.floor(Math.log10(metres));
    return [5, 2, 1].map((nice) => nice * power).find((nice) => nice <= metres);
  }

  function written(metres) {
    if (metres >= 1) return `${metres.toFixed(0)} m`;
    return metres >= 0.01 ? `${(metres * 100).toFixed(0)} cm` : `${(metres * 1000).toFixed(metres < 0.001 ? 1 : 0)} mm`;
  }

  // Space held down: the left button moves the floor, and selects nothing.
  let held = null; // what the left button does else, and whether the floor was dragged
  window.commissionSpace = (isDown) => {
    const { cameraControl, canvas } = viewer() ?? {};
    const before = held;
    if (isDown && !held && cameraControl) {
      held = { left: cameraControl.mouseButtons.left, isUsed: false };
      cameraControl.mouseButtons.left = TRUCK;
      canvas.style.cursor = "grab";
    } else if (!isDown && held) {
      cameraControl.mouseButtons.left = held.left;
      canvas.style.cursor = "";
      held = null;
    }
    return before?.isUsed ?? false;
  };
  addEventListener("blur", () => window.commissionSpace(false));
  addEventListener("pointerdown", (event) => {
    const canvas = viewer()?.canvas;
    if (!held || !event.isTrusted || event.button !== 0 || event.target !== canvas) return;
    held.isUsed = true;
    event.stopImmediatePropagation();
    // As the middle button, with which nothing is selected.
    const { clientX, clientY, pointerId, pointerType, isPrimary } = event;
    const middle = { button: 1, buttons: 4, clientX, clientY, pointerId, pointerType, isPrimary };
    canvas.dispatchEvent(new PointerEvent("pointerdown", { ...middle, bubbles: true, cancelable: true }));
  }, true);

  let shown = "", pointer = null;
  function draw() {
    requestAnimationFrame(draw);
    const { camera, canvas, nodeRefFromName, cameraControl } = viewer() ?? {};
    if (!canvas || !camera || !nodeRefFromName?.[""] || !cameraControl) return;
    if (!cameraControl.dollyToCursor) cameraControl.dollyToCursor = true;
    if (cameraControl.mouseButtons.middle !== TRUCK) cameraControl.mouseButtons.middle = TRUCK;
    const box = canvas.getBoundingClientRect(), attracts = document.querySelector(".c-attracts")?.textContent ?? "";
    const now = [box.left, box.bottom, box.width, camera.fov, ...camera.position.toArray(), pointer, attracts].join();
    if (now === shown) return;
    shown = now;
    const { style } = document.documentElement; // for the rail of tools on its left and the numbers of now on its right
    style.setProperty("--c-floor", `${box.left}px`);
    style.setProperty("--c-right", `${innerWidth - box.right}px`);
    status.style.left = `${box.left + 12}px`;
    status.style.bottom = `${innerHeight - box.bottom + 6}px`;
    status.style.maxWidth = `${box.width - 64}px`; // beside it is the button of the theme
    const isPlan = camera.fov < FLAT_DEGREES;
    ruler.hidden = length.hidden = zoom.hidden = !isPlan;
    if (isPlan) {
      const x = box.left + box.width / 2, y = box.top + box.height / 2;
      const [here, there] = [onFloor(x, y), onFloor(x + 100, y)];
      if (!here || !there) return;
      const perPixel = Math.hypot(there[0] - here[0], there[1] - here[1]) / 100;
      const metres = rounded(Math.min(LONGEST_BAR_PX, box.width / 4) * perPixel);
      ruler.style.width = `${metres / perPixel}px`;
      length.textContent = written(metres);
      zoom.textContent = `${(1 / perPixel).toPrecision(3).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "")} px/m`;
    }
    // Without a minus before a zero.
    const millimetres = (value) => (Math.round(value * 1000) / 1000 || 0).toFixed(3);
    const at = pointer && onFloor(...pointer);
    const [x0, y0] = window.commissionOrigin ?? [0, 0]; // of the scene, in the map (map_scene.py)
    place.textContent = at ? `x ${millimetres(x0 + at[0])}   y ${millimetres(y0 + at[1])} m` : "";
    snap.textContent = attracts;
  }
  // Who has zoomed or moved the floor keeps what was zoomed to, though the page still builds up: told until it is heard.
  let isOdd = false;
  const tellMoved = ({ target }) => {
    if (target === viewer()?.canvas && !window.commissionStands) window.commissionMovedNow();
  };
  window.commissionMovedNow = () => {
    if (!window.commissionMoved) return;
    isOdd = !isOdd; // only what changes is heard
    window.commissionTell?.(window.commissionMoved, isOdd);
  };
  for (const kind of ["wheel", "pointerdown"]) addEventListener(kind, tellMoved, { capture: true, passive: true });
  addEventListener("keydown", ({ key, target }) => { // these move the camera, too
    if (/^(Arrow.*|[wasdqe])$/i.test(key) && !target.closest?.("input, textarea") && !window.commissionStands) {
      window.commissionMovedNow();
    }
  }, true);

  addEventListener("pointermove", (event) => {
    pointer = event.target === viewer()?.canvas ? [event.clientX, event.clientY] : null;
  }, true);
  draw();
})();
