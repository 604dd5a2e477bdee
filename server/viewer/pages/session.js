// One session: its live view by Rerun's viewer for browsers, and a line of figures above it.

const VIEWER = "/viewer/0.36.3";
const id = decodeURIComponent(location.pathname.split("/")[2] ?? "");
const feed = `rerun+${location.origin}/proxy`;
const by = (name) => document.getElementById(name);
const number = new Intl.NumberFormat("en");

by("title").textContent = id;
by("native").textContent = `rerun ${feed}`;
document.title = `${id} · Sinew`;

function say(headline, detail = "") {
  by("message").hidden = false;
  by("headline").textContent = headline;
  by("detail").textContent = detail;
  by("progress").hidden = true;
}

function canDraw() {
  return "gpu" in navigator || document.createElement("canvas").getContext("webgl2") !== null;
}

function load(script) {
  return new Promise((resolve, reject) => {
    const element = document.createElement("script");
    element.src = script;
    element.onload = resolve;
    element.onerror = () => reject(new Error("This server was built without the viewer for browsers"));
    document.head.append(element);
  });
}

// The length that is announced is the compressed one, so the bar moves by what a whole viewer usually holds.
function counted(response) {
  const whole = 41_735_188;
  let loaded = 0;
  const count = new TransformStream({
    transform(chunk, controller) {
      loaded += chunk.byteLength;
      by("progress").value = Math.min(loaded / whole, 1);
      controller.enqueue(chunk);
    },
  });
  const headers = { "content-type": "application/wasm" };
  return new Response(response.body.pipeThrough(count), { headers });
}

async function start() {
  if (typeof WebAssembly !== "object") throw new Error("This browser has no WebAssembly");
  if (!canDraw()) throw new Error("This browser offers neither WebGL 2 nor WebGPU; turn on its hardware acceleration");
  await load(`${VIEWER}/viewer.js`);
  const wasm = await fetch(`${VIEWER}/viewer.wasm`);
  if (!wasm.ok) throw new Error(`The viewer cannot be loaded: ${wasm.status} ${wasm.statusText}`);
  await wasm_bindgen({ module_or_path: counted(wasm) });
  say("Starting the viewer…");
  const handle = new wasm_bindgen.WebHandle({
    url: [feed],
    render_backend: new URLSearchParams(location.search).get("renderer"),
    hide_welcome_screen: true,
    panel_state_overrides: { top: "Hidden", blueprint: "Hidden", selection: "Hidden", time: "Collapsed" },
    enable_history: false,
    persist: false,
  });
  await handle.start(by("view"));
  by("message").hidden = true;
  by("view").focus();
  watch(handle);
}

function watch(handle) {
  const timer = setInterval(() => {
    if (!handle.has_panicked()) return;
    clearInterval(timer);
    say("The viewer has stopped", `${handle.panic_message()}. Reload the page to try again.`);
  }, 1000);
}

async function refresh() {
  const answer = await fetch("/api/sessions").catch(() => undefined);
  if (!answer?.ok) return;
  const { sessions = [] } = await answer.json();
  const session = sessions.find(({ name }) => name === `sessions/${id}`);
  const state = session ? (session.state ?? "").replace(/^SESSION_STATE_/, "").toLowerCase() : "not open";
  by("state").textContent = state;
  by("state").className = `state ${state}`;
  if (!session) return;
  by("title").textContent = session.title || id;
  document.title = `${session.title || id} · Sinew`;
  const count = (value) => number.format(Number(value ?? 0));
  by("figures").textContent =
    `step ${count(session.step)} · ${count(session.pointCount)} points · ${count(session.vertexCount)} vertices`;
}

async function keepRefreshing() {
  for (;;) {
    if (!document.hidden) await refresh();
    await new Promise((resume) => setTimeout(resume, 1000));
  }
}

keepRefreshing();
start().catch((error) => {
  const native = by("native").textContent;
  say("The session cannot be shown here", `${error.message ?? error}. A viewer outside of the browser can: ${native}`);
});
