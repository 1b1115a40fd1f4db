// What every page does: it finds its parts, says sentences, sends actions, and follows the stream. No library, no build.
"use strict";

const byId = (id) => document.getElementById(id);
const token = document.querySelector("meta[name=repose-token]").content;
const { who, command } = document.body.dataset; // who answers, and by which command

function say(sentence) {
  byId("said").textContent = sentence;
  byId("said").hidden = !sentence;
}

async function act(name, asked = {}) {
  say("");
  try {
    const answer = await fetch(`/do/${name}`, {
      method: "POST",
      headers: { "Content-Type": "application/json", "X-Repose-Token": token },
      body: JSON.stringify(asked),
    });
    if (!answer.ok) say(await answer.text());
    return answer.ok;
  } catch {
    say(`${who} did not answer: is \`${command}\` running?`);
    return false;
  }
}

// `takes` has a function for each event's name; a stream that opens tells everything from the beginning.
function follow(takes, opened = () => {}) {
  const stream = new EventSource("/events");
  const link = byId("link");
  stream.onopen = () => {
    link.textContent = "connected";
    link.className = "";
    opened();
  };
  stream.onerror = () => {
    link.className = "lost";
    link.textContent = `${who} does not answer; what is shown is old. Trying again …`;
    if (stream.readyState === EventSource.CLOSED) setTimeout(() => enter(takes, opened), 2000);
  };
  for (const [name, take] of Object.entries(takes)) {
    stream.addEventListener(name, (event) => take(JSON.parse(event.data)));
  }
}

// What was started again has another key, unless it keeps one in a file: then the page must be loaded anew.
async function enter(takes, opened) {
  const answer = await fetch("/base.css").catch(() => null);
  if (answer && answer.status === 403) {
    byId("link").textContent = `This page's key is old: open the link that \`${command}\` has printed last.`;
  }
  follow(takes, opened);
}
