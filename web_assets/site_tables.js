// Reflectors, routes, stations, tags, zones and scanners as tables: heads sort, a row selects (with ctrl one more, with
// shift all between; then a row above them all sets what they share), and a cell of the selected row, or any cell by a double click, is edited like each entry of the page
// (entries.js): Enter, Tab or a click elsewhere finishes it, Escape takes it back, a refusal is said in the cell.
//
// The program sends what there is to see (commission/app/editing/data_table.py) and hears what is done.
(() => {
  if (window.commissionSiteTables) return; // the server sends this script again after each reconnection
  window.commissionSiteTables = true;
  const { make, whole, row, head } = window.commissionTable;
  const LOOK_EVERY_MS = 60, SAID_AT_MOST_MS = 1500, LOWEST_PX = 96, BELOW_PX = 4;
  const YES = "yes", NO = "no", ALL = "";
  const tabs = new Map(); // of each tab: what it shows
  // While a button of the mouse is held nothing is drawn anew: a row that is exchanged under it would not be clicked.
  let isHeld = false;
  addEventListener("pointerdown", () => { isHeld = true; }, true);
  for (const kind of ["pointerup", "pointercancel", "blur"]) {
    addEventListener(kind, () => setTimeout(() => { isHeld = false; }), true);
  }
  let count = 0, cellIsOpen = null; // what is being edited: {input, cell, tab, table, key, column}

  const nameOf = ({ table, key, column }) => JSON.stringify([table.name, key, column.key]);
  const tell = (tab, what) => window.commissionTell?.(tab.inbox, JSON.stringify({ n: ++count, ...what }));

  setInterval(() => {
    for (const root of document.querySelectorAll(".c-tables")) {
      const { kind, inbox } = root.dataset, tab = tabs.get(kind) ?? { kind, refused: new Map(), selected: "" };
      tabs.set(kind, tab);
      tab.inbox = inbox;
      const carrier = document.querySelector(`.c-carried[data-kind="${kind}"]`);
      const known = `${carrier?.dataset.number} ${inbox}`;
      const isNew = carrier?.dataset.message && tab.known !== known;
      if (isNew) Object.assign(tab, { known, tables: JSON.parse(carrier.dataset.message).tables, isDue: true });
      if (root !== tab.root) Object.assign(tab, { root, isDue: true }); // another connection, or the tab is back
      if (tab.isDue && tab.tables && cellIsOpen?.tab !== tab && !isHeld) draw(tab);
      fit(tab);
    }
  }, LOOK_EVERY_MS);

  // As high as there is room: its heads stay in sight.
  function fit(tab) {
    const view = tab.root.closest(".mantine-ScrollArea-viewport"), list = tab.list;
    if (!view || !list?.isConnected || !list.checkVisibility()) return;
    const box = view.getBoundingClientRect(), top = list.getBoundingClientRect().top - box.top + view.scrollTop;
    const height = `${Math.max(LOWEST_PX, box.height - top - BELOW_PX)}px`;
    if (list.style.maxHeight !== height) list.style.maxHeight = height;
    const selected = [...list.querySelectorAll("tr[aria-selected=true]")];
    const names = selected.map((each) => each.dataset.key).join("\n");
    if (names === tab.selected) return;
    const before = new Set(tab.selected.split("\n"));
    tab.selected = names;
    intoView(list, selected.find((each) => !before.has(each.dataset.key)) ?? selected[0]);
  }

  // A row that can be seen stays where it is; the heads cover the first line.
  function intoView(list, line) {
    if (!line) return;
    const box = list.getBoundingClientRect(), its = line.getBoundingClientRect();
    const above = line.closest("table").tHead.offsetHeight;
    if (its.top < box.top + above) list.scrollTop -= box.top + above - its.top;
    else if (its.bottom > box.bottom - 12) list.scrollTop += its.bottom - box.bottom + 12;
  }

  function draw(tab) {
    tab.isDue = false;
    tab.list ??= make("div", { className: "c-data" });
    if (tab.list.parentNode !== tab.root) tab.root.replaceChildren(tab.list);
    const { scrollTop, scrollLeft } = tab.list, held = document.activeElement;
    const focus = tab.list.contains(held) ? held.closest("tr")?.dataset.key : undefined;
    tab.list.replaceChildren(...tab.tables.flatMap((table) => drawn(tab, table)));
    Object.assign(tab.list, { scrollTop, scrollLeft });
    if (focus === undefined) return;
    tab.list.querySelector(`tr[data-key="${CSS.escape(focus)}"]`)?.focus({ preventScroll: true });
  }

  function drawn(tab, table) {
    const [by, isDown] = table.sorted;
    const heads = table.columns.map(({ key, title, hint, right }) => {
      const sort = () => tell(tab, { do: "sort", table: table.name, column: key });
      const cell = head(title, hint, key === by ? (isDown ? "down" : "up") : "", sort);
      if (right) cell.className = "c-right";
      return cell;
    });
    const decimals = table.columns.map(({ right }, index) =>
      right ? Math.max(...table.rows.map(([, , , texts]) => decimalsOf(texts[index]))) : null);
    const rows = table.rows.flatMap(([key, isSelected, tint, texts]) => {
      const cells = texts.map((text, index) => cellOf(tab, table, key, table.columns[index], text, decimals[index]));
      const line = row(cells, "", (event) => press(event, tab, table, key));
      line.dataset.key = key;
      if (tint) line.dataset.tint = tint;
      line.setAttribute("aria-selected", Boolean(isSelected));
      line.addEventListener("keydown", (event) => {
        if (event.key === "F2" && event.target === line) edit(line.querySelector("[data-edits]"));
      });
      const refused = cells.map((cell) => cell.dataset.refused).filter(Boolean).join(" ");
      if (!refused) return [line];
      const said = make("td", { colSpan: cells.length }, make("div", { textContent: refused }));
      return [line, make("tr", { className: "c-refusal" }, said)];
    });
    if (table.every.length) rows.unshift(...everyRow(tab, table));
    const title = table.title ? [make("h4", { textContent: table.title })] : [];
    return [...title, whole(heads, rows)];
  }

  // What all that are selected share; an entry in it is for each of them.
  function everyRow(tab, table) {
    const cells = table.every.map((text, index) =>
      text === null ? make("td") : cellOf(tab, table, ALL, table.columns[index], text, null));
    cells[0].textContent = `All ${table.chosen}`;
    const line = row(cells, "An entry here is for all that are selected", (event) => {
      edit(event.target.closest("[data-edits]"));
    });
    line.className = "c-every";
    line.dataset.key = ALL;
    const refused = cells.map((cell) => cell.dataset.refused).filter(Boolean).join(" ");
    if (!refused) return [line];
    const said = make("td", { colSpan: cells.length }, make("div", { textContent: refused }));
    return [line, make("tr", { className: "c-refusal" }, said)];
  }

  // Below each other numbers have as many decimals as the longest: 3.900 above 10.444.
  const decimalsOf = (text) => /^-?\d+\.(\d+)$/.exec(text)?.[1].length ?? 0;

  function cellOf(tab, table, key, column, text, decimals) {
    const cell = make("td", { className: column.right ? "c-right" : "" }), place = { tab, table, key, column, cell };
    cell.textContent = decimals && Number.isFinite(Number(text)) ? Number(text).toFixed(decimals) : text;
    if (column.kind === "switch") {
      const box = make("input", { type: "checkbox", checked: text === YES, title: column.title });
      box.indeterminate = text !== YES && text !== NO;
      box.setAttribute("aria-label", `${column.title} of ${key || "all"}`);
      box.onclick = (event) => event.stopPropagation();
      box.onchange = () => {
        tell(tab, enters(place, box.checked ? YES : NO));
        setTimeout(() => { tab.isDue = true; }, SAID_AT_MOST_MS);
      };
      cell.replaceChildren(box);
    } else if (column.kind !== "fixed") {
      cell.dataset.edits = "";
      cell.title = "Double click, or F2 on the row: edit";
      cell.place = { ...place, text };
      cell.ondblclick = () => edit(cell);
    }
    const refused = tab.refused.get(nameOf(place));
    if (refused) cell.dataset.refused = refused;
    return cell;
  }

  const enters = ({ table, key, column }, text) => ({ do: "cell", table: table.name, key, column: column.key, text });

  function press(event, tab, table, key) {
    if (event.target.closest("input, select")) return;
    const line = event.currentTarget, isAlone = tab.list.querySelectorAll("tr[aria-selected=true]").length === 1;
    const cell = event.target.closest("[data-edits]");
    let how = "only";
    if (event.shiftKey && tab.begin) how = "range";
    else if (event.ctrlKey || event.metaKey) how = "toggle";
    else if (cell && isAlone && line.getAttribute("aria-selected") === "true") return edit(cell);
    if (how !== "range") tab.begin = key;
    getSelection()?.removeAllRanges(); // shift marks text
    tell(tab, { do: "row", table: table.name, key, how, begin: how === "range" ? tab.begin : "" });
  }

  function edit(cell) {
    if (!cell?.place || cellIsOpen?.cell === cell) return;
    close();
    const { tab, table, key, column, text } = cell.place;
    tab.refused.delete(nameOf(cell.place));
    delete cell.dataset.refused;
    const isChoice = column.kind === "choice";
    const input = isChoice ? make("select", {}, ...column.options.map((each) => make("option", { textContent: each })))
      : make("input", { type: "text", size: 1, spellcheck: false });
    input.value = text;
    input.setAttribute("aria-label", `${column.title} of ${key || "all"}`);
    input.className = "c-cell";
    if (!isChoice) input.dataset.says = JSON.stringify({ n: ++count, ...enters(cell.place, "") });
    // By it entries.js finds which widget hears what is entered.
    const label = make("label", { htmlFor: tab.inbox, hidden: true });
    cell.style.minWidth = `${cell.offsetWidth}px`;
    cell.replaceChildren(input, label);
    cellIsOpen = { ...cell.place, cell, input };
    input.focus();
    if (!isChoice) input.select();
    else input.onchange = () => {
      tell(tab, enters(cell.place, input.value));
      close();
    };
    // Those who look at all keys of the window (entries.js) have had their say when it is left.
    input.onblur = () => setTimeout(() => { if (cellIsOpen?.input === input) close(); });
  }

  // Show the cell again: what was entered, until the program says what holds now.
  function close() {
    const open = cellIsOpen;
    cellIsOpen = null;
    if (!open) return;
    const { cell, input, tab } = open;
    const refused = tab.refused.get(nameOf(open));
    cell.textContent = refused ? open.text : input.value;
    if (cell.textContent === open.text) return;
    cell.dataset.due = "";
    setTimeout(() => { tab.isDue = true; }, SAID_AT_MOST_MS); // nothing has changed by it
  }

  // What was refused is said in the cell, also where the table has been drawn anew meanwhile.
  window.commissionRefuseCell = (field, text) => {
    const place = field?.place;
    if (!place) return;
    const { tab } = place;
    if (text) tab.refused.set(nameOf(place), text);
    else tab.refused.delete(nameOf(place));
    tab.isDue = true;
  };

  window.commissionTable.key = (event) => {
    const open = cellIsOpen;
    if (!open || event.target !== open.input) return;
    if (event.key === "Escape") {
      // entries.js takes the entry back; where nothing was typed, the key is for nobody else either.
      if (open.input.value === open.text) event.stopImmediatePropagation();
      setTimeout(() => leave(open));
    } else if (event.key === "Enter") setTimeout(() => leave(open));
    else if (event.key === "Tab") {
      event.preventDefault();
      const cells = [...open.cell.parentElement.querySelectorAll("[data-edits]")];
      const next = cells[cells.indexOf(open.cell) + (event.shiftKey ? -1 : 1)];
      open.input.blur();
      if (next) edit(next);
    }
  };

  function leave({ input, cell }) {
    if (cellIsOpen?.input !== input) return;
    close();
    cell.closest("tr")?.focus({ preventScroll: true });
  }
})();
