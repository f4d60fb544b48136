// What viser's page does not do itself.

// It tells whoever looks at it when it shows the past: the program is gone, or does not get on.
//
// viser keeps the last picture when its connection ends, and never notices a computer that has lost its network. So the
// page asks the server itself, every two seconds. What it says stands in the badge (style: commission/app/base/theme.py).
(() => {
  if (window.commissionWatch) return; // the server sends this script again after each reconnection
  window.commissionWatch = true;
  const root = document.documentElement;
  const ASK_EVERY_MS = 2000, WAIT_FOR_ANSWER_MS = 4000, BUSY_AFTER_S = 2;
  let heardAt = performance.now(), lastFailed = false, isShutOut = false, ownerSilentS = 0;

  async function ask() {
    try {
      const answer = await fetch("/alive", { cache: "no-store", signal: AbortSignal.timeout(WAIT_FOR_ANSWER_MS) });
      // Any answer comes from a program that is there; one that makes us wait says nothing else.
      isShutOut = answer.status === 401 || answer.status === 403;
      ownerSilentS = answer.ok ? ((await answer.json()).owner_s ?? 0) : 0;
      heardAt = performance.now();
      lastFailed = false;
    } catch {
      lastFailed = true;
    }
    show();
  }

  function show() {
    const silentS = Math.round((performance.now() - heardAt) / 1000);
    const isGone = lastFailed || silentS * 1000 > ASK_EVERY_MS + WAIT_FOR_ANSWER_MS;
    const isBusy = !isGone && !isShutOut && ownerSilentS > BUSY_AFTER_S;
    const text = isGone ? `NO CONNECTION SINCE ${silentS} s`
      : isShutOut ? "NOT LET IN: OPEN THE ADDRESS THAT THE PROGRAM PRINTS"
      : isBusy ? `BUSY SINCE ${Math.round(ownerSilentS)} s` : "";
    root.classList.toggle("c-stale", text !== "");
    root.style.setProperty("--c-stale", JSON.stringify(text));
  }

  async function goOn() {
    await ask();
    setTimeout(goOn, ASK_EVERY_MS);
  }
  goOn();
  setInterval(show, 500);
  // A hidden page's clock stands nearly still.
  document.addEventListener("visibilitychange", () => document.hidden || ask());
})();

// It loses nothing that a person has entered: two ways in which viser's page would.
(() => {
  if (window.commissionCare) return;
  window.commissionCare = true;

  // A number that comes without a key or a click (dropped, dictated, filled in by a helper of the browser) is compared
  // by the input with where the caret stood when the field was left last, and thrown away as if nothing had changed.
  // A released mouse button lets it look anew.
  let caretIsKnown = false;
  const knows = (known) => () => { caretIsKnown = known; };
  addEventListener("focusin", knows(false), true);
  addEventListener("keydown", knows(true), true);
  addEventListener("mouseup", knows(true), true);
  addEventListener("beforeinput", (event) => {
    if (caretIsKnown || !event.target.classList?.contains("mantine-NumberInput-input")) return;
    event.target.dispatchEvent(new MouseEvent("mouseup", { bubbles: true }));
  }, true);

  // A message of over 4 MB would end the connection without a word. Of a longer text goes so much that the server
  // refuses it, says so, and shows in the field again what holds (LONGEST_TEXT in commission/app/base/widget_values.py).
  const ENOUGH_LETTERS = 1_000_001;
  const post = Worker.prototype.postMessage;
  Worker.prototype.postMessage = function (data, ...others) {
    const value = data?.type === "send" ? data.message?.updates?.value : undefined;
    if (typeof value === "string" && value.length > ENOUGH_LETTERS) {
      const updates = { ...data.message.updates, value: value.slice(0, ENOUGH_LETTERS) };
      data = { ...data, message: { ...data.message, updates } };
    }
    return post.call(this, data, ...others);
  };
})();
