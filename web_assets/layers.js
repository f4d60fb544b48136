// The list of layers: its switches ask the program, which switches for everybody; how strongly a layer is drawn is this
// browser's own, and kept by it.
//
// A row names the scene nodes of its layer (commission/app/base/layers_panel.py). viser draws lines and points without
// an opacity: it is set in their materials. Where that does not match (another viser), they stay opaque.
(() => {
  if (window.commissionLayers) return; // the server sends this script again after each reconnection
  window.commissionLayers = true;
  const LOOK_EVERY_MS = 200, KEY = "commission_opacity", ROUND = "vec4(col, 1.0)";
  let kept = {}, count = 0;
  try { kept = JSON.parse(localStorage.getItem(KEY)) ?? {}; } catch { /* nothing is kept */ }
  const held = new WeakMap(); // of each material its own opacity, and that which was set here

  const layerOf = (element) => element.closest?.(".c-layer")?.dataset.layer;
  addEventListener("change", ({ target }) => {
    const layer = layerOf(target);
    if (layer === undefined || target.type !== "checkbox") return;
    const { inbox } = target.closest(".c-layers").dataset;
    window.commissionTell?.(inbox, JSON.stringify({ n: `${performance.now()} ${++count}`, layer, shown: target.checked }));
  }, true);
  addEventListener("click", ({ target }) => {
    if (target.matches?.(".c-layer > span")) target.previousElementSibling.click(); // a name is as good as its eye
  }, true);
  addEventListener("input", ({ target }) => {
    const layer = layerOf(target);
    if (layer === undefined || target.type !== "range") return;
    kept[layer] = Number(target.value);
    try { localStorage.setItem(KEY, JSON.stringify(kept)); } catch { /* until the page is left */ }
    look();
  }, true);

  function fade(material, share) {
    const before = held.get(material);
    if (!before && share === 1) return false;
    const own = before && material.opacity === before.set ? before.own : material.opacity;
    const set = own * share;
    if (before?.set === set && material.opacity === set) return false;
    const isClear = before?.isClear ?? material.transparent;
    held.set(material, { own, set, isClear });
    material.opacity = set;
    material.transparent = isClear || share < 1;
    if (material.uniforms?.point_ball_norm) {
      if (!material.uniforms.shown) {
        material.uniforms.shown = { value: 1 };
        material.fragmentShader = `uniform float shown;\n${material.fragmentShader.replace(ROUND, "vec4(col, shown)")}`;
      }
      material.uniforms.shown.value = share;
      material.uniformsNeedUpdate = true;
    }
    material.needsUpdate = true;
    return true;
  }

  // The vehicle's frame holds nodes of other layers, too: each part goes by the nearest node that a row names.
  function walk(part, share, owned) {
    let isDue = false;
    for (const material of [part.material ?? []].flat()) isDue = fade(material, share) || isDue;
    for (const child of part.children) if (!owned.has(child)) isDue = walk(child, share, owned) || isDue;
    return isDue;
  }

  function look() {
    const nodes = window.__viserMutable?.nodeRefFromName ?? {}, owned = new Map();
    for (const slider of document.querySelectorAll(".c-layer [data-nodes]")) {
      const percent = kept[layerOf(slider)] ?? 100;
      if (slider.value !== String(percent)) slider.value = percent;
      slider.title = `${percent} %`;
      for (const name of JSON.parse(slider.dataset.nodes)) if (nodes[name]) owned.set(nodes[name], percent / 100);
    }
    let isDue = false;
    for (const [node, share] of owned) isDue = walk(node, share, owned) || isDue;
    if (isDue) window.__viserMutable.requestRender?.();
  }
  setInterval(look, LOOK_EVERY_MS);
})();
