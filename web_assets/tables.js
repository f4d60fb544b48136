// Beside the plots: what happened on the drive, and what each reflector contributed. A click on an event goes to its
// moment, one on a reflector flies there; headers sort, and the dot of a column colors the floor by it.
(() => {
  if (window.commissionTables || !window.commissionPlots) return; // the server sends this script again
  window.commissionTables = true;
  const { ask, seek, views, body, panel, listeners, chips, showChips } = window.commissionPlots;
  const { make, whole, row, head: headOf } = window.commissionTable;
  const COLORS = { fail: "#ff5252", lost: "#ff5252", recovered: "#40c898" };
  let compared = null; // variants
  let found = null, hidden = new Set(), sorted = { column: 0, isDown: false };

  const lists = { events: make("div", { className: "c-list-view c-events" }),
    reflectors: make("div", { className: "c-list-view c-reflectors" }),
    variants: make("div", { className: "c-list-view c-variants" }) };
  body.append(...Object.values(lists));

  const buttons = {};
  for (const [view, title] of [["plots", "Plots"], ["events", "Events"], ["reflectors", "Reflectors"],
    ["variants", "Variants"]]) {
    buttons[view] = make("button", { textContent: title, onclick: () => show(view) });
    views.append(buttons[view]);
  }

  function show(view) {
    panel.dataset.view = view;
    for (const [name, button] of Object.entries(buttons)) button.setAttribute("aria-pressed", name === view);
    draw();
  }

  listeners.found = (message) => {
    found = message;
    buttons.events.textContent = `Events ${found.events.length + found.leftOut}`;
    draw();
  };

  listeners.variants = (message) => {
    compared = message;
    buttons.variants.textContent = message.names.length ? `Variants ${message.names.length - 1}` : "Variants";
    draw();
  };

  function draw() {
    const { view } = panel.dataset;
    if (view === "plots") return showChips();
    chips.replaceChildren();
    if (view === "variants") return drawVariants();
    if (!found) return lists[view].replaceChildren("Not known yet: the drive is being looked through.");
    if (view === "events") drawEvents(); else drawReflectors();
  }

  function table(list, head, rows) {
    const top = list.scrollTop;
    list.replaceChildren(whole(head, rows));
    list.scrollTop = top;
  }

  function drawEvents() {
    const kinds = new Map();
    for (const [, kind] of found.events) kinds.set(kind, (kinds.get(kind) ?? 0) + 1);
    for (const [kind, count] of kinds) {
      const button = make("button", { textContent: `${kind} ${count}`, title: `Show or hide ${kind}` });
      button.setAttribute("aria-pressed", !hidden.has(kind));
      button.onclick = () => {
        if (!hidden.delete(kind)) hidden.add(kind);
        draw();
      };
      chips.append(button);
    }
    if (found.leftOut) chips.append(` and ${found.leftOut} more of their kinds`);
    const head = ["time [s]", "what", "figure"].map((text) => make("th", { textContent: text }));
    const rows = found.events.filter(([, kind]) => !hidden.has(kind)).map(([time, kind, figure]) => {
      const what = make("td", { textContent: kind });
      what.style.color = COLORS[kind] ?? "";
      return row([make("td", { textContent: time.toFixed(2) }), what, make("td", { textContent: figure })],
        "Go to this moment", () => seek(time));
    });
    if (!found.events.length) return lists.events.replaceChildren("Nothing happened: no fail, no jump, no blind stretch, no gap.");
    table(lists.events, head, rows);
  }

  function written(value, decimals) {
    // No minus before a zero.
    return value === null ? "–" : (Math.round(value * 10 ** decimals) / 10 ** decimals || 0).toFixed(decimals);
  }

  function inOrder() {
    const { column, isDown } = sorted, sign = isDown ? -1 : 1;
    return [...found.reflectors].sort((one, other) => {
      const [a, b] = [one[column], other[column]];
      if (a === null || b === null) return (a === null) - (b === null); // what is not known comes last
      return sign * (typeof a === "string" ? a.localeCompare(b, undefined, { numeric: true }) : a - b);
    });
  }

  function header(index, title, hint, key) {
    const order = sorted.column === index ? (sorted.isDown ? "down" : "up") : "";
    const cell = headOf(title, hint, order, () => {
      sorted = { column: index, isDown: sorted.column === index ? !sorted.isDown : index > 0 };
      draw();
    });
    if (!key) return cell;
    const isOn = found.colored === key;
    const color = make("button", { className: "c-color", textContent: isOn ? "◉" : "○",
      title: isOn ? "Color the floor no longer" : `Color the reflectors on the floor by ${title}` });
    color.setAttribute("aria-label", `Color by ${title}`);
    color.onclick = () => ask({ do: "color", figure: isOn ? "" : key });
    cell.append(color);
    return cell;
  }

  function drawReflectors() {
    chips.append(scale());
    const titles = found.columns.map(({ title, unit }) => unit ? `${title} [${unit}]` : title);
    const head = [header(0, "reflector", "Its name in the map.", ""),
      ...found.columns.map(({ hint, key }, index) => header(index + 1, titles[index], hint, key))];
    const rows = inOrder().map(([id, ...values]) => row([make("td", { textContent: id }),
      ...values.map((value, index) => make("td", { textContent: written(value, found.columns[index].decimals) }))],
      `Go to ${id}`, () => ask({ do: "reflector", id })));
    table(lists.reflectors, head, rows);
  }

  function drawVariants() {
    if (!compared) return;
    const keep = make("button", { textContent: "Keep", disabled: !compared.free, className: "c-keep",
      title: compared.free ? "Keep this run as the next variant, and try something else beside it"
        : "Not now: three variants are kept; forget one first", onclick: () => ask({ do: "keep" }) });
    chips.append(keep);
    const { names, moments } = compared;
    if (!names.length) return lists.variants.replaceChildren(
      "Keep the run as it is now, then change a parameter: both are shown beside each other, on the floor, in the plots and here.");
    chips.append(make("span", { title: compared.rule, innerHTML:
      "<i class='c-better'>green</i>, <i class='c-worse'>red</i>: better or worse than now beyond chance; <i class='c-different'>yellow</i>: different" }));
    const cell = (text, kind, expected) => {
      const element = make("td", { textContent: text, className: `c-${kind}`, title: compared.rule });
      if (expected) element.append(make("small", { textContent: `(${expected})`, title: "What a consistent filter shows" }));
      return element;
    };
    const rows = [...compared.settings.map(([key, label, texts]) => make("tr", { className: "c-setting", title: key },
        make("td", { textContent: label }), ...texts.map((text) => make("td", { textContent: text })))),
      ...compared.figures.map(([label, cells]) => make("tr", {}, make("td", { textContent: label }),
        ...cells.map(([text, verdict, expected]) => cell(text, verdict, expected))))];
    const half = Math.ceil(rows.length / 2), heads = (has) => [make("th"), ...names.map((name, index) => variantHeader(name, index, has))];
    const places = moments.map(([time, text]) => row([make("td", { textContent: `${time.toFixed(1)} s` }),
      make("td", { textContent: text })], "Go to this moment", () => seek(time)));
    const top = lists.variants.scrollTop, where = whole([make("th", { colSpan: 2, textContent: "They differ most" })], places);
    where.className = "c-moments";
    lists.variants.replaceChildren(make("div", {}, whole(heads(true), rows.slice(0, half)), whole(heads(false), rows.slice(half)),
      ...(places.length ? [where] : [])));
    lists.variants.scrollTop = top;
  }

  function variantHeader(name, index, hasButtons) {
    const title = make("th", {}, make("b", { textContent: name }));
    title.style.color = compared.colors[index];
    if (!index || !hasButtons) return title;
    const use = make("button", { textContent: "use", title: `Set the parameters of ${name} again (undo takes it back)`,
      onclick: () => ask({ do: "use", letter: name }) });
    const drop = make("button", { textContent: "×", title: `Forget ${name}`, onclick: () => ask({ do: "drop", letter: name }) });
    drop.setAttribute("aria-label", `Forget ${name}`);
    use.setAttribute("aria-label", `Use ${name}`);
    title.append(use, drop);
    return title;
  }

  function scale() {
    if (!found.scale) return make("span", { textContent: "○ in a column's head colors the floor by it; heads sort; a row flies there" });
    const { title, bounds, colors } = found.scale;
    const parts = bounds.length ? bounds.slice(0, -1).map((bound, index) => {
      const block = make("i", { title: `${bound} to ${bounds[index + 1]}` });
      block.style.background = colors[index];
      return block;
    }) : [];
    return make("span", { className: "c-floor-scale" }, `Floor: ${title}  ${bounds[0] ?? "nothing known"} `, ...parts,
      ` ${bounds.at(-1) ?? ""}   grey: not known`);
  }

  // What is listed, as it is listed.
  const button = panel.querySelector(".c-csv"), ofPlots = button.onclick;
  button.onclick = () => {
    const { view } = panel.dataset;
    if (view === "plots" || (view === "variants" ? !compared?.names.length : !found)) return ofPlots();
    const quoted = (value) => /[",\n]/.test(value) ? `"${String(value).replaceAll('"', '""')}"` : String(value ?? "");
    const lines = view === "events"
      ? [["time", "what", "figure"], ...found.events.filter(([, kind]) => !hidden.has(kind))]
      : view === "variants" ? [["figure", ...compared.names, ...compared.names.slice(1).map((name) => `${name} is`)],
        ...compared.settings.map(([key, , texts]) => [key, ...texts]),
        ...compared.figures.map(([label, cells]) => [label, ...cells.map(([text]) => text), ...cells.slice(1).map((each) => each[1])])]
      : [["reflector", ...found.columns.map(({ key }) => key)], ...inOrder()];
    const link = make("a", { download: `${view}.csv` });
    link.href = URL.createObjectURL(new Blob([lines.map((line) => line.map(quoted).join(",")).join("\n") + "\n"]));
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  };
  show("plots");
})();
