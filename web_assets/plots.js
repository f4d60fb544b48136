// The instruments below the floor: curves over the drive with one cursor, chosen, zoomed and saved by each browser alone.
//
// The program sends what changes rarely (curves) and what changes with each picture (the cursor) as messages in two
// elements that nobody sees (commission/app/run/plots.py); what a person does goes back into a hidden text field. A
// curve is the smallest and the largest value of each stretch of time: both are drawn, so that nothing hides.
(() => {
  if (window.commissionPlots) return; // the server sends this script again after each reconnection
  const LEFT_PX = 42, RIGHT_PX = 10, ABOVE_PX = 16, BELOW_PX = 15, LOWEST_PX = 78, NAMES_PX = 12, DRAGGED_PX = 4;
  const LOWEST_CURVES_PX = 44;
  const NARROW_PX = 1270; // window in which the names of plots are shortened, so that all are there to choose
  const FONT = "11px sans-serif", INK = "#e7e9ee", AXIS = "#9aa0a8", GRID = "#303338", BACK = "#1b1d21";

  const panel = document.createElement("div");
  panel.className = "c-plots";
  panel.dataset.view = "plots";
  panel.innerHTML = `<div class="c-plots-bar"><span class="c-views"></span><span class="c-chips"></span>
    <span class="c-plots-end"><button class="c-whole" title="Show the whole drive (double click in a plot)">Whole run
    </button><button class="c-csv" title="Save what is shown, scan by scan, as a table">CSV</button>
    <button class="c-png" title="Save what is shown as a picture">PNG</button>
    <button class="c-tall" title="More room for the plots, or less">Taller</button></span></div>
    <div class="c-plots-body"><canvas></canvas></div>`;
  const find = (name) => panel.querySelector(name);
  const canvas = find("canvas"), body = find(".c-plots-body"), chips = find(".c-chips"), views = find(".c-views");

  let root = null, count = 0;
  let plots = null; // as sent, with numbers unpacked
  let cursor = { time: 0, values: [] };
  let view = [0, 1]; // seconds that are shown: what was dragged over at once, finer curves follow
  let hover = null, drag = null, lanes = [], before = 0, isDue = true;

  function ask(what) {
    if (root) window.commissionTell?.(root.dataset.inbox, JSON.stringify({ n: ++count, ...what }));
  }

  // ---- what the program sends
  const numbers = {};
  function hear() {
    for (const carrier of document.querySelectorAll(".c-carried")) {
      const { kind, number, message } = carrier.dataset;
      const known = `${number} ${root?.dataset.inbox}`;
      if (numbers[kind] === known || !message || !listeners[kind]) continue;
      numbers[kind] = known;
      listeners[kind](JSON.parse(message));
      isDue = true;
    }
  }
  const listeners = { curves: take, cursor: (message) => { cursor = message; } };

  function unpacked(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  }

  function take(message) {
    plots = message;
    plots.times = unpacked(message.times);
    for (const chart of plots.charts) {
      for (const line of chart.lines) {
        line.low = unpacked(line.low);
        line.high = line.high ? unpacked(line.high) : line.low;
      }
      // The first one of a plot is on top: no inliers are no inliers, though there are no outliers either.
      chart.drawn = [...chart.lines].reverse().sort((one, other) => other.bars - one.bars);
      // Variants lie below what is shown, so that where they are the same nothing changes.
      chart.drawn.sort((one, other) => (other.variant ?? false) - (one.variant ?? false));
    }
    view = plots.span;
    const whole = find(".c-whole");
    whole.disabled = view[0] <= 0 && view[1] >= plots.duration;
    whole.title = whole.disabled ? "Not now: the whole drive is shown" : "Show the whole drive (double click in a plot)";
    showChips();
  }

  let asked = null; // plots that were asked for and have not come yet
  function showChips() {
    if (!plots || panel.dataset.view !== "plots") return;
    const shown = plots.charts.map(({ title }) => title);
    if (asked && asked.length === shown.length && asked.every((title) => shown.includes(title))) asked = null;
    // Whoever presses two of them at once means both, though the answer to the first is still on its way.
    const chosen = asked ?? shown;
    chips.replaceChildren(...plots.titles.map((title) => chip(title, chosen)));
  }

  function chip(title, chosen) {
    const button = document.createElement("button"), isOn = chosen.includes(title);
    button.textContent = title.replace(/ \[.*/, "");
    // The whole name stays what the button is called; only what is written on it is shorter.
    button.setAttribute("aria-label", button.textContent);
    if (innerWidth < NARROW_PX) button.textContent = shortened(button.textContent);
    button.title = `${isOn ? "Hide" : "Show"} ${title}`;
    button.setAttribute("aria-pressed", isOn);
    button.onclick = () => {
      const titles = isOn ? chosen.filter((each) => each !== title) : [...chosen, title];
      if (!titles.length) return;
      asked = titles;
      ask({ do: "charts", titles });
      showChips();
    };
    return button;
  }

  const shortened = (name) => name.replace(/^2σ of /, "2σ ").replace(/ (of all detections|per scan|by the gate)$/, "");
  addEventListener("resize", showChips);

  // ---- drawing
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  function laidOut(pen, width, height) {
    const n = plots.charts.length;
    const rows = clamp(Math.floor(height / LOWEST_PX), 1, n), columns = Math.ceil(n / rows);
    const w = width / columns, h = height / Math.ceil(n / columns);
    const found = plots.charts.map((chart, index) => {
      const x = (index % columns) * w, y = Math.floor(index / columns) * h;
      return { chart, values: cursor.values[index] ?? [], left: x + LEFT_PX, right: x + w - RIGHT_PX,
        top: y + ABOVE_PX, bottom: y + h - BELOW_PX, x, y, w, h };
    });
    // Where names of curves have no room behind a title, all plots give them lines of their own: as many as the plot
    // with the most names needs, while curves stay high enough to be read.
    const needed = Math.max(...found.map((lane) => widestNames(pen, lane)));
    const most = Math.max(1, Math.floor((h - ABOVE_PX - BELOW_PX - LOWEST_CURVES_PX) / NAMES_PX));
    for (const lane of found) {
      lane.lines = Math.min(needed, most);
      lane.top += lane.lines * NAMES_PX;
    }
    return found;
  }

  // Lines that names need, by the widest numbers that come, so that nothing jumps while they change.
  function widestNames(pen, lane) {
    const { lines, limits } = lane.chart;
    const texts = [...lines.map(({ label, bars }) => `${label} ${bars ? "0.0000–0.00" : "0.000"}`),
      ...limits.map(({ label, steps }) => `- - ${label} ${written(steps[0][1])}`)];
    return placed(pen, { ...lane, lines: 0 }, texts).length === texts.length ? 0
      : Math.max(...placed(pen, { ...lane, lines: texts.length }, texts).map(({ line }) => line));
  }

  // Where each name stands: behind the title, or in lines below it; those without room are left out.
  function placed(pen, lane, texts) {
    pen.font = `600 ${FONT}`;
    const begin = lane.x + 6, behind = begin + 9 + pen.measureText(lane.chart.title).width, found = [];
    pen.font = FONT;
    let line = Math.min(lane.lines, 1), x = line ? begin : behind;
    for (const text of texts) {
      const { width } = pen.measureText(text);
      if (x + width > lane.x + lane.w && x > begin && line < lane.lines) [x, line] = [begin, line + 1];
      if (x + width > lane.x + lane.w) break;
      found.push({ text, x, line });
      x += width + 9;
    }
    return found;
  }

  const xOf = (lane, time) => lane.left + (time - view[0]) / (view[1] - view[0]) * (lane.right - lane.left);
  const timeAt = (lane, x) => view[0] + clamp((x - lane.left) / (lane.right - lane.left), 0, 1) * (view[1] - view[0]);
  function yOf({ chart: { axis: [low, high], log }, top, bottom }, value) {
    const share = log ? Math.log(Math.max(value, low) / low) / Math.log(high / low) : (value - low) / (high - low);
    return bottom - clamp(share, 0, 1) * (bottom - top);
  }

  function ticksOf([low, high], log, most) {
    if (!log) {
      const raw = (high - low) / most, power = 10 ** Math.floor(Math.log10(raw));
      const step = [1, 2, 5, 10].map((nice) => nice * power).find((each) => each >= raw * 0.999);
      return Array.from({ length: Math.floor(high / step + 1e-9) + 1 }, (_, index) => index * step);
    }
    const ticks = [];
    for (let power = Math.ceil(Math.log10(low) - 1e-9); 10 ** power <= high * 1.001; power++) ticks.push(10 ** power);
    return ticks;
  }

  function written(value) {
    if (value === null || Number.isNaN(value)) return "–";
    const size = Math.abs(value);
    return size === 0 ? "0" : size >= 1e5 || size < 1e-3 ? value.toExponential(0)
      : String(Number(value.toPrecision(size >= 100 ? Math.ceil(Math.log10(size + 1)) : 3)));
  }
  const between = (low, high) => written(low) === written(high) ? written(low) : `${written(low)}–${written(high)}`;

  function clockOf(seconds, step) {
    const decimals = step >= 1 ? 0 : Math.min(3, Math.ceil(-Math.log10(step)));
    if (plots.duration < 120) return seconds.toFixed(decimals);
    const rest = seconds % 60;
    const hours = Math.floor(seconds / 3600), minutes = Math.floor(seconds / 60) % 60;
    const text = `${String(minutes).padStart(2, "0")}:${rest.toFixed(decimals).padStart(decimals ? decimals + 3 : 2, "0")}`;
    return hours ? `${hours}:${text}` : text;
  }

  function timeTicks(lane) {
    const raw = (view[1] - view[0]) / Math.max((lane.right - lane.left) / 50, 1), power = 10 ** Math.floor(Math.log10(raw));
    const nice = raw < 10 ? [1, 2, 5, 10].map((each) => each * power) : [10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200];
    const step = nice.find((each) => each >= raw) ?? 14400, ticks = [];
    for (let time = Math.ceil(view[0] / step) * step; time <= view[1] + 1e-9; time += step) ticks.push(time);
    return [ticks, step];
  }

  function draw() {
    const ratio = window.devicePixelRatio || 1, { clientWidth: width, clientHeight: height } = body;
    if (!plots || !width || !height) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
      [canvas.style.width, canvas.style.height] = [`${width}px`, `${height}px`];
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = BACK;
    pen.fillRect(0, 0, width, height);
    lanes = laidOut(pen, width, height);
    for (const lane of lanes) drawLane(pen, lane);
  }

  function drawLane(pen, lane) {
    const { left, right, top, bottom } = lane, width = right - left;
    drawAxes(pen, lane);
    pen.save();
    pen.beginPath();
    pen.rect(left, top - 1, width, bottom - top + 2);
    pen.clip();
    const now = xOf(lane, cursor.time);
    for (const [begin, end] of plots.fails) {
      const from = xOf(lane, begin), to = Math.max(xOf(lane, end), from + 1), split = clamp(now, from, to);
      pen.fillStyle = "rgba(220,40,40,.28)";
      pen.fillRect(from, top, split - from, bottom - top);
      pen.fillStyle = "rgba(220,40,40,.12)";
      pen.fillRect(split, top, to - split, bottom - top);
    }
    // What is lived solid, what is computed behind the cursor thin and pale.
    for (const [from, to, alpha, thick] of [[left, now, 1, 1.5], [Math.max(now, left), right, 0.5, 0.75]]) {
      if (to <= from) continue;
      pen.save();
      pen.beginPath();
      pen.rect(from, top - 2, to - from, bottom - top + 4);
      pen.clip();
      for (const line of lane.chart.drawn) drawLine(pen, lane, line, alpha, thick);
      pen.restore();
    }
    for (const limit of lane.chart.limits) drawLimit(pen, lane, limit);
    for (const time of plots.edits) vertical(pen, lane, xOf(lane, time), plots.editColor, [2, 2]);
    vertical(pen, lane, now, INK, []);
    if (hover !== null) vertical(pen, lane, xOf(lane, hover), AXIS, [3, 3]);
    if (drag?.isMoved) {
      const [from, to] = [drag.begin, drag.end].map((time) => xOf(lane, time)).sort((a, b) => a - b);
      pen.fillStyle = "rgba(77,196,255,.18)";
      pen.fillRect(from, top, to - from, bottom - top);
    }
    pen.restore();
    drawNames(pen, lane);
  }

  function vertical(pen, { top, bottom }, x, color, dashes) {
    pen.strokeStyle = color;
    pen.lineWidth = 1;
    pen.setLineDash(dashes);
    pen.beginPath();
    pen.moveTo(x, top);
    pen.lineTo(x, bottom);
    pen.stroke();
    pen.setLineDash([]);
  }

  function drawAxes(pen, lane) {
    const { left, right, top, bottom, chart } = lane;
    pen.font = "10px sans-serif";
    pen.lineWidth = 1;
    pen.strokeStyle = GRID;
    pen.fillStyle = AXIS;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const ticks = ticksOf(chart.axis, chart.log, Math.max((bottom - top) / 22, 1));
    const every = Math.max(1, Math.ceil(ticks.length * 13 / (bottom - top)));
    ticks.forEach((value, index) => {
      const y = Math.round(yOf(lane, value)) + 0.5;
      pen.beginPath();
      pen.moveTo(left, y);
      pen.lineTo(right, y);
      pen.stroke();
      if (index % every === 0) pen.fillText(written(value), left - 5, Math.max(y, top + 4));
    });
    pen.textAlign = "center";
    pen.textBaseline = "top";
    const [times, step] = timeTicks(lane);
    for (const [index, time] of times.entries()) {
      // Of minutes and seconds the colon is told; of seconds alone the last says it.
      const unit = index === times.length - 1 && plots.duration < 120 ? " s" : "", x = Math.round(xOf(lane, time)) + 0.5;
      pen.beginPath();
      pen.moveTo(x, top);
      pen.lineTo(x, bottom);
      pen.stroke();
      pen.fillText(clockOf(time, step) + unit, clamp(x, left + 4, right - (unit ? 14 : 8)), bottom + 3);
    }
    pen.strokeStyle = "#44484f";
    pen.strokeRect(left + 0.5, Math.round(top) + 0.5, right - left, bottom - top);
  }

  function drawLimit(pen, lane, { color, steps }) {
    pen.strokeStyle = color;
    pen.lineWidth = 1;
    pen.setLineDash([5, 4]);
    pen.beginPath();
    steps.forEach(([time, value], index) => {
      const end = steps[index + 1]?.[0] ?? plots.duration, y = yOf(lane, value);
      pen.moveTo(xOf(lane, time), y);
      pen.lineTo(xOf(lane, end), y);
    });
    pen.stroke();
    pen.setLineDash([]);
  }

  function drawLine(pen, lane, { low, high, color, bars }, alpha, thick) {
    const { times, span } = plots;
    pen.strokeStyle = pen.fillStyle = color;
    pen.lineWidth = thick;
    pen.lineJoin = "round";
    const x = (index) => xOf(lane, span[0] + times[index]);
    for (let first = 0; first < low.length; first++) {
      if (Number.isNaN(low[first])) continue;
      let after = first + 1;
      while (after < low.length && !Number.isNaN(low[after])) after++;
      if (bars || after === first + 1) {
        pen.globalAlpha = alpha * (bars ? 0.6 : 1);
        for (let index = first; index < after; index++) {
          const upper = yOf(lane, high[index]), lower = yOf(lane, low[index]), wide = Math.max(thick, 1);
          pen.fillRect(x(index) - wide / 2, upper - 0.75, wide, lower - upper + 1.5);
        }
      } else {
        drawBand(pen, lane, low, high, x, first, after, alpha);
      }
      first = after;
    }
    pen.globalAlpha = 1;
  }

  function drawBand(pen, lane, low, high, x, first, after, alpha) {
    pen.beginPath();
    for (let index = first; index < after; index++) pen.lineTo(x(index), yOf(lane, high[index]));
    if (high !== low) {
      pen.globalAlpha = alpha;
      pen.stroke();
      for (let index = after - 1; index >= first; index--) pen.lineTo(x(index), yOf(lane, low[index]));
      pen.globalAlpha = 0.45 * alpha;
      pen.fill();
      pen.beginPath();
      for (let index = first; index < after; index++) pen.lineTo(x(index), yOf(lane, low[index]));
    }
    pen.globalAlpha = alpha;
    pen.stroke();
  }

  // Values at the pointer where it is over a plot, else at the cursor.
  function valueOf(lane, index) {
    if (hover === null) {
      const known = lane.values[index];
      return known ? between(...known) : "–";
    }
    const { times, span } = plots, at = hover - span[0];
    let from = 0, to = times.length;
    while (from < to) {
      const middle = (from + to) >> 1;
      if (!(times[middle] > at)) from = middle + 1; else to = middle;
    }
    const { low, high } = lane.chart.lines[index];
    return from ? between(low[from - 1], high[from - 1]) : "–";
  }

  function drawNames(pen, lane) {
    pen.textAlign = "left";
    pen.textBaseline = "alphabetic";
    const named = lane.chart.lines.map(({ label, color }, index) => [`${label} ${valueOf(lane, index)}`, color]);
    for (const { label, color, steps } of lane.chart.limits) {
      const at = hover ?? cursor.time;
      const [, value] = steps.findLast(([time]) => time <= at) ?? steps[0];
      named.push([`- - ${label} ${written(value)}`, color]);
    }
    pen.font = `600 ${FONT}`;
    pen.fillStyle = INK;
    pen.fillText(lane.chart.title, lane.x + 6, lane.y + 11, lane.w - 8);
    lane.names = [];
    for (const { text, x, line } of placed(pen, lane, named.map(([each]) => each))) {
      pen.fillStyle = named[lane.names.length][1];
      pen.fillText(text, x, lane.y + 11 + line * NAMES_PX);
      lane.names.push(text);
    }
  }

  // ---- what a person does
  const laneAt = (x, y) => lanes.find((lane) => x >= lane.x && x < lane.x + lane.w && y >= lane.y && y < lane.y + lane.h);

  function zoom(span) {
    if (!plots) return;
    view = span ?? [0, plots.duration];
    isDue = true;
    ask({ do: "zoom", span });
  }

  canvas.onpointerdown = (event) => {
    const lane = event.button === 0 && laneAt(event.offsetX, event.offsetY);
    if (!lane) return;
    const time = timeAt(lane, event.offsetX);
    drag = { lane, x: event.offsetX, begin: time, end: time, isMoved: false };
    canvas.setPointerCapture(event.pointerId);
  };
  canvas.onpointermove = (event) => {
    const lane = drag?.lane ?? laneAt(event.offsetX, event.offsetY);
    hover = lane ? timeAt(lane, event.offsetX) : null;
    if (drag) {
      drag.end = hover;
      drag.isMoved ||= Math.abs(event.offsetX - drag.x) > DRAGGED_PX;
    }
    isDue = true;
  };
  canvas.onpointerup = (event) => {
    const ended = drag;
    drag = null;
    isDue = true;
    if (!ended) return;
    if (ended.isMoved) {
      const span = [ended.begin, ended.end].sort((a, b) => a - b);
      if (span[1] > span[0]) zoom(span);
    } else {
      if (event.detail < 2) before = cursor.time;
      seek(ended.begin);
    }
  };
  canvas.onpointerleave = () => { hover = null; isDue = true; };
  // Its first click was no wish to go anywhere.
  canvas.ondblclick = () => { seek(before); zoom(null); };
  canvas.addEventListener("wheel", (event) => {
    const lane = laneAt(event.offsetX, event.offsetY);
    if (!lane || !plots) return;
    event.preventDefault();
    const at = timeAt(lane, event.offsetX), factor = 1.25 ** Math.sign(event.deltaY);
    const span = [Math.max(0, at - (at - view[0]) * factor), Math.min(plots.duration, at + (view[1] - at) * factor)];
    zoom(span[0] <= 0 && span[1] >= plots.duration ? null : span);
  }, { passive: false });

  const seek = (time) => ask({ do: "at", time: Math.max(time, 0) });
  find(".c-whole").onclick = () => zoom(null);
  find(".c-csv").onclick = () => ask({ do: "table" });
  find(".c-tall").onclick = ({ target }) => {
    target.textContent = document.documentElement.classList.toggle("c-higher") ? "Lower" : "Taller";
  };
  find(".c-png").onclick = () => {
    hover = null;
    draw();
    canvas.toBlob((blob) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = "curves.png";
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    });
  };
  new ResizeObserver(() => { isDue = true; }).observe(body);

  function goOn() {
    requestAnimationFrame(goOn);
    const place = document.querySelector(".c-instruments");
    if (place && panel.parentNode !== place) {
      place.replaceChildren(panel); // another connection, or the tab is back
      isDue = true;
    }
    root = place ?? root;
    if (place) hear();
    if (!isDue) return;
    isDue = false;
    draw();
  }
  window.commissionPlots = {
    ask, seek, views, body, panel, listeners, chips, showChips,
    // Where a value of a plot is on the screen, and what is shown: for whoever looks at the page from outside.
    pixelOf(title, time, value) {
      const lane = lanes.find(({ chart }) => chart.title === title), box = canvas.getBoundingClientRect();
      return lane ? [box.left + xOf(lane, time), box.top + yOf(lane, value)] : null;
    },
    get namesShown() { return lanes.flatMap(({ names }) => names); },
    drawnLines: () => lanes.flatMap(({ chart }) => chart.lines),
    get shown() { return { view, cursor, titles: lanes.map(({ chart }) => chart.title) }; },
  };
  goOn();
})();
