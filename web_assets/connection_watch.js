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
