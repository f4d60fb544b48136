// The raw-sensor view (commission/app/live/sensor_panel.py): its threshold is a line that is dragged.
//
// The picture is sent anew with each scan, so the line's place while it is held is the document's, not the line's own.
(() => {
  if (window.commissionSensor) return; // the server sends this script again after each reconnection
  window.commissionSensor = true;
  const REACH_PX = 7, SHOWN_MS = 1500; // the picture follows once the drive has been localized anew
  const root = document.documentElement;
  let held = null, count = 0, forget = null;

  // Heights are the roots of intensities (commission/app/live/sensor_picture.py).
  function at(picture, clientY) {
    const box = picture.getBoundingClientRect();
    const share = Math.min(1, Math.max(0, (box.bottom - clientY) / box.height));
    return { share, value: Number((share ** 2 * Number(picture.dataset.top)).toPrecision(3)) };
  }

  function show({ share, value }) {
    root.style.setProperty("--c-held", `${(100 * (1 - share)).toFixed(3)}%`);
    root.style.setProperty("--c-held-value", `"${value}"`);
    root.classList.add("c-holds-threshold");
  }

  addEventListener("pointerdown", (event) => {
    const picture = event.target.closest?.(".c-s-intensity");
    const line = picture?.querySelector(".c-s-line")?.getBoundingClientRect();
    if (!line || Math.abs(event.clientY - (line.top + line.bottom) / 2) > REACH_PX) return;
    clearTimeout(forget);
    held = picture;
    show(at(picture, event.clientY));
    event.preventDefault();
  }, true);
  addEventListener("pointermove", (event) => {
    if (!held) return;
    held = document.querySelector(".c-s-intensity") ?? held;
    show(at(held, event.clientY));
  }, true);
  addEventListener("pointerup", (event) => {
    if (!held) return;
    held = document.querySelector(".c-s-intensity") ?? held;
    const { value } = at(held, event.clientY);
    window.commissionTell?.(held.dataset.inbox, JSON.stringify({ n: ++count, threshold: value }));
    held = null;
    forget = setTimeout(() => root.classList.remove("c-holds-threshold"), SHOWN_MS);
  }, true);
})();
