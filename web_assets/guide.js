// It shows at the tabs what they lack or how much is in them, and leads from the card of a new site to where things are.
//
// What is shown at a tab comes in elements with `data-tab` (commission/app/project/guide_panel.py, problem_count.py); a
// button with `data-go="tab:Run press:Drive"` brings a tab to the front, opens a folder, presses a button.
(() => {
  if (window.commissionGuide) return; // the server sends this script again after each reconnection
  window.commissionGuide = true;
  const LOOK_EVERY_MS = 250, WAIT_MS = 3000;
  const named = (selector, name) =>
    [...document.querySelectorAll(selector)].find((each) => each.textContent.trim() === name && each.checkVisibility());

  setInterval(() => {
    for (const mark of document.querySelectorAll("[data-tab]")) {
      const tab = named("[role=tab]", mark.dataset.tab);
      if (!tab) continue;
      const { lacks, count } = mark.dataset;
      if (lacks !== undefined && tab.dataset.lacks !== lacks) {
        tab.dataset.lacks = lacks;
        tab.title = lacks ? `missing: ${lacks}` : "has all that it needs";
      }
      if (count !== undefined && tab.dataset.count !== count) tab.dataset.count = count;
    }
  }, LOOK_EVERY_MS);

  async function found(selector, name) {
    for (let waited = 0; waited < WAIT_MS; waited += 50) {
      const element = named(selector, name);
      if (element) return element;
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    return null;
  }

  // viser's tabs can be dragged elsewhere: they come to the front by the whole press of a pointer, not by a click.
  function press(element) {
    if (!element) return;
    const { left, top } = element.getBoundingClientRect();
    const at = { bubbles: true, cancelable: true, button: 0, pointerId: 1, isPrimary: true,
      clientX: left + 4, clientY: top + 4 };
    for (const [kind, buttons] of [["down", 1], ["up", 0]]) {
      element.dispatchEvent(new PointerEvent(`pointer${kind}`, { ...at, buttons }));
      element.dispatchEvent(new MouseEvent(`mouse${kind}`, { ...at, buttons }));
    }
    element.click();
  }
  window.commissionPress = press;

  async function go(way) {
    for (const part of way.split(" ")) {
      const [kind, name] = part.replaceAll("_", " ").split(":");
      if (kind === "tab") {
        const tab = await found("[role=tab]", name);
        press(tab);
        if (tab) window.commissionKeepTab?.(tab);
      }
      if (kind === "press") (await found("button:not([data-go])", name))?.click();
      if (kind !== "open") continue;
      const head = await found(".mantine-Paper-root", name);
      if (head?.nextElementSibling?.ariaHidden === "true") press(head); // it is closed
      // Where it was open already, nothing else would show that something has happened.
      const field = head?.nextElementSibling?.querySelector("input:not([type=checkbox], [type=file])");
      setTimeout(() => field?.focus(), 250);
    }
  }
  addEventListener("click", ({ target }) => {
    const way = target.closest?.("[data-go]")?.dataset.go;
    if (way) go(way);
  }, true);
})();
