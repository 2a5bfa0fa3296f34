// node test.mjs DIRECTORY: opens the page that `build` has put there in a headless Chromium, and uses it.
//
// Speaks the DevTools protocol through a pipe, so that it needs no package: messages of JSON, a zero byte after each.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtempSync, readFile, rmSync, writeFileSync } from "node:fs";
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

const profile = mkdtempSync(join(tmpdir(), "halfplane-page-"));
const browser = spawn(process.env.CHROMIUM ?? "chromium", [
  "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", `--user-data-dir=${profile}`, "--remote-debugging-pipe",
  "--window-size=1000,640",
], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });

const pending = new Map();
const complaints = [];
let [number, session, rest] = [0, undefined, ""];
browser.stdio[4].setEncoding("utf8").on("data", (chunk) => {
  const messages = (rest + chunk).split("\0");
  rest = messages.pop();
  for (const { id, error, result, method, params } of messages.map((message) => JSON.parse(message))) {
    if (id) {
      const { resolve, reject } = pending.get(id);
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
  for (const kind of ["linear", "weight"]) {
    const numbers = await Promise.all([0, 1, 2].map((i) => text(`${kind}_${i}`)));
    const sum = numbers.map(Number).reduce((a, b) => a + b);
    assert.ok(Math.abs(sum - 1) < 3e-5, `${kind}: ${numbers} sum to ${sum}`);
  }
  assert.notEqual(await text("linear_0"), await text("weight_0"), "perspective makes a difference");

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
  if (process.env.SCREENSHOT) {
    const { data } = await send("Page.captureScreenshot");
    writeFileSync(process.env.SCREENSHOT, Buffer.from(data, "base64"));
  }

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
  await changes("naive", () => evaluate(`document.getElementById("naive").click()`));
  await changes("the slider", () => evaluate(`(() => {
    const level = document.getElementById("level");
    level.value = 9;
    level.dispatchEvent(new Event("input"));
  })()`));
  await changes("turning", () => evaluate(`document.getElementById("turning").click()`));

  assert.deepEqual(complaints, [], "the console is silent");
  assert.equal(first, FIRST_FRAME, "the first frame is another one");
  const milliseconds = await evaluate(`document.getElementById("time").value`);
  console.log(`first frame ${first}; drag, wheel, click, slider and boxes work; ${milliseconds} ms a frame`);
} finally {
  const gone = new Promise((resolve) => browser.once("exit", resolve));
  browser.kill();
  await gone;
  server.close();
  rmSync(profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
}
