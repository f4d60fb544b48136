// The raw-sensor view (commission/app/live/sensor_panel.py): its threshold is a line that is dragged, a click marks what was seen.
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

  const tell = (inbox, what) => window.commissionTell?.(inbox, JSON.stringify({ n: ++count, ...what }));
  const placeOf = ({ dataset }) => dataset.at.split(",").map(Number);

  // The picture may be another one before the button is let go: what is under the pointer now is what is meant.
  function clusterAt(event) {
    const plot = event.target.closest?.(".c-s-plot[data-inbox]");
    let nearest = null, least = REACH_PX + 2;
    for (const mark of plot?.querySelectorAll("[data-at]") ?? []) {
      const { left, right, top, bottom } = mark.getBoundingClientRect();
      const away = Math.hypot(event.clientX - (left + right) / 2, event.clientY - (top + bottom) / 2);
      if (away <= least) [nearest, least] = [mark, away];
    }
    return nearest && { inbox: plot.dataset.inbox, at: placeOf(nearest), reflector: nearest.dataset.reflector };
  }

  function pressRow(event) {
    const row = event.target.closest?.(".c-s-list tr[data-at]");
    if (row) tell(row.closest("table").dataset.inbox, { at: placeOf(row) });
    const find = event.target.closest?.(".c-s-find");
    if (find) tell(find.dataset.inbox, {});
  }
  addEventListener("click", pressRow, true);
  addEventListener("keydown", (event) => {
    if (event.key === "Enter" && event.target.matches?.(".c-s-list tr")) pressRow(event);
  }, true);

  addEventListener("pointerdown", (event) => {
    const cluster = event.button === 0 && clusterAt(event);
    if (cluster) {
      const { inbox, ...what } = cluster;
      event.preventDefault();
      return tell(inbox, what);
    }
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
    tell(held.dataset.inbox, { threshold: value });
    held = null;
    forget = setTimeout(() => root.classList.remove("c-holds-threshold"), SHOWN_MS);
  }, true);
})();
