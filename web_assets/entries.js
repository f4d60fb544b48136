// An entry is finished when the engineer says so.
//
// viser's page tells the program of every key, so that 97.5 is 9 for a moment. Here a field that is typed into keeps
// its draft: Enter, Tab or a click elsewhere sends what stands in it, once and as it was typed; Escape shows again what
// held. Meanwhile nothing is written into the field. The program judges each entry; what it refuses is said below the
// field (`commissionRefuse`; style: commission/app/base/theme.py).
(() => {
  if (window.commissionEntries) return; // the server sends this script again after each reconnection
  window.commissionEntries = true;
  const FIELDS = ".mantine-NumberInput-input, .mantine-TextInput-input, .mantine-Textarea-input, input.c-cell";
  const STEPS = new Set(["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "PageUp", "PageDown", "Home", "End"]);
  const SAID_FOR_MS = 20_000;
  // A message of over 4 MB would end the connection without a word. Of a longer text goes so much that the server
  // refuses it, says so, and shows in the field again what holds (LONGEST_TEXT in commission/app/base/widget_values.py).
  const ENOUGH_LETTERS = 1_000_001;
  const post = Worker.prototype.postMessage;
  let worker = null; // viser's, which speaks with the program
  let draft = null; // of the field that has the focus: {input, field, uuid, before, said, held}
  let isRestoring = false;
  let lookAtLast = null; // whether the digit that was typed last was swallowed
  const before = new WeakMap(); // what stood in each input before it was typed into
  // Widgets whose entry is finished: what viser makes of it (a number between its bounds when the field is left, the last
  // key's change 50 ms later) is no other entry. A person who goes on comes with a key or the pointer.
  const settled = new Set();
  const sent = new Map(); // the last entry of each widget
  const letters = new WeakMap(); // of the numbers that are typed, the last letter that none has
  const spoiled = new WeakMap(); // those that go on behind it
  const forget = (input) => { letters.delete(input); spoiled.delete(input); };

  // The widget of an input: the nearest element around it that has a label, which names the widget.
  function placeOf(input) {
    for (let field = input.parentElement; field; field = field.parentElement) {
      const labels = field.querySelectorAll("label[for]");
      if (labels.length) return labels.length === 1 ? { field, uuid: labels[0].htmlFor } : null;
    }
    return null;
  }

  const isNumber = (input) => input.classList.contains("mantine-NumberInput-input");
  const numberIn = (text) => (text.trim() === "" ? NaN : Number(text));
  const isSame = (input, one, other) => one === other || (isNumber(input) && numberIn(one) === numberIn(other));

  // A text that seeks in a list tells of every key; it changes nothing.
  const isLive = ({ field }) => field.parentElement.previousElementSibling?.querySelector(".c-live");

  function begin(input) {
    const place = placeOf(input);
    if (!place || isLive(place)) return;
    settled.delete(place.uuid);
    delete place.field.dataset.refused;
    place.field.dataset.draft = "";
    draft = { ...place, input, before: before.get(input) ?? "", said: null, held: undefined };
    holdBack(window.__viserMutable?.messageQueue);
  }

  // What the program writes into the field that is typed into comes later. viser keeps messages until its next picture,
  // a tenth of a second and more without a graphics card: what was written before the first key may still be among them.
  function holdBack(messages) {
    for (const message of (draft && messages) || []) {
      if (message.type !== "GuiUpdateMessage" || message.uuid !== draft.uuid || !("value" in message.updates)) continue;
      const { value, ...others } = message.updates;
      draft.held = value;
      message.updates = others;
    }
  }

  function goOn(target) {
    const place = settled.size ? placeOf(target) : null;
    if (place) settled.delete(place.uuid);
  }

  function end() {
    const ended = draft;
    draft = null;
    if (!ended) return null;
    delete ended.field.dataset.draft;
    settled.add(ended.uuid);
    before.set(ended.input, ended.input.value);
    return ended;
  }

  // What the widget is to hold: of several numbers the one that was typed in is exchanged.
  function meantBy({ input, field, said }) {
    const text = input.value.slice(0, ENOUGH_LETTERS);
    // A cell of a table says, too, which one it is (site_tables.js).
    if (input.dataset.says) return JSON.stringify({ ...JSON.parse(input.dataset.says), text });
    if (!isNumber(input)) return text;
    const inputs = [...field.querySelectorAll(FIELDS)];
    if (inputs.length === 1) return numberIn(input.value);
    const numbers = [...(said ?? inputs.map((each) => numberIn(each.value)))];
    numbers[inputs.indexOf(input)] = numberIn(input.value);
    return numbers;
  }

  function finish() {
    lookAtLast?.();
    const ended = end();
    if (!ended) return;
    // Where another value has come meanwhile, what stood there before is an entry like any other.
    if (ended.held === undefined && isSame(ended.input, ended.input.value, ended.before)) return restore(ended);
    const odd = spoiled.get(ended.input);
    forget(ended.input);
    if (odd) {
      refuse(ended.field, `${oddly(odd)}; nothing is entered`);
      return restore(ended);
    }
    const value = meantBy(ended);
    if ([value].flat().some(Number.isNaN)) {
      refuse(ended.field, `found "${ended.input.value}"; expected a number`);
      return restore(ended);
    }
    sent.set(ended.uuid, ended);
    tell(ended.uuid, value);
  }

  // Other scripts of the page enter values by it, too: what it says is never a draft. False: there is no connection yet.
  window.commissionTell = tell;
  function tell(uuid, value) {
    if (!worker) return false;
    post.call(worker, { type: "send", message: { type: "GuiUpdateMessage", uuid, updates: { value } } });
    return true;
  }
  // What another script has entered is shown at once, as if the program had written it.
  window.commissionShow = (uuid, value) => {
    const messages = [{ type: "GuiUpdateMessage", uuid, updates: { value } }];
    worker?.onmessage({ data: { type: "message_batch", messages } });
  };

  // Of a digit that the field swallows, since it has as many decimals as it takes, the whole reason is kept.
  const oddly = (odd) => odd.length > 1 ? odd : `"${odd}" is not taken; expected digits, a point, a minus in front`;
  function oddIn(input, data) {
    const letter = /[^\d.,\s+-]/.exec(data);
    if (letter) return letter[0];
    const isInFront = input.selectionStart === 0 || input.value === "";
    return /^[+-]/.test(data) && !isInFront ? data[0] : null;
  }

  // Show what held before, or what was written into the field while it was typed into.
  function restore({ input, uuid, before: text, held }) {
    settled.add(uuid);
    forget(input);
    if (input.value !== text) {
      const kind = input instanceof HTMLTextAreaElement ? HTMLTextAreaElement : HTMLInputElement;
      isRestoring = true;
      lookAnew(input);
      Object.getOwnPropertyDescriptor(kind.prototype, "value").set.call(input, text);
      input.dispatchEvent(new Event("input", { bubbles: true }));
      isRestoring = false;
    }
    if (held === undefined) return;
    const messages = [{ type: "GuiUpdateMessage", uuid, updates: { value: held } }];
    worker.onmessage({ data: { type: "message_batch", messages } });
  }

  function refuse(field, text) {
    field.dataset.refused = text;
    window.commissionRefuseCell?.(field, text);
    setTimeout(() => {
      if (field.dataset.refused !== text) return;
      delete field.dataset.refused;
      window.commissionRefuseCell?.(field, "");
    }, SAID_FOR_MS);
  }
  window.commissionRefuse = (uuid, text) => {
    const entry = sent.get(uuid), isCell = entry?.input.dataset.says;
    const field = isCell ? entry.field
      : document.querySelector(`label[for="${CSS.escape(uuid)}"]`)?.closest(".mantine-Flex-root");
    if (!field) return;
    sent.delete(uuid);
    if (entry && draft?.uuid !== uuid) restore(entry); // what was refused does not stay
    refuse(field, text);
  };

  // Fields that show another thing from now on say nothing of what was refused for the one before.
  window.commissionTakeBack = (uuids) => {
    for (const field of document.querySelectorAll("[data-refused]")) {
      if (uuids.includes(field.querySelector("label[for]")?.htmlFor)) delete field.dataset.refused;
    }
  };

  // A number that comes without a key or a click (dropped, dictated, filled in by a helper of the browser) is compared
  // by viser's input with where the caret stood when it was left last, and thrown away as if nothing had changed. A
  // released mouse button lets it look anew.
  let caretIsKnown = false;
  const lookAnew = (input) => input.dispatchEvent(new MouseEvent("mouseup", { bubbles: true }));
  const on = (kind, act) => addEventListener(kind, act, true);
  on("focusin", () => { caretIsKnown = false; });
  on("mouseup", () => { caretIsKnown = true; });

  function lookForSwallowed(input, digit) {
    const { value: was, selectionStart: from, selectionEnd: to } = input;
    const decimals = (was.split(/[.,]/)[1] ?? "").length;
    if (from !== to || !decimals || from <= was.search(/[.,]/)) return;
    // Enter may come before the timer does: who finishes an entry looks first.
    const look = () => {
      if (lookAtLast !== look) return;
      lookAtLast = null;
      if (input.value !== was) return;
      const why = `"${was.slice(0, from)}${digit}" has more than the ${decimals} decimals that are taken here`;
      spoiled.set(input, why);
      if (draft?.input !== input) begin(input);
      if (draft) refuse(draft.field, why);
    };
    lookAtLast = look;
    setTimeout(look);
  }

  on("beforeinput", ({ target, data }) => {
    if (!target.matches?.(FIELDS)) return;
    // viser's input swallows what is no part of a number, and takes a minus to the front from wherever it is typed:
    // 1e-1 would be -11 without a word. An entry that goes on behind such a letter is none.
    const odd = isNumber(target) && oddIn(target, data ?? "");
    if (odd === "-" || odd === "+" || (letters.has(target) && /\d/.test(data ?? ""))) {
      spoiled.set(target, letters.get(target) ?? odd);
    } else if (odd) letters.set(target, odd);
    if (isNumber(target) && /^\d$/.test(data ?? "")) lookForSwallowed(target, data);
    if (draft?.input !== target) before.set(target, target.value);
    if (!caretIsKnown && isNumber(target)) lookAnew(target);
  });
  on("paste", (event) => {
    const { target, clipboardData } = event;
    const text = clipboardData?.getData("text/plain") ?? "";
    if (!isNumber(target) || !target.matches?.(FIELDS) || /^\s*[+-]?[\d.,\s]*$/.test(text)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    const place = placeOf(target);
    if (place) refuse(place.field, `found "${text.trim().slice(0, 40)}"; expected a number, such as 0.25`);
  });
  on("input", ({ target }) => {
    if (target.value === "") forget(target); // begun anew
    if (isRestoring || !target.matches?.(FIELDS)) return;
    if (draft?.input !== target) {
      finish();
      begin(target);
    }
    const odd = spoiled.get(target) ?? letters.get(target);
    if (odd && draft) refuse(draft.field, oddly(odd));
  });
  on("keydown", (event) => {
    caretIsKnown = true;
    if (STEPS.has(event.key)) goOn(event.target);
    const isOneLine = !(event.target instanceof HTMLTextAreaElement);
    if (event.key === "Enter" && (isOneLine || event.ctrlKey)) finish();
    if (event.key !== "Escape" || !draft) return;
    event.stopImmediatePropagation(); // it takes back the entry and nothing else
    event.preventDefault();
    restore(end());
  });
  on("focusout", finish);
  on("pointerdown", ({ target }) => {
    if (draft && !draft.field.contains(target)) finish();
    goOn(target);
  });

  Worker.prototype.postMessage = function (data, ...others) {
    if (data?.type !== "send") return post.call(this, data, ...others);
    attend(this);
    const { type, uuid, updates } = data.message;
    if (type === "GuiUpdateMessage" && updates && "value" in updates) {
      if (draft?.uuid === uuid) {
        draft.said = updates.value;
        return;
      }
      if (settled.has(uuid)) return;
    }
    if (type !== "ViewerCameraMessage") finish(); // what is done now, is done with what stands in the field
    return post.call(this, data, ...others);
  };

  // Nothing is written into a field that is typed into.
  function attend(speaker) {
    if (worker === speaker) return;
    worker = speaker;
    const hear = speaker.onmessage;
    speaker.onmessage = (event) => {
      holdBack(event.data.messages);
      hear.call(speaker, event);
    };
  }
})();
