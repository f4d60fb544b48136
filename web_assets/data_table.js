// What all tables of the page are made of: elements, rows that the keyboard reaches, heads that sort.
(() => {
  if (window.commissionTable) return; // the server sends this script again after each reconnection

  const make = (tag, properties = {}, ...children) => {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  };

  const whole = (head, rows) =>
    make("table", {}, make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...rows));

  // Rows can be reached by the keyboard, too.
  function row(cells, title, act) {
    const onkeydown = (event) => { if (event.key === "Enter" && event.target.tagName === "TR") act(event); };
    return make("tr", { title, tabIndex: 0, onclick: act, onkeydown }, ...cells);
  }

  // A head that sorts; `order` is "up", "down" or nothing.
  function head(title, hint, order, sort) {
    const mark = order === "up" ? " ▴" : order === "down" ? " ▾" : "";
    const name = make("button", { textContent: title + mark, title: `${hint} Click: sort.`.trim(), onclick: sort });
    const cell = make("th", {}, name);
    if (order) cell.setAttribute("aria-sort", order === "up" ? "ascending" : "descending");
    return cell;
  }

  window.commissionTable = { make, whole, row, head, key: null };
  // Keys in a cell are heard here first: those who look at all keys of the window come later, and keep Escape.
  addEventListener("keydown", (event) => window.commissionTable.key?.(event), true);
})();
