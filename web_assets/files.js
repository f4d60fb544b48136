// Files: a look into the folders of the computer that serves the page, what was chosen of late, and files that are
// dropped onto the page.
//
// A field for a path has an element `c-path` before it (commission/app/base/theme.py): it gets a button. What is listed
// is asked of the program, which shows what this browser may name (commission/app/project/browsing.py).
(() => {
  if (window.commissionFiles) return; // the server sends this script again after each reconnection
  window.commissionFiles = true;
  const LOOK_EVERY_MS = 400, MOST_RECENT = 8, KEY = "commission-recent", SENT_WITHIN_MS = 4_000, ASKED_WITHIN_MS = 10_000, MOST_REFUSED = 3;
  const MAPS = /\.(yaml|yml|pgm|png|jpe?g|bmp|tiff?|dxf|stl|obj|glb|ply)$/i;
  const MAP_FILE = /\.ya?ml$/i; // of ROS: it says where its image lies
  const IMPORTS = /\.(csv|txt|imk|json|lif|xml|zip|smap|tsv)$/i;
  const RECORDINGS = /\.(mcap|bag|db3|pcap|pcapng|log|clf|npz|cdr)$/i;
  let count = 0, open = null; // of the field that is being filled: {kind, uuid, input}

  const stored = () => { try { return JSON.parse(localStorage.getItem(KEY)) ?? {}; } catch { return {}; } };
  const recentOf = (kind) => stored()[kind] ?? [];
  function remember(kind, path) {
    if (!path) return;
    const recent = [path, ...recentOf(kind).filter((each) => each !== path)].slice(0, MOST_RECENT);
    try { localStorage.setItem(KEY, JSON.stringify({ ...stored(), [kind]: recent })); } catch { /* not kept then */ }
  }

  function make(tag, kind, text = "") {
    const element = document.createElement(tag);
    element.className = kind;
    element.textContent = text;
    if (tag === "button") element.type = "button";
    return element;
  }

  const dialog = make("div", "c-files");
  dialog.setAttribute("role", "dialog");
  dialog.setAttribute("aria-label", "Files on the server");
  dialog.hidden = true;
  document.body.append(dialog);

  function ask(path) {
    dialog.dataset.waits = "";
    window.commissionTell?.(window.commissionFolders,
      JSON.stringify({ n: ++count, path, recent: recentOf(open.kind) }));
  }
  function close() {
    dialog.hidden = true;
    open?.input.focus();
    open = null;
  }
  function choose(path) {
    const { uuid, kind } = open;
    remember(kind, path);
    window.commissionShow?.(uuid, path);
    window.commissionTell?.(uuid, path);
    close();
  }

  const sizeOf = (bytes) => bytes >= 1e6 ? `${(bytes / 1e6).toFixed(1)} MB`
    : bytes >= 1e3 ? `${(bytes / 1e3).toFixed(0)} kB` : `${bytes} bytes`;
  function line(name, note, isFolder, go) {
    const row = make("button", isFolder ? "c-file c-folder" : "c-file");
    row.append(make("span", "", name), make("small", "", note));
    row.addEventListener("click", go);
    return row;
  }

  window.commissionFound = (found) => {
    if (!open) return;
    delete dialog.dataset.waits;
    const head = make("div", "c-files-head"), list = make("div", "c-files-list"), foot = make("div", "c-files-foot");
    head.append(make("b", "", found.folder || "Files on the server"));
    if (found.problem) list.append(make("div", "c-files-problem", found.problem));
    if (found.recent.length) {
      list.append(make("div", "c-files-title", "Recent"));
      list.append(...found.recent.map((path) => line(path, "", false, () => choose(path))));
      list.append(make("div", "c-files-title", "Folder"));
    }
    if (found.above) {
      const up = line("..", "one folder up", true, () => ask(found.above));
      up.classList.add("c-up");
      list.append(up);
    }
    for (const { name, path, isFolder, size, changed } of found.entries) {
      const when = new Date(changed * 1000).toLocaleDateString();
      const go = isFolder ? () => ask(path) : () => choose(path);
      list.append(line(name, isFolder ? when : `${sizeOf(size)}, ${when}`, isFolder, go));
    }
    if (!found.entries.length && !found.problem) list.append(make("div", "c-files-title", "nothing in this folder"));
    if (found.leftOut) list.append(make("div", "c-files-title", `and ${found.leftOut} more`));
    if (open.kind !== "file" && open.kind !== "map" && found.folder) {
      const take = make("button", "c-files-take", "Choose this folder");
      take.addEventListener("click", () => choose(found.folder));
      foot.append(take);
    }
    const leave = make("button", "", "Close");
    leave.addEventListener("click", close);
    foot.append(leave);
    dialog.replaceChildren(head, list, foot);
    dialog.hidden = false;
    (list.querySelector("button") ?? leave).focus();
  };

  addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || !open) return;
    event.stopImmediatePropagation();
    close();
  }, true);
  addEventListener("pointerdown", ({ target }) => { if (open && !dialog.contains(target)) close(); }, true);

  // The fields for paths get their button; what is typed in them is remembered, too.
  setInterval(() => {
    for (const mark of document.querySelectorAll(".c-path")) {
      const field = mark.parentElement?.nextElementSibling?.closest("div") ?? null;
      const input = (field ?? mark.parentElement?.parentElement?.nextElementSibling)?.querySelector("input");
      const place = input?.parentElement;
      if (!place || place.querySelector(".c-browse")) continue;
      const uuid = input.closest(".mantine-Flex-root")?.querySelector("label[for]")?.htmlFor;
      if (!uuid) continue;
      const button = make("button", "c-browse", "…"), kind = mark.dataset.path;
      button.title = "Look for it on the computer that serves this page";
      button.setAttribute("aria-label", `Browse for ${input.closest(".mantine-Flex-root").innerText.trim()}`);
      button.addEventListener("click", () => {
        open = { kind, uuid, input };
        ask(input.value);
      });
      input.addEventListener("change", () => {
        const path = input.value.trim(), isFile = MAPS.test(path) || IMPORTS.test(path);
        if (isFile || kind === "recording" || kind === "folder") remember(kind, path); // not a folder on the way there
      });
      place.append(button);
    }
  }, LOOK_EVERY_MS);

  // A file that is dropped goes the way of an upload: its button stands in the step Site, in a folder that may be folded.
  const cover = make("div", "c-drop");
  cover.hidden = true;
  document.body.append(cover);
  const hasFiles = (event) => [...event.dataTransfer?.types ?? []].includes("Files");
  function say(text, seconds = 6) {
    cover.textContent = text;
    cover.hidden = false;
    setTimeout(() => { if (cover.textContent === text) cover.hidden = true; }, 1000 * seconds);
  }
  const buttonNamed = (label) => [...document.querySelectorAll("button")].find((each) => each.textContent.trim() === label);
  async function buttonOf(label, folder) {
    const end = performance.now() + SENT_WITHIN_MS;
    const found = () => buttonNamed(label);
    const tab = [...document.querySelectorAll("[role=tab]")].find((each) => each.textContent.trim() === "Site");
    if (tab && tab.getAttribute("aria-selected") !== "true") window.commissionPress?.(tab);
    while (performance.now() < end) {
      const button = found();
      if (button) {
        const head = [...document.querySelectorAll(".mantine-Paper-root")]
          .find((each) => each.style.cursor === "pointer" && each.textContent.trim() === folder);
        if (head && !button.checkVisibility()) window.commissionPress?.(head);
        if (!button.disabled) {
          head?.scrollIntoView({ block: "start" }); // what comes of the file is said there
          return button;
        }
      }
      await new Promise((done) => setTimeout(done, 100));
    }
    return null;
  }
  // A ROS map that is read asks for its image; how long it takes until then is the computer's business.
  async function imageAskedFor(map) {
    const end = performance.now() + ASKED_WITHIN_MS;
    const asks = () => [...document.querySelectorAll(".c-needs-image")].find((each) => each.dataset.map === map)?.dataset.image;
    while (performance.now() < end && !asks()) await new Promise((done) => setTimeout(done, 20));
    return asks();
  }
  const labelOf = (file) => MAPS.test(file.name) ? "Upload a map" : "Upload a file";
  // Returns why the file was not taken; nothing where it was. `before`: what was sent of this drop, by its button.
  async function take(file, isFolder, before) {
    if (isFolder) return `${file.name} is a folder: drop the files that are in it`;
    if (file.size === 0) return `${file.name} is empty: 0 bytes`;
    // What cannot be read would leave the button waiting for ever.
    try { await file.slice(0, 1).arrayBuffer(); } catch { return `${file.name} cannot be read by this browser`; }
    const isMap = MAPS.test(file.name);
    if (RECORDINGS.test(file.name)) {
      return `${file.name} is a recording: lay it on the computer that serves this page, and open it in the step Run`;
    }
    if (!isMap && !IMPORTS.test(file.name)) {
      return `${file.name} is neither a floor map nor a file of reflectors, routes or a project`;
    }
    const label = labelOf(file), first = before.get(label);
    const busy = `${file.name} was not taken: ${first ?? "another file"} is being looked at; accept or cancel that first`;
    if (first) { // one file at a time, but for a ROS map and its image
      const image = MAP_FILE.test(first) && !MAP_FILE.test(file.name) && await imageAskedFor(first);
      if (!image) return busy;
      if (image !== file.name) return `${file.name} was not taken: ${first} needs ${image}`;
    }
    const button = await buttonOf(label, isMap ? "Floor map" : "Exchange");
    const input = button && document.getElementById(`file_upload_${button.id}`);
    if (!input || button.disabled) return busy;
    const one = new DataTransfer();
    one.items.add(file);
    input.files = one.files;
    input.dispatchEvent(new Event("change", { bubbles: true }));
    before.set(label, file.name);
    return "";
  }
  addEventListener("dragover", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    say("Drop a floor map, reflectors, routes or a project; Undo takes back what becomes of it", 1);
  });
  addEventListener("drop", async (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    cover.hidden = true;
    const items = [...event.dataTransfer.items].filter((each) => each.kind === "file");
    const isFolder = items.map((each) => each.webkitGetAsEntry?.()?.isDirectory ?? false); // it is known only now
    // A ROS map first: it asks for its image.
    const files = [...event.dataTransfer.files].map((file, index) => ({ file, isFolder: isFolder[index] }))
      .sort((one, other) => MAP_FILE.test(other.file.name) - MAP_FILE.test(one.file.name));
    const before = new Map(), refused = [];
    for (const { file, isFolder } of files) {
      const why = await take(file, isFolder, before);
      if (why) refused.push(why);
      if (refused.length === MOST_REFUSED) break;
    }
    const left = refused.length === MOST_REFUSED ? ` (${files.length} files were dropped)` : "";
    if (refused.length) say(refused.join("; ") + left, 6 + 2 * refused.length);
  });
})();
