// The camera's page: it shows what the stream says of each picture, and sends actions back. No library, no build.
"use strict";

const SVG = "http://www.w3.org/2000/svg";
let bestBlur = null, steepest = 0, exposure = null, shownFile = "";

function drawn(name, attributes) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

// The next picture is asked for when the last one has come, so that a slow link is not flooded.
function load(image, address) {
  if (image.dataset.busy) return;
  image.dataset.busy = "1";
  image.onload = image.onerror = () => delete image.dataset.busy;
  image.src = address;
  image.hidden = false;
}

function showPicture(seen) {
  const [width, height] = seen.size;
  load(byId("picture"), `/picture.jpg?n=${seen.number}`);
  load(byId("mark"), `/mark.png?n=${seen.number}`);
  byId("marks").setAttribute("viewBox", `0 0 ${width} ${height}`);
  const outlines = seen.marks.map((one) => {
    const points = [0, 2, 4, 6].map((at) => `${one[at] + 0.5},${one[at + 1] + 0.5}`).join(" ");
    return drawn("polygon", { points });
  });
  byId("marks").replaceChildren(...outlines);
}

function showFocus(seen) {
  steepest = Math.max(steepest, seen.steepness);
  if (seen.blur_px !== null) bestBlur = bestBlur === null ? seen.blur_px : Math.min(bestBlur, seen.blur_px);
  byId("blur").textContent = seen.blur_px === null ? "no mark to measure by" : `blur ${seen.blur_px.toFixed(2)} px`;
  byId("best").textContent = bestBlur === null ? "–" : `${bestBlur.toFixed(2)} px`;
  const share = steepest ? seen.steepness / steepest : 0;
  byId("steep").value = share;
  byId("share").textContent = `${(100 * share).toFixed(0)} %`;
}

function showLight(light) {
  byId("advice").textContent = light.advice;
  byId("white").textContent = `${light.white.toFixed(0)} of 255`;
  byId("ends").textContent = `${(100 * light.saturated).toFixed(1)} %, ${(100 * light.black).toFixed(1)} %`;
  byId("path").textContent = `${light.path_px.toFixed(1)} px at 0.1 m/s`;
  const wide = 256 / light.histogram.length, top = Math.max(...light.histogram.slice(1, -1), 0.02);
  const bars = light.histogram.map((share, place) => {
    const height = 80 * Math.min(share / top, 1), end = place === light.histogram.length - 1 && light.overexposed;
    return drawn("rect", { x: place * wide, y: 84 - height, width: wide - 1, height, class: end ? "end" : "" });
  });
  byId("histogram").replaceChildren(...bars);
}

function showCalibration(now) {
  const result = byId("result");
  result.className = now.refused ? "bad" : "";
  result.textContent = now.busy ? "Calibrating: leave plate and block alone …" : now.refused;
  if (now.file && !now.busy) {
    const link = document.createElement("a");
    link.href = "/calibration.toml";
    link.download = link.textContent = now.file;
    result.replaceChildren("Calibrated. Put ", link, ` beside the rig file, and calibration = "${now.file}" under [camera] in it.`);
  }
  byId("notes").textContent = now.busy ? "" : now.notes;
  const shown = now.busy ? "" : now.file && now.notes;
  byId("drawn").hidden = !shown;
  if (shown && shown !== shownFile) byId("drawn").src = `/calibration.png?t=${Date.now()}`;
  shownFile = shown;
  byId("boards").textContent = now.boards;
  byId("start").disabled = byId("board").disabled = now.busy;
}

function beginAnew() {
  bestBlur = null;
  steepest = 0;
}

function take(now) {
  byId("rig").textContent = `of rig “${now.rig}”`;
  byId("camera").textContent = now.camera;
  if (now.exposure_ms !== exposure) {
    if (exposure === null || document.activeElement !== byId("exposure")) byId("exposure").value = now.exposure_ms;
    exposure = now.exposure_ms;
    beginAnew();
  }
  const tried = now.exposure_ms !== now.rig_exposure_ms;
  byId("keep").textContent = tried
    ? `The rig file says ${now.rig_exposure_ms} ms. To keep this one, put exposure_ms = ${now.exposure_ms} under [camera] in it.`
    : "As the rig file says.";
  showCalibration(now);
  const fault = now.busy ? "" : now.fault || (now.seen ? now.seen.fault : "Waiting for the first picture.");
  byId("fault").className = fault || !now.seen ? "" : "well";
  byId("fault").textContent = fault || (now.seen && now.seen.mark ? `The mark is found, and ${now.seen.fiducials} of the plate's fiducials.` : "");
  if (now.seen === null || now.busy) return;
  showPicture(now.seen);
  showFocus(now.seen);
  showLight(now.seen.light);
}

byId("anew").addEventListener("click", beginAnew);
byId("expose").addEventListener("submit", (event) => {
  event.preventDefault();
  act("expose", { exposure_ms: byId("exposure").valueAsNumber });
});
byId("board").addEventListener("click", () => act("board"));
byId("calibrate").addEventListener("submit", (event) => {
  event.preventDefault();
  act("calibrate", { lens: byId("lens").checked });
});
follow({ state: take });
