// Sliders: one drag is one undo step, and a probability near 1 has a scale on which 99 and 99.99 % can be told apart.
//
// The program is told when a slider is taken hold of and let go (`commissionHold` names the check box for it). Over a
// slider that a `.c-tail` names (commission/app/base/field_widget.py) lies another one, logarithmic in what is missing
// to 100 %; number field and value stay viser's. A tick stands where the saved project has it.
(() => {
  if (window.commissionSliders) return; // the server sends this script again after each reconnection
  window.commissionSliders = true;
  const STEPS = 1000, HANDLE_PX = 16, SEND_EVERY_MS = 50, LOOK_EVERY_MS = 150;
  const LAST_VALUE_MS = 200; // viser sends the last value of a drag somewhat later

  // ---- a drag
  let letGo = null;
  function release() {
    if (letGo === null) return;
    clearTimeout(letGo);
    letGo = null;
    window.commissionTell?.(window.commissionHold, false);
  }
  addEventListener("pointerdown", ({ target }) => {
    if (!window.commissionHold || !target.closest?.(".mantine-Slider-root, .c-tail-slider")) return;
    release();
    window.commissionTell?.(window.commissionHold, true);
    const end = () => {
      for (const kind of ["pointerup", "pointercancel"]) removeEventListener(kind, end, true);
      letGo = setTimeout(release, LAST_VALUE_MS);
    };
    for (const kind of ["pointerup", "pointercancel"]) addEventListener(kind, end, true);
  }, true);

  // ---- logarithmic in what is missing
  const shareOf = (value, low, high) => Math.log((100 - low) / (100 - value)) / Math.log((100 - low) / (100 - high));
  function valueAt(share, low, high) {
    const missing = (100 - low) * ((100 - high) / (100 - low)) ** share;
    return Number((100 - missing).toFixed(Math.max(0, 1 - Math.floor(Math.log10(missing)))));
  }

  function lay(carrier) {
    const { field, low, high, saved } = carrier.dataset;
    const plain = document.querySelector(`label[for="${CSS.escape(field)}"]`)
      ?.closest(".mantine-Flex-root")?.querySelector(".mantine-Slider-root");
    if (!plain) return;
    const ends = [Number(low), Number(high)];
    let slider = plain.parentElement.querySelector(".c-tail-slider");
    if (!slider) {
      slider = document.createElement("input");
      Object.assign(slider, { type: "range", className: "c-tail-slider", min: 0, max: STEPS, step: 1 });
      slider.setAttribute("aria-label", "logarithmic in 1 - P");
      plain.classList.add("c-tail-plain");
      plain.parentElement.style.position = "relative";
      plain.after(slider, Object.assign(document.createElement("i"), { className: "c-tail-tick" }));
      let timer = null, value = 0;
      const send = () => { timer = null; window.commissionTell?.(field, value); };
      slider.addEventListener("input", () => {
        value = valueAt(slider.value / STEPS, ...ends);
        window.commissionShow?.(field, value);
        timer ??= setTimeout(send, SEND_EVERY_MS);
      });
      slider.addEventListener("keydown", (event) => event.key.startsWith("Arrow") && event.stopPropagation());
      slider.addEventListener("pointerdown", () => { slider.dataset.held = ""; });
      addEventListener("pointerup", () => { delete slider.dataset.held; }, true);
    }
    Object.assign(slider.style, { left: `${plain.offsetLeft}px`, width: `${plain.offsetWidth}px` });
    const place = (value) => Math.min(1, Math.max(0, shareOf(value, ...ends)));
    const now = Number(plain.querySelector("[role=slider]")?.getAttribute("aria-valuenow"));
    if (!("held" in slider.dataset) && now < 100) slider.value = Math.round(STEPS * place(now));
    const tick = plain.parentElement.querySelector(".c-tail-tick");
    tick.hidden = !saved;
    // The middle of the slider's handle stays half of it within its ends.
    const room = plain.offsetWidth - HANDLE_PX;
    if (saved) tick.style.left = `${plain.offsetLeft + 0.5 * HANDLE_PX + room * place(Number(saved))}px`;
    tick.title = `saved: ${saved} %`;
  }
  setInterval(() => document.querySelectorAll(".c-tail").forEach(lay), LOOK_EVERY_MS);
})();
