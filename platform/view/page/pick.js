// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Finds the first voxel on a ray, and shows its values.
import { kMovedFlag, kNoLabel } from "/layers.js";
import { element } from "/legend.js";

const kWords = 5;

/// Distance along a ray to a cube; Infinity if it misses. low: its corner, edge: its length.
function enters(ray, x, y, z, edge) {
  const low = [x, y, z];
  let first = 0;
  let last = Infinity;
  for (let i = 0; i < 3; ++i) {
    const a = (low[i] - ray.from[i]) / ray.direction[i];
    const b = (low[i] + edge - ray.from[i]) / ray.direction[i];
    first = Math.max(first, Math.min(a, b));
    last = Math.min(last, Math.max(a, b));
  }
  return first <= last ? first : Infinity;
}

/// The first voxel on the ray of x, y (-1 .. 1, y up), or of some pixels next to it, as fingers are wide. Its three numbers,
/// or null. moved: those that moved are seen too.
export function pick(store, camera, x, y, width, height, moved) {
  for (const pixels of [0, 3, 6, 10]) {
    for (let turn = 0; turn < (pixels === 0 ? 1 : 8); ++turn) {
      const [dx, dy] = [pixels * Math.cos((turn * Math.PI) / 4), pixels * Math.sin((turn * Math.PI) / 4)];
      const found = first(store, camera.ray(x + (2 * dx) / width, y + (2 * dy) / height, width / height), moved);
      if (found) return found;
    }
  }
  return null;
}

function first(store, ray, moved) {
  const met = [];
  for (const block of store.blocks.values()) {
    const t = enters(ray, 8 * block.x, 8 * block.y, 8 * block.z, 8);
    if (t < Infinity) met.push([t, block]);
  }
  met.sort((a, b) => a[0] - b[0]);
  let best = Infinity;
  let found = null;
  for (const [t, block] of met) {
    if (t > best) break;
    for (let i = 0; i < block.count; ++i) {
      const at = (block.first + i) * kWords;
      if (!moved && (store.words[at + 4] & kMovedFlag) !== 0) continue;
      const voxel = [store.words[at], store.words[at + 1], store.words[at + 2]];
      const here = enters(ray, ...voxel, 1);
      if (here < best) [best, found] = [here, voxel];
    }
  }
  return found;
}

/// The edges of a cube as lines, a little larger than it.
export function outline(voxel, origin, color) {
  const out = [];
  const corner = (bits, axis) => voxel[axis] - origin[axis] + ((bits >> axis) & 1 ? 1.04 : -0.04);
  for (let bits = 0; bits < 8; ++bits) {
    for (let axis = 0; axis < 3; ++axis) {
      const other = bits | (1 << axis);
      if (other === bits) continue;
      for (const end of [bits, other]) out.push(corner(end, 0), corner(end, 1), corner(end, 2), ...color);
    }
  }
  return out;
}

const row = (name, value, id) => [element("dt", {}, name), element("dd", id ? { id } : {}, value)];

function distribution(map, told) {
  const components = told.sigma.map((sigma, i) => ({
    name: i === 0 ? "free" : i <= map.classes.length ? map.classes[i - 1].name : "class unknown",
    color: i > 0 && i <= map.classes.length ? map.classes[i - 1].color : kNoLabel,
    index: i, sigma, share: told.share[i],
  }));
  const shown = components.filter((c) => Number(c.sigma) > 0);
  shown.sort((a, b) => Number(b.share) - Number(a.share));
  const rows = shown.map((c) => {
    const meter = element("span", { class: "meter", color: c.color });
    meter.style.setProperty("--share", Number(c.share));
    return element("tr", { "data-component": String(c.index) }, element("th", { scope: "row" }, meter, c.name), element("td", { class: "sigma" }, c.sigma), element("td", { class: "share" }, c.share));
  });
  const others = components.length - shown.length;
  const table = element("table", {}, element("caption", {}, "Distribution"), element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "class"), element("th", { scope: "col" }, "evidence"), element("th", { scope: "col" }, "probability"))), element("tbody", {}, ...rows));
  return [table, element("p", { class: "hint" }, others > 0 ? `${others} other ${others === 1 ? "class" : "classes"} without evidence: ${told.prior} each, the prior.` : "")];
}

export function showVoxel(map, told) {
  const panel = document.getElementById("voxel");
  document.getElementById("voxel-empty").hidden = told !== null;
  panel.hidden = told === null;
  if (told === null) return;
  const known = told.label > 0;
  const color = known ? map.classes[told.label - 1].color : kNoLabel;
  const name = known ? map.classes[told.label - 1].name : told.state === "occupied" ? "no label" : told.state;
  panel.replaceChildren(
    element("p", { class: "headline" }, element("span", { class: "swatch", color }), element("strong", { id: "voxel-class" }, name), element("span", { id: "voxel-state" }, told.state)),
    element("dl", { class: "numbers" },
      ...row("probability", told.probability, "voxel-probability"), ...row("variance", told.variance, "voxel-variance"),
      ...row("evidence", told.evidence, "voxel-evidence"), ...row("label", String(told.label), "voxel-label"),
      ...row("centre, m", told.center_m.join("  "), "voxel-center"), ...row("voxel", told.voxel.join("  "), "voxel-place")),
    ...distribution(map, told));
}
