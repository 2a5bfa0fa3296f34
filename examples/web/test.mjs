// node test.mjs DIRECTORY: opens the page that `build` has put there in a headless Chromium, and uses it.
//
// Speaks the DevTools protocol through a pipe, so that it needs no package: messages of JSON, a zero byte after each.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { chownSync, mkdirSync, mkdtempSync, readFile, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { extname, join } from "node:path";

// The picture in the canvas before anybody touches it. The same on every machine: see tests/scene.rs for why.
const FIRST_FRAME = "e2e141ec";

const directory = process.argv[2];
const types = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm" };
const server = createServer((request, response) => {
  const name = new URL(request.url, "http://localhost").pathname.slice(1) || "index.html";
  readFile(join(directory, name), (error, content) => {
    response.writeHead(error ? 404 : 200, { "content-type": types[extname(name)] ?? "text/plain" }).end(content);
  });
});
await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));

// All that the browser leaves, in one directory: its profile, and what it puts where temporary files go.
const scratch = mkdtempSync(join(tmpdir(), "halfplane-page-"));
// Root may not run Chromium with its walls up: then the user `nobody` does.
const nobody = 65534;
const user = process.getuid?.() === 0 ? { uid: nobody, gid: nobody } : {};
if (user.uid) chownSync(scratch, nobody, nobody);
/// Removes it. The browser's helpers outlive it by a moment and may still be writing: then again, for ten seconds at most.
async function discard(tries = 50) {
  try {
    rmSync(scratch, { recursive: true, force: true });
  } catch (error) {
    if (tries === 0) throw error;
    await new Promise((resolve) => setTimeout(resolve, 200));
    await discard(tries - 1);
  }
}
const browser = spawn(process.env.CHROMIUM ?? "chromium", [
  "--headless", "--disable-gpu", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", `--user-data-dir=${join(scratch, "profile")}`, "--remote-debugging-pipe",
  "--window-size=1000,640",
], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"], env: { ...process.env, TMPDIR: scratch, HOME: scratch }, ...user });
browser.once("error", async (error) => {
  await discard();
  throw error;
});
const gone = new Promise((resolve) => browser.once("exit", resolve));
for (const signal of ["SIGINT", "SIGTERM"]) process.once(signal, () => browser.kill());

const pending = new Map();
const complaints = [];
let [number, session, rest] = [0, undefined, ""];
// When the browser goes, so do the questions that it has not answered, and with them the test.
let has_gone = false;
gone.then(() => {
  has_gone = true;
  for (const { reject } of pending.values()) reject(new Error("the browser has gone"));
});
browser.stdio.slice(3).forEach((pipe) => pipe.on("error", () => {}));
browser.stdio[4].setEncoding("utf8").on("data", (chunk) => {
  const messages = (rest + chunk).split("\0");
  rest = messages.pop();
  for (const { id, error, result, method, params } of messages.map((message) => JSON.parse(message))) {
    if (id) {
      const { resolve, reject } = pending.get(id);
      pending.delete(id);
      error ? reject(new Error(error.message)) : resolve(result);
    } else if (method === "Runtime.exceptionThrown") {
      complaints.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    } else if (method === "Runtime.consoleAPICalled" && ["error", "warning", "assert"].includes(params.type)) {
      complaints.push(JSON.stringify(params.args));
    } else if (method === "Log.entryAdded" && params.entry.level === "error") {
      complaints.push(`${params.entry.text} ${params.entry.url ?? ""}`);
    }
  }
});

function send(method, params = {}) {
  if (has_gone) return Promise.reject(new Error("the browser has gone"));
  number += 1;
  browser.stdio[3].write(`${JSON.stringify({ id: number, method, params, sessionId: session })}\0`);
  return new Promise((resolve, reject) => pending.set(number, { resolve, reject }));
}

async function evaluate(expression) {
  const { result, exceptionDetails } = await send("Runtime.evaluate", { expression, returnByValue: true });
  assert.equal(exceptionDetails, undefined, exceptionDetails?.exception?.description);
  return result.value;
}

async function until(expression, what) {
  for (let i = 0; i < 600; i += 1) {
    if (await evaluate(expression)) return;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  assert.fail(`${what}: ${complaints.join("\n")}`);
}

/// FNV-1a over the canvas' pixels.
const hash = () => evaluate(`(() => {
  const canvas = document.getElementById("picture");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let hash = 0x811c9dc5;
  for (const byte of data) hash = Math.imul(hash ^ byte, 0x01000193);
  return (hash >>> 0).toString(16).padStart(8, "0");
})()`);

const pictures = process.env.SCREENSHOTS; // a directory, for whoever wants to look
if (pictures) mkdirSync(pictures, { recursive: true });
async function picture(name) {
  if (!pictures) return;
  const { data } = await send("Page.captureScreenshot");
  writeFileSync(join(pictures, `${name}.png`), Buffer.from(data, "base64"));
}

const text = (id) => evaluate(`document.getElementById("${id}").textContent`);
const mouse = (type, x, y, more = {}) => send("Input.dispatchMouseEvent", { type, x, y, ...more });

/// Does something that draws a frame, and waits for that frame.
async function draws(what, action) {
  const frames = await evaluate("Number(document.body.dataset.frames)");
  await action();
  await until(`Number(document.body.dataset.frames) > ${frames}`, `${what} draws nothing`);
}

try {
  const { targetId } = await send("Target.createTarget", { url: "about:blank" });
  ({ sessionId: session } = await send("Target.attachToTarget", { targetId, flatten: true }));
  await Promise.all(["Runtime.enable", "Log.enable", "Page.enable"].map((method) => send(method)));

  // It loads, draws, and the first frame is the one that everybody gets.
  await send("Page.navigate", { url: `http://127.0.0.1:${server.address().port}/index.html?still` });
  await until(`document.readyState === "complete" && document.body?.dataset.frames`, "the page does not load");
  const first = await hash();
  const { left, top } = await evaluate(`(({ left, top }) => ({ left, top }))(
    document.getElementById("view").getBoundingClientRect())`);
  const [x, y] = [left + 240, top + 240];

  // The pixel inspector.
  await mouse("mouseMoved", x, y);
  await until(`document.getElementById("weight_0").textContent !== "–"`, "nothing is seen under the pointer");
  const row = async (kind) => (await Promise.all([0, 1, 2].map((i) => text(`${kind}_${i}`)))).map(Number);
  const [linear, inv_w, weights] = [await row("linear"), await row("inv_w"), await row("weight")];
  const sum = (numbers) => numbers.reduce((a, b) => a + b);
  const close = (a, b, what) => assert.ok(Math.abs(a - b) < 5e-5, `${what}: ${a}, not ${b}`);
  close(sum(linear), 1, `barycentrics ${linear}`);
  close(sum(weights), 1, `weights ${weights}`);
  const parts = linear.map((number, i) => number * inv_w[i]);
  weights.forEach((weight, i) => close(weight, parts[i] / sum(parts), `weight ${i}, by its formula`));
  assert.ok(Math.abs(linear[0] - weights[0]) > 1e-3, "perspective makes a difference");

  // A click selects a triangle; its blocks are of all three kinds.
  await draws("the box", () => evaluate(`document.getElementById("wireframe").click()`));
  await draws("a click", async () => {
    await mouse("mousePressed", x, y, { button: "left", buttons: 1, clickCount: 1 });
    await mouse("mouseReleased", x, y, { button: "left", buttons: 0, clickCount: 1 });
  });
  assert.ok(await evaluate("Number(document.body.dataset.selected) >= 0"), "a click selects a triangle");
  const colors = await evaluate(`(() => {
    const canvas = document.getElementById("overlay");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const opaque = new Set();
    for (let i = 0; i < data.length; i += 4) if (data[i + 3] === 255) opaque.add(data.slice(i, i + 3).join());
    return opaque.size;
  })()`);
  assert.equal(colors, 3, "rejected, partial and accepted blocks");
  assert.equal(await hash(), first, "looking changes nothing");
  await picture("blocks");

  // Everything else changes the picture.
  const seen = new Set([first]);
  const changes = async (what, action) => {
    await draws(what, action);
    const now = await hash();
    assert.ok(!seen.has(now), `${what} changes nothing`);
    seen.add(now);
  };
  await changes("a drag", async () => {
    await mouse("mousePressed", x, y, { button: "left", buttons: 1, clickCount: 1 });
    await mouse("mouseMoved", x + 40, y + 20, { button: "left", buttons: 1 });
    await mouse("mouseReleased", x + 40, y + 20, { button: "left", buttons: 0, clickCount: 1 });
  });
  await changes("the wheel", () => mouse("mouseWheel", x, y, { deltaX: 0, deltaY: -240 }));
  await picture("closer");
  await changes("naive", () => evaluate(`document.getElementById("naive").click()`));
  await picture("naive");
  await changes("the slider", () => evaluate(`(() => {
    const level = document.getElementById("level");
    level.value = 9;
    level.dispatchEvent(new Event("input"));
  })()`));
  await picture("slider");
  await changes("turning", () => evaluate(`document.getElementById("turning").click()`));

  // A telephone's width: nothing sticks out, and the pointer still finds its pixel.
  await evaluate(`document.getElementById("turning").click()`);
  const metrics = { width: 360, height: 760, deviceScaleFactor: 1, mobile: false };
  await send("Emulation.setDeviceMetricsOverride", metrics);
  await until("innerWidth === 360", "the window does not shrink");
  assert.ok(await evaluate("document.documentElement.scrollWidth <= 360"), "the page is wider than its window");
  const small = await evaluate(`(({ left, top, width, height }) => ({ left, top, width, height }))(
    document.getElementById("view").getBoundingClientRect())`);
  assert.equal(small.width, small.height, "the picture is still square");
  await mouse("mouseMoved", small.left + small.width / 4, small.top + small.height / 2);
  await until(`/^1(19|20|21), 2(39|40|41)$/.test(document.getElementById("place").textContent)`,
    `a quarter and a half of ${small.width} pixels are not 120, 240`);
  await picture("small");

  assert.deepEqual(complaints, [], "the console is silent");
  assert.equal(first, FIRST_FRAME, "the first frame is another one");
  const milliseconds = await evaluate(`document.getElementById("time").value`);
  console.log(`first frame ${first}; drag, wheel, click, slider and boxes work; ${milliseconds} ms a frame`);
} finally {
  browser.kill();
  await gone;
  server.close();
  await discard();
}
