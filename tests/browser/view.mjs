// Opens a session's page in Chromium without a display, and sees the mesh drawn and moving.
//
//   node view.mjs http://127.0.0.1:PORT/sessions/ID [FOLDER]
//
// Writes FOLDER/first.png and FOLDER/second.png (default: the current folder). CHROMIUM names the browser
// (default: /usr/bin/chromium). The exit code is zero if the mesh was drawn and moved, and the page broke no rule of its
// content security policy while doing so.

import { mkdir, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { chromium } from "playwright-core";

const PATIENCE_MS = 120_000; // software rendering on a busy machine
const { positionals } = parseArgs({ allowPositionals: true });
const [address, folder = "."] = positionals;
if (!address) {
  console.error("usage: node view.mjs ADDRESS [FOLDER]");
  process.exit(2);
}

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
});

/** Pixels of a screenshot as RGBA, decoded by the browser itself on a page that has no policy. */
async function pixels(scratch, png) {
  return scratch.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    // The middle of the 3D view: no panel, plot or label changes there.
    const [x, y, w, h] = [0.1, 0.15, 0.5, 0.6].map((share, i) => Math.round(share * (i % 2 ? image.height : image.width)));
    return Array.from(context.getImageData(x, y, w, h).data);
  }, png.toString("base64"));
}

/** Share of pixels with a clear colour of their own: the empty scene is grey, the mesh is not. */
function coloured(rgba) {
  let count = 0;
  for (let i = 0; i < rgba.length; i += 4) {
    const [r, g, b] = [rgba[i], rgba[i + 1], rgba[i + 2]];
    if (Math.max(r, g, b) - Math.min(r, g, b) > 40) count += 1;
  }
  return (4 * count) / rgba.length;
}

/** Share of pixels that differ clearly. */
function changed(before, after) {
  let count = 0;
  for (let i = 0; i < before.length; i += 4) {
    const difference = [0, 1, 2].map((c) => Math.abs(before[i + c] - after[i + c]));
    if (Math.max(...difference) > 24) count += 1;
  }
  return (4 * count) / before.length;
}

async function until(what, look) {
  const end = Date.now() + PATIENCE_MS;
  for (;;) {
    const found = await look();
    if (found) return found;
    if (Date.now() > end) throw new Error(`not within ${PATIENCE_MS / 1000} s: ${what}`);
    await new Promise((resume) => setTimeout(resume, 250));
  }
}

async function run() {
  const page = await browser.newPage({ viewport: { width: 1100, height: 700 }, colorScheme: "dark" });
  const scratch = await browser.newPage();
  const refused = [];
  page.on("console", (message) => {
    const text = message.text();
    // The viewer asks its makers' servers for things; the policy is there to refuse just that.
    if (/Content Security Policy/.test(text) && !/connect/i.test(text)) refused.push(text);
    if (process.env.VERBOSE) console.log(`[${message.type()}] ${text}`);
  });
  const url = new URL(address);
  url.searchParams.set("renderer", "webgl");
  await page.goto(url.href);

  // Not page.screenshot(), which waits for a pause between frames that a slow renderer never makes.
  const devtools = await page.context().newCDPSession(page);
  const capture = async () => {
    const { data } = await devtools.send("Page.captureScreenshot", { format: "png" });
    return Buffer.from(data, "base64");
  };
  // Undefined where a busy machine makes no frame in the browser's time for one: `until` asks again.
  const shoot = async () => {
    const png = await capture().catch(() => undefined);
    return png && { png, rgba: await pixels(scratch, png) };
  };
  await page.bringToFront();
  const first = await until("the mesh is drawn", async () => {
    const shot = await shoot();
    return shot && coloured(shot.rgba) > 0.01 ? shot : undefined;
  }).catch(async (error) => {
    await capture().then((png) => writeFile(join(folder, "failed.png"), png)).catch(() => {});
    throw error;
  });
  const second = await until("the mesh moves", async () => {
    const shot = await shoot();
    return shot && changed(first.rgba, shot.rgba) > 0.01 ? shot : undefined;
  });
  await writeFile(join(folder, "first.png"), first.png);
  await writeFile(join(folder, "second.png"), second.png);
  if (refused.length > 0) throw new Error(`the page breaks its own policy:\n${refused.join("\n")}`);
  const percent = (share) => `${(100 * share).toFixed(1)} %`;
  console.log(`drawn: ${percent(coloured(first.rgba))} of the view; moved: ${percent(changed(first.rgba, second.rgba))}`);
}

await mkdir(folder, { recursive: true });
try {
  await run();
} catch (error) {
  console.error(`failed: ${error.message}`);
  process.exitCode = 1;
} finally {
  await browser.close();
}
