// Draws when something has changed, and asks the module what is under the pointer.

const { instance } = await WebAssembly.instantiateStreaming(fetch("web.wasm"), {});
const { memory, size, draw, pick, blocks } = instance.exports;

const element = (id) => document.getElementById(id);
const side = size();
const [picture, overlay] = ["picture", "overlay"].map((id) => {
  const canvas = element(id);
  canvas.width = canvas.height = side;
  return canvas.getContext("2d", { willReadFrequently: true });
});

// `?still` begins without turning, so that a test sees the same frames each time.
element("turning").checked = !new URLSearchParams(location.search).has("still");
const view = { yaw: 0.6, pitch: 0.5, distance: 3.6 };
let pointer = null; // in pixels of the frame
let selected = -1; // a triangle, or all
let changed = true;
let before = performance.now();
let milliseconds = null; // for a frame, on average

function frame(now) {
  if (element("turning").checked && document.body.dataset.frames) {
    view.yaw += (now - before) * 0.0005;
    changed = true;
  }
  before = now;
  if (changed) {
    changed = false;
    show();
  }
  requestAnimationFrame(frame);
}

function show() {
  const level = Number(element("level").value);
  element("level_shown").value = `${level} × ${level} quads a face`;
  const start = performance.now();
  const pixels = draw(view.yaw, view.pitch, view.distance, level, element("naive").checked);
  const taken = performance.now() - start;
  // The first frame is not counted: the module is still being compiled.
  milliseconds = milliseconds === null ? 0 : milliseconds === 0 ? taken : milliseconds + (taken - milliseconds) * 0.1;
  element("time").value = (milliseconds || taken).toFixed(2);
  picture.putImageData(new ImageData(new Uint8ClampedArray(memory.buffer, pixels, side * side * 4), side), 0, 0);
  showBlocks();
  inspect();
  document.body.dataset.frames = Number(document.body.dataset.frames ?? 0) + 1;
}

function showBlocks() {
  overlay.clearRect(0, 0, side, side);
  if (!element("wireframe").checked) return;
  const count = side / 8;
  const marks = new Uint8Array(memory.buffer, blocks(selected), count * count);
  marks.forEach((mark, i) => {
    if (mark === 0) return;
    overlay.strokeStyle = ["", "#e5484d", "#f5d90a", "#30a46c"][mark];
    overlay.strokeRect((i % count) * 8 + 0.5, Math.floor(i / count) * 8 + 0.5, 7, 7);
  });
}

// What is at the pointer: see `Pick` in lib.rs.
function look() {
  if (!pointer) return null;
  const at = pick(pointer.x, pointer.y);
  const [primitive] = new Int32Array(memory.buffer, at, 1);
  return { primitive, numbers: [...new Float32Array(memory.buffer, at + 4, 10)] };
}

function inspect() {
  const seen = look();
  const is_there = seen !== null && seen.primitive >= 0;
  const [depth, ...numbers] = is_there ? seen.numbers : [];
  element("place").textContent = pointer ? `${pointer.x}, ${pointer.y}` : "–";
  element("primitive").textContent = is_there ? `· triangle ${seen.primitive}` : "";
  element("depth").textContent = is_there ? `· depth ${depth.toFixed(5)}` : "";
  // 1/w is never 0: of a clipped triangle it is not known.
  ["inv_w", "linear", "weight"].flatMap((kind) => [0, 1, 2].map((i) => `${kind}_${i}`)).forEach((id, i) => {
    const is_known = is_there && (i >= 3 || numbers[i] !== 0);
    element(id).textContent = is_known ? numbers[i].toFixed(5) : "–";
  });
}

const pane = element("view");
const place = (event) => ({
  x: Math.floor((event.offsetX * side) / pane.clientWidth),
  y: Math.floor((event.offsetY * side) / pane.clientHeight),
});
let pressed = null;
pane.addEventListener("pointerdown", (event) => {
  pane.setPointerCapture(event.pointerId);
  pressed = place(event);
});
pane.addEventListener("pointermove", (event) => {
  pointer = place(event);
  if (event.buttons & 1) {
    view.yaw += event.movementX * 0.01;
    view.pitch = Math.max(-1.5, Math.min(1.5, view.pitch + event.movementY * 0.01));
    changed = true;
  } else {
    inspect();
  }
});
pane.addEventListener("pointerup", (event) => {
  pointer = place(event);
  const is_click = pressed && Math.hypot(pointer.x - pressed.x, pointer.y - pressed.y) < 3;
  pressed = null;
  if (is_click) {
    selected = look()?.primitive ?? -1;
    document.body.dataset.selected = selected;
    changed = true;
  }
});
pane.addEventListener("pointercancel", () => { pressed = null; });
pane.addEventListener("pointerleave", () => {
  pointer = null;
  inspect();
});
pane.addEventListener("wheel", (event) => {
  event.preventDefault();
  view.distance = Math.max(1.2, Math.min(8, view.distance * Math.exp(event.deltaY * 0.001)));
  changed = true;
}, { passive: false });
for (const id of ["turning", "naive", "wireframe", "level"]) {
  element(id).addEventListener("input", () => { changed = true; });
}
element("level").addEventListener("input", () => { selected = -1; }); // its number means another triangle now

requestAnimationFrame(frame);
