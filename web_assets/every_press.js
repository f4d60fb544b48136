// Every press is told of. viser tells of clicks on the floor, and of buttons, at most every 20 or 50 ms, and of those in
// between of the last alone. Where the browser is busy (it draws without a graphics card) clicks wait in a row, are
// carried out at once one after the other, and no timer comes in between: of three reflectors that were placed one was
// there. So that time is over as soon as a press has been carried out. Drags are told of as before.
(() => {
  if (window.commissionEveryPress) return; // the server sends this script again after each reconnection
  window.commissionEveryPress = true;
  const BETWEEN_MS = new Set([20, 50]);
  const plain = window.setTimeout;
  let isPressing = false;
  const end = () => { isPressing = false; };

  window.setTimeout = function (act, delay, ...given) {
    if (!isPressing || !BETWEEN_MS.has(delay) || typeof act !== "function") return plain.call(window, act, delay, ...given);
    queueMicrotask(() => act(...given));
    return 0; // of no timer
  };

  for (const kind of ["pointerup", "click"]) {
    addEventListener(kind, () => {
      isPressing = true;
      plain.call(window, end); // whoever stops an event keeps it from the listener below
    }, true);
    addEventListener(kind, end);
  }
})();
