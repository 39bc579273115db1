// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Connects the parts: data, drawing, and controls.
import { Camera } from "/camera.js";
import { listen } from "/controls.js";
import { Feed } from "/feed.js";
import { Gpu } from "/gpu.js";
import { kLayers, paletteOf } from "/layers.js";
import { drawLegend, element, makeLayers, showLayer } from "/legend.js";
import { showNode } from "/panels.js";
import { outline, pick, showVoxel } from "/pick.js";
import { Store } from "/store.js";
import { lines, showRobots } from "/tracks.js";

const kStill_ms = 160; // After this time without a move the complete picture is drawn.
const kSmooth_ms = 42; // A frame that takes longer shows fewer voxels while it moves.
const kAtOnce = 250000; // Voxels of a picture when it begins to move.
const kWhileComing = 60000; // Voxels of a picture while the map is loading.
const kAgain_ms = 1000; // Between two requests of the selected voxel, which may change.
const kBusy_ms = 300;
const kMostEvery = 12; // A vertex's stride is 255 bytes at most.

const canvas = document.getElementById("canvas");
const camera = new Camera();
const store = new Store();
const gpu = Gpu.make(canvas);
const state = { layer: "class", chosen: false, origin: [0, 0, 0], picked: null, robots: [], touched: false, asked: false, moved_ms: -1e9, drawn_ms: 0, shown_ms: 0, cost_ms: 0, later: 0, every: 1, frame_ms: 0, last_ms: 0, smooth: false };
const text = (id, words) => (document.getElementById(id).textContent = words);
const map = () => feed.maps[feed.chosen];

function say(words) {
  const notice = document.getElementById("notice");
  notice.hidden = words === "";
  notice.textContent = words;
}

function request() {
  if (state.asked || !gpu) return;
  state.asked = true;
  requestAnimationFrame(draw);
}

/// For updates without a user: pictures take at most a third of the time, so that the node gets the rest.
function requestLater() {
  if (state.later) return;
  const rest_ms = Math.min(3000, 2 * state.cost_ms - (performance.now() - state.drawn_ms));
  state.later = setTimeout(() => {
    state.later = 0;
    request();
  }, Math.max(0, rest_ms));
}

/// Adapts the number of drawn voxels while the picture moves, so that it moves smoothly.
function adapt(now_ms) {
  const took = now_ms - state.last_ms;
  if (!state.smooth) state.every = Math.max(state.every, Math.min(kMostEvery, Math.ceil(store.voxels / kAtOnce)));
  if (state.smooth && took > kSmooth_ms && state.every < kMostEvery) state.every = Math.min(kMostEvery, state.every + 1 + (took > 2 * kSmooth_ms ? 2 : 0));
  if (state.smooth && took < kSmooth_ms / 2.2 && state.every > 1) --state.every;
}

function draw(now_ms) {
  state.asked = false;
  if (feed.maps.length === 0 || gpu.gl.isContextLost()) return;
  // A move since the last frame counts, even if that took long.
  const moving = state.moved_ms > state.drawn_ms || performance.now() - state.moved_ms < kStill_ms;
  state.drawn_ms = performance.now();
  if (moving) adapt(now_ms);
  state.last_ms = now_ms;
  const began_ms = performance.now();
  state.smooth = moving;
  gpu.resize();
  gpu.upload(store);
  const near = camera.target.map((v) => Math.round(v));
  state.origin = near;
  const shapes = lines(map(), state.robots, near);
  if (state.picked) shapes.push(...outline(state.picked, near, dark() ? [1, 1, 1] : [0, 0, 0]));
  // Loading must not wait for pictures of a part of the map.
  const coming = canvas.dataset.complete !== "true";
  const every = moving ? state.every : coming ? Math.min(kMostEvery, Math.ceil(store.voxels / kWhileComing)) : 1;
  gpu.draw({ store, camera, origin: near, lines: new Float32Array(shapes), layer: kLayers.findIndex((l) => l.name === state.layer), every: Math.max(1, every), cubes: !moving && !coming });
  canvas.dataset.frames = String(Number(canvas.dataset.frames ?? 0) + 1);
  canvas.dataset.drawn = moving ? "moving" : coming ? "coming" : "still";
  if (store.voxels > 0) mark("first-picture");
  if (store.voxels > 0 && canvas.dataset.complete === "true" && !moving) mark("whole-picture");
  // Includes the time until it is on the screen: the next frame comes no sooner.
  requestAnimationFrame(() => (state.cost_ms = performance.now() - began_ms));
  if (moving) setTimeout(request, Math.max(0, kStill_ms - (performance.now() - state.moved_ms)));
}

/// Sets each mark once, for measurements: the next frame has it on the screen.
function mark(name) {
  if (performance.getEntriesByName(name).length > 0 || state[name]) return;
  state[name] = true;
  requestAnimationFrame(() => setTimeout(() => performance.mark(name)));
}

