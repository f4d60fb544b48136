// Keys that viser's commands cannot have, or not everywhere: Space plays or pauses where it is pressed alone (held down,
// the floor is dragged by it: floor_view.js), "?" shows all commands with their keys, arrows move what is selected and
// not the camera, Escape cancels wherever the focus is.
(() => {
  if (window.commissionKeys) return; // the server sends this script again after each reconnection
  window.commissionKeys = true;
  const isTyped = (target) => target.closest?.("input:not([type=checkbox]), textarea, [contenteditable=true]");
  const isStepped = (target) => target.closest?.("[role=slider], [role=tab], [role=radio], [role=option]");
  const press = (key, code, more = {}) =>
    document.documentElement.dispatchEvent(new KeyboardEvent("keydown", { key, code, bubbles: true, ...more }));

  // Fields that are being typed into have had their say before (entries.js); an open list closes by itself.
  function escape(event) {
    const field = event.target.closest?.("input, textarea, select");
    if (!field || field.getAttribute("aria-expanded") === "true") return;
    if (document.querySelector("[role=dialog]:not([hidden])")) return; // it closes by itself
    field.blur();
    event.stopImmediatePropagation();
    press("Escape", "Escape");
  }

  addEventListener("keydown", (event) => {
    if (!event.isTrusted || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Escape") return escape(event);
    if (isTyped(event.target)) return;
    if (event.key.startsWith("Arrow") && !isStepped(event.target)) {
      event.stopImmediatePropagation();
      // viser's commands listen where it is dispatched, its camera farther up.
      press(event.key, event.code, { shiftKey: event.shiftKey, bubbles: false });
    } else if (event.repeat) return;
    else if (event.key === " ") window.commissionSpace?.(true);
    else if (event.key === "?") press("k", "KeyK", { ctrlKey: true }); // viser's list of commands
    else return;
    event.preventDefault(); // a button that was pressed last is not pressed again
  }, true);
  addEventListener("keyup", (event) => {
    if (event.key !== " " || !event.isTrusted || isTyped(event.target)) return;
    event.preventDefault();
    if (!window.commissionSpace?.(false)) press("p", "KeyP"); // the command "Play or pause"
  }, true);
})();
