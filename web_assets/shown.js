// It tells the program which views can be seen: what is hidden behind another tab is not drawn.
//
// A view names in `data-seen` the check box that stands for it (commission/app/run/association_panel.py).
(() => {
  // The server sends this script again after each reconnection: the check boxes of before are gone then.
  if (window.commissionShown) return window.commissionShown.clear();
  const LOOK_EVERY_MS = 150;
  const told = window.commissionShown = new Map(); // of each check box what it was told last

  setInterval(() => {
    const views = [...document.querySelectorAll("[data-seen]")].filter((view) => view.checkVisibility());
    document.documentElement.dataset.shows = views.map((view) => view.className).join(" "); // for the style
    const seen = new Set(document.hidden ? [] : views.map((view) => view.dataset.seen));
    for (const box of new Set([...told.keys(), ...seen])) {
      const isSeen = seen.has(box);
      if ((told.get(box) ?? false) !== isSeen && window.commissionTell?.(box, isSeen)) told.set(box, isSeen);
    }
  }, LOOK_EVERY_MS);
})();
