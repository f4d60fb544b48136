// Marks of the floor are as large on the screen from near and far.
//
// viser draws points of a size in metres: at full zoom, a mark would cover what it marks. Points in a node whose name
// ends in "13px" (commission/app/base/marks.py) are drawn with that diameter instead, and its "sparkle", a fat star, as
// a thin cross. Where this does not match (another viser), points have their size in metres and everything still works.
(() => {
  if (window.commissionMarks) return; // the server sends this script again after each reconnection
  window.commissionMarks = true;
  const LOOK_FOR_NEW_MS = 200;
  const ARM_PX = 2; // thickness of a cross
  const PICTURES = ["/plan/heat", "/plan/ambiguity", "/plan/difference"];
  const CASING = /^\/(?!routes_|reflectors\/).*_casing(\/\d+px)?$/; // those of routes and reflectors are seen on walls, too
  const held = new WeakSet();

  function hold(points, pixels) {
    held.add(points);
    // viser's shader makes a point `scale / depth` pixels large.
    points.onBeforeRender = (renderer, _scene, camera) => {
      const first = points.geometry.attributes.position;
      if (!first?.count) return;
      const place = points.position.clone().fromBufferAttribute(first, 0);
      const depth = -points.localToWorld(place).applyMatrix4(camera.matrixWorldInverse).z;
      points.material.uniforms.scale.value = pixels * renderer.getPixelRatio() * depth;
      points.material.uniformsNeedUpdate = true;
      if (points.material.uniforms.point_ball_norm.value < 1) cross(points.material, pixels);
    };
  }

  function cross(material, pixels) {
    const half = (0.5 * ARM_PX / pixels).toFixed(4);
    const beside = `min(abs(gl_PointCoord.x - 0.5), abs(gl_PointCoord.y - 0.5)) > ${half}`;
    material.uniforms.point_ball_norm.value = 1e6; // no longer a star
    material.fragmentShader = material.fragmentShader.replace("void main() {", `void main() { if (${beside}) discard;`);
    material.needsUpdate = true;
  }

  // What is around thin marks is drawn where there is a heatmap below them: on plain floor it is hardly seen, and without a
  // graphics card it takes a third of the time of a picture.
  let isCased = null;
  function showCasings(nodes) {
    const isOver = PICTURES.some((name) => nodes[name]?.visible);
    for (const [name, node] of Object.entries(nodes)) {
      if (!CASING.test(name)) continue;
      node.traverse((part) => { if (part !== node && (part.isMesh || part.isPoints)) part.visible = isOver; });
    }
    if (isCased !== isOver) window.__viserMutable?.requestRender?.();
    isCased = isOver;
  }

  setInterval(() => {
    const nodes = window.__viserMutable?.nodeRefFromName ?? {};
    showCasings(nodes);
    for (const [name, node] of Object.entries(nodes)) {
      const size = /\/(\d+)px$/.exec(name);
      if (size) node.traverse((part) => { if (part.isPoints && !held.has(part)) hold(part, Number(size[1])); });
    }
  }, LOOK_FOR_NEW_MS);
})();
