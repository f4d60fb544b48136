// Keys that viser's commands cannot have: Space plays or pauses, "?" shows all commands with their keys.
(() => {
  if (window.commissionKeys) return; // the server sends this script again after each reconnection
  window.commissionKeys = true;
  const isTyped = (target) => target.closest?.("input:not([type=checkbox]), textarea, [contenteditable=true]");
  const press = (key, code, ctrlKey) =>
    document.documentElement.dispatchEvent(new KeyboardEvent("keydown", { key, code, ctrlKey, bubbles: true }));

  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || isTyped(event.target)) return;
    if (event.key === " ") press("p", "KeyP", false); // the command "Play or pause"
    else if (event.key === "?") press("k", "KeyK", true); // viser's list of commands
    else return;
    event.preventDefault(); // a button that was pressed last is not pressed again
  }, true);
})();
