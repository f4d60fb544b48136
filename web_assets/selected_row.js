// What is selected on the floor is scrolled to in its table, where the table can be seen.
//
// Lists are buttons (commission/app/base/rows.py) that have a color of their own while they are selected, which the
// page's style tells as `--c-selected-line`. A row that can be seen already stays where it is.
(() => {
  if (window.commissionSelectedRow) return; // the server sends this script again after each reconnection
  window.commissionSelectedRow = true;
  const LOOK_EVERY_MS = 200, root = document.documentElement;
  const before = new WeakMap(); // of each list which rows were selected

  setInterval(() => {
    const color = getComputedStyle(root).getPropertyValue("--c-selected-line").trim();
    if (!color) return;
    for (const mark of document.querySelectorAll(".c-rows")) {
      const list = mark.closest("[role=tabpanel], .mantine-Collapse-root") ?? mark.parentElement.parentElement;
      if (!list?.checkVisibility()) continue;
      const rows = [...list.querySelectorAll("button")].filter((each) => getComputedStyle(each).backgroundColor === color);
      const names = rows.map((each) => each.textContent).join("\n");
      if ((before.get(mark) ?? "") === names) continue;
      before.set(mark, names);
      rows[0]?.scrollIntoView({ block: "nearest" });
    }
  }, LOOK_EVERY_MS);
})();
