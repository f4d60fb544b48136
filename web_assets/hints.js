// Hints stand on the floor beside the panel of what they explain: over a panel they would cover its other fields.
(() => {
  if (window.commissionHints) return; // the server sends this script again after each reconnection
  window.commissionHints = true;
  addEventListener("pointerover", ({ target }) => {
    const side = target.closest?.("[data-dock-region]")?.dataset.dockRegion ?? "";
    const root = document.documentElement;
    if ((root.dataset.hints ?? "") !== side) root.dataset.hints = side; // for the style
  }, { capture: true, passive: true });
})();
