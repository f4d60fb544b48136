// A reload, or a connection that comes back, finds tabs, folders and the plan's place as this browser had them.
//
// The program sends its panels anew, with the first tab in front and the whole site in view. What a person has chosen
// since the window was opened is kept in the window's own storage; nobody else's window is touched.
(() => {
  if (window.commissionKept) return; // the server sends this script again after each reconnection
  window.commissionKept = true;
  const KEY = "commission-view", LOOK_EVERY_MS = 300, SETTLED_MS = 600, FLAT_DEGREES = 5;
  const read = () => { try { return JSON.parse(sessionStorage.getItem(KEY)) ?? {}; } catch { return {}; } };
  const kept = { tabs: {}, folders: {}, camera: null, ...read() };
  const save = () => { try { sessionStorage.setItem(KEY, JSON.stringify(kept)); } catch { /* nothing is kept then */ } };
  const done = new WeakSet(); // elements that have been brought back
  const me = kept.window ??= crypto.randomUUID?.() ?? String(Math.random()); // insecure pages have no randomUUID
  save();
  let told = null; // where this window has said who it is: each connection asks anew
  function sayWho() {
    const inbox = window.commissionWindow;
    if (inbox && inbox !== told && window.commissionTell?.(inbox, me)) told = inbox;
  }
  const name = (element) => element.textContent.trim();
  // The head of a folder stands before what it hides; null: it is none.
  const isOpened = (head) => head.style.cursor === "pointer" && head.nextElementSibling
    ? head.nextElementSibling.ariaHidden !== "true" : null;
  const sideOf = (tab) => name(tab.closest("[role=tablist]")?.querySelector("[role=tab]") ?? tab);

  const keepTab = (tab) => { kept.tabs[sideOf(tab)] = name(tab); save(); };
  window.commissionKeepTab = keepTab;
  addEventListener("pointerup", ({ target, isTrusted }) => {
    const tab = isTrusted && target.closest?.("[role=tab]");
    if (tab) keepTab(tab);
  }, true);
  addEventListener("click", ({ target }) => {
    const head = target.closest?.(".mantine-Paper-root");
    const isOpen = head ? isOpened(head) : null;
    if (isOpen === null) return;
    kept.folders[name(head)] = !isOpen; // as it is once the click has been heard
    save();
  }, true);

  function bringBack() {
    for (const tab of document.querySelectorAll("[role=tab]")) {
      if (done.has(tab) || kept.tabs[sideOf(tab)] !== name(tab)) continue;
      done.add(tab);
      if (tab.getAttribute("aria-selected") !== "true") window.commissionPress?.(tab);
    }
    for (const head of document.querySelectorAll(".mantine-Paper-root")) {
      const wanted = kept.folders[name(head)];
      if (done.has(head) || wanted === undefined || isOpened(head) === null || !head.checkVisibility()) continue;
      done.add(head);
      if (isOpened(head) !== wanted) window.commissionPress?.(head);
    }
  }

  // The camera is put back once a picture of the whole site stands, and again until the program has heard of it and fits
  // the site no more; who moves the floor in between keeps what was moved to. Who saw the whole site (the program tells,
  // cameras.py) sees it again in the shape that the floor has now, and another site is seen whole.
  const wanted = kept.camera;
  const site = () => document.querySelector(".c-top span")?.textContent ?? "";
  let isBack = !wanted, wasBack = false, since = 0, last = "";
  for (const kind of ["wheel", "pointerdown"]) {
    addEventListener(kind, ({ target }) => {
      if (wasBack || target === window.__viserMutable?.canvas) isBack = true; // "Fit", or a line of a table, too
    }, true);
  }
  function followCamera() {
    const { camera, cameraControl } = window.__viserMutable ?? {};
    if (!camera || !cameraControl || !(camera.fov < FLAT_DEGREES)) return;
    const now = [...cameraControl.getPosition(camera.position.clone()).toArray(),
      ...cameraControl.getTarget(camera.position.clone()).toArray()];
    const origin = String(window.commissionOrigin ?? [0, 0]);
    if (now.join() !== last) [last, since] = [now.join(), performance.now()];
    if (performance.now() - since < SETTLED_MS) return;
    if (!site()) return; // the bar has not come
    if (!isBack && wanted.origin === origin && wanted.site === site()) {
      if (!window.commissionStands) window.commissionMovedNow?.();
      wasBack = true;
      if (now.some((value, index) => Math.abs(value - wanted.at[index]) > 0.01)) {
        cameraControl.setLookAt(...wanted.at, false);
      } else isBack = Boolean(window.commissionStands);
      return;
    }
    const seen = window.commissionWhole ? null : { origin, site: site(), at: now };
    if (JSON.stringify(kept.camera) !== JSON.stringify(seen)) {
      kept.camera = seen;
      save();
    }
  }
  setInterval(() => { sayWho(); bringBack(); followCamera(); }, LOOK_EVERY_MS);
})();