const dark = () => matchMedia("(prefers-color-scheme: dark)").matches;
function theme() {
  if (gpu) gpu.background = dark() ? [0.055, 0.066, 0.082] : [0.925, 0.937, 0.949];
  request();
}

function fit() {
  const box = store.box();
  if (box) camera.fit(box.low, box.high, canvas.clientWidth / Math.max(1, canvas.clientHeight));
  request();
}

function setLayer(name) {
  state.layer = name;
  showLayer(name, map());
  drawLegend(name, map(), store);
  remember();
  request();
}

function chooseLayer(name) {
  state.chosen = true;
  setLayer(name);
}

function remember() {
  history.replaceState(null, "", `#map=${feed.chosen}&layer=${state.layer}`);
}

function clearPick() {
  state.picked = null;
  showVoxel(map(), null);
  request();
}

/// again: it is already shown, and may have changed. Screen readers announce what the user picked, not changes.
async function showPicked(voxel, again = false) {
  if (!again) showVoxel(map(), null);
  state.picked = voxel;
  state.shown_ms = performance.now();
  request();
  const at = map();
  const [x, y, z] = voxel.map((v) => (v + 0.5) * at.resolution_m);
  try {
    const reply = await fetch(`/voxel?map=${feed.chosen}&x=${x}&y=${y}&z=${z}`);
    const told = reply.ok ? await reply.json() : null;
    if (state.picked !== voxel || at !== map()) return;
    // The voxel was being changed.
    if (!told) return void setTimeout(() => state.picked === voxel && showPicked(voxel, again), kBusy_ms);
    document.getElementById("voxel").setAttribute("aria-live", again ? "off" : "polite");
    showVoxel(at, told);
    if (!again) document.getElementById("voxel-panel").scrollIntoView({ block: "nearest" });
  } catch {
    // The feed shows the state of the connection.
  }
}

function pickAt(x, y) {
  const found = pick(store, camera, x, y, canvas.clientWidth, canvas.clientHeight, state.layer === "moved");
  if (!found) return clearPick();
  document.getElementById("voxel-panel").open = true;
  return showPicked(found);
}

function showMaps(maps) {
  const select = document.getElementById("map-select");
  select.replaceChildren(...maps.map((m, i) => element("option", { value: String(i) }, m.live ? m.name : `${m.kind}: ${m.name}`)));
  select.value = String(feed.chosen);
  select.closest("label").classList.toggle("single", maps.length < 2);
  begin();
}

/// Starts to show a map.
function begin() {
  state.touched = false;
  canvas.dataset.complete = "false";
  gpu?.setPalette(paletteOf(map()));
  clearPick();
  setLayer(state.layer);
  showRobots(map(), state.robots);
}

const feed = new Feed(store, {
  maps: showMaps,
  blocks(complete) {
    if (!state.touched) fit();
    if (complete) {
      canvas.dataset.complete = "true";
      // One grey tells nothing.
      if (!state.chosen && state.layer === "class" && store.voxels > 0 && store.labels[0] === store.voxels) setLayer("height");
    }
    text("voxel-count", `${store.voxels.toLocaleString("en").replace(/,/g, "\u202f")} voxels${complete || canvas.dataset.complete === "true" ? "" : " …"}`);
    canvas.dataset.voxels = String(store.voxels);
    canvas.dataset.received = String(store.received);
    drawLegend(state.layer, map(), store);
    if (state.picked && map().live && performance.now() - state.shown_ms > kAgain_ms) showPicked(state.picked, true);
    say(complete && store.voxels === 0 ? (map().live ? "This map is still empty." : "No voxel of this map is occupied.") : "");
    if (map().live) requestLater();
    else request();
  },
  status(told) {
    state.robots = told.robots ?? [];
    showRobots(map(), state.robots);
    showNode(told);
    requestLater();
  },
  state(word) {
    document.getElementById("connection").dataset.state = word;
    text("connection-text", { live: "live", file: "file", lost: "reconnecting" }[word]);
  },
});

function start() {
  const asked = new URLSearchParams(location.hash.slice(1));
  if (kLayers.some((l) => l.name === asked.get("layer"))) [state.layer, state.chosen] = [asked.get("layer"), true];
  feed.chosen = Math.max(0, Number.parseInt(asked.get("map") ?? "0", 10) || 0);
  makeLayers(chooseLayer);
  document.getElementById("map-select").addEventListener("change", (event) => {
    feed.choose(Number(event.target.value));
    begin();
  });
  const moved = () => {
    state.touched = true;
    state.moved_ms = performance.now();
    request();
  };
  const top = () => {
    camera.pitch = Math.PI / 2 - 1e-3;
    camera.yaw = -Math.PI / 2;
    fit();
  };
  listen(canvas, camera, { moved, pick: pickAt, clear: clearPick, fit, top, layer: (i) => chooseLayer(kLayers[i].name) });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", theme);
  new ResizeObserver(request).observe(canvas);
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => location.reload());
  theme();
  if (!gpu) return say("This browser has no WebGL 2, so the map cannot be drawn.");
  return feed.run();
}

start();
