// The list of sessions, asked for once a second while the page is in sight.

const list = document.getElementById("sessions");
const summary = document.getElementById("summary");
const empty = document.getElementById("empty");
const number = new Intl.NumberFormat("en");

function element(tag, className, text) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
}

function figure(value, unit) {
  const cell = element("span", "figure", number.format(Number(value ?? 0)));
  cell.append(element("small", "", unit));
  return cell;
}

function row(session) {
  const id = session.name.replace(/^sessions\//, "");
  const state = (session.state ?? "").replace(/^SESSION_STATE_/, "").toLowerCase();
  const link = element("a");
  link.href = `/sessions/${encodeURIComponent(id)}`;
  const title = element("strong", "", session.title || id);
  title.append(element("small", "", id));
  link.append(
    title,
    element("span", `state ${state}`, state),
    figure(session.step, "steps"),
    figure(session.pointCount, "points"),
    figure(session.vertexCount, "vertices"),
  );
  const item = element("li");
  item.append(link);
  return item;
}

function show({ sessions = [] }) {
  const focused = document.activeElement?.href;
  list.replaceChildren(...sessions.map(row));
  for (const link of list.querySelectorAll("a")) if (link.href === focused) link.focus();
  empty.hidden = sessions.length > 0;
  summary.textContent = sessions.length === 1 ? "1 session" : `${sessions.length} sessions`;
}

async function refresh() {
  try {
    const answer = await fetch("/api/sessions");
    if (!answer.ok) throw new Error(`${answer.status} ${answer.statusText}`);
    show(await answer.json());
  } catch (error) {
    summary.textContent = `The server does not answer (${error.message}). Trying again…`;
  }
}

for (;;) {
  if (!document.hidden) await refresh();
  await new Promise((resume) => setTimeout(resume, 1000));
}
