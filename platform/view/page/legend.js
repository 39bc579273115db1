// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
import { kAgreement, kLayers, kMoreRobots, kNoLabel, kStands, kTwoRobots, robotColor, scaleColor, whyNot } from "/layers.js";

const css = (color) => `rgb(${color.join(" ")})`;

export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "color") made.style.setProperty("--color", css(value));
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

function list(entries) {
  return element("ul", { class: entries.length > 8 ? "swatches many" : "swatches" }, ...entries.map(([name, color, note]) =>
    element("li", {}, element("span", { class: "swatch", color }), element("span", { class: "name", title: name }, name), element("span", { class: "count" }, note ?? ""))));
}

/// ticks: [share of the bar from its left, text].
function bar(title, ticks, color) {
  const canvas = element("canvas", { class: "bar", width: "256", height: "1", "aria-hidden": "true" });
  const context = canvas.getContext("2d");
  for (let i = 0; i < 256; ++i) {
    context.fillStyle = css(color(i / 255));
    context.fillRect(i, 0, 1, 1);
  }
  const labels = element("div", { class: "ticks" });
  for (const [share, text] of ticks) {
    const tick = element("span", { class: share === 0 ? "first" : share === 1 ? "last" : "" }, text);
    tick.style.setProperty("--at", `${100 * share}%`);
    labels.append(tick);
  }
  return element("figure", {}, element("figcaption", {}, title), canvas, labels);
}

const share = (count, all) => (count < 0.01 * all ? "<1 %" : `${Math.round((100 * count) / all)} %`);

/// counts: voxels by label.
function classes(map, counts, all) {
  const seen = map.classes.map((c, i) => [c.name, c.color, counts[i + 1]]).filter((entry) => entry[2] > 0);
  seen.sort((a, b) => b[2] - a[2]);
  const absent = map.classes.length - seen.length;
  const entries = seen.map(([name, color, count]) => [name, color, share(count, all)]);
  if (counts[0] > 0) entries.push(["no label", kNoLabel, share(counts[0], all)]);
  const parts = [list(entries)];
  if (absent > 0) parts.push(element("p", { class: "hint" }, `${absent} ${absent === 1 ? "class is" : "classes are"} not in this map.`));
  return parts;
}

const unlabelled = () => list([["no label", kNoLabel]]);

function parts(layer, map, store) {
  const unit = map.kind === "local" ? "scans" : "steps of fusion";
  switch (layer) {
    case "class":
      return classes(map, store.labels, store.voxels);
    case "probability":
      return [bar("Probability of the label", [[0, "1"], [0.25, "0.75"], [0.5, "0.5"], [0.75, "0.25"], [1, "0"]], scaleColor), unlabelled()];
    case "variance":
      return [bar("Variance of the label’s probability", [[0, "10⁻⁶"], [0.37, "10⁻⁴"], [0.74, "0.01"], [1, "0.25"]], scaleColor), unlabelled()];
    case "contributor":
      if (map.live && map.kind === "global") return [list([[map.contributors[0], robotColor(0)], [map.contributors[1], kTwoRobots]])];
      return [list([...map.contributors.map((name, i) => [map.contributors.length > 1 ? `only ${name}` : name, robotColor(i)]),
        ...(map.kind === "global" ? [["two of these", kTwoRobots], ["three or more", kMoreRobots], ["none of these", kNoLabel]] : [])])];
    case "disagreement":
      if (map.live)
        return [list([["this robot’s own map agrees", kAgreement[0]], ["it names another class", kAgreement[1]], [map.contributors[0], kAgreement[2]]])];
      return [list([["they agree on the class", kAgreement[0]], ["they disagree", kAgreement[1]], ["only one of them", kAgreement[2]], ["none of these", kAgreement[3]]])];
    case "height": {
      const [low_m, high_m] = store.heightSpan().map((voxels) => voxels * map.resolution_m);
      return [bar("Height above the map’s origin", [0, 0.5, 1].map((t) => [t, `${(low_m + t * (high_m - low_m)).toFixed(1)} m`]), scaleColor)];
    }
    case "moved": {
      const gone = map.classes.map((c, i) => [`was ${c.name}`, c.color, String(store.moved[i + 1])]).filter((entry) => entry[2] !== "0");
      const hint = gone.length > 0 ? "Voxels that are free by now, by the class that they were of." : "Nothing of a class that may move has gone.";
      return [list([...gone, ["occupied", kStands]]), element("p", { class: "hint" }, hint)];
    }
    default:
      return [bar(`Age of the block in ${unit}`, [[0, "newest"], [0.5, String(Math.round(store.ageSpan() / 2))], [1, `${store.ageSpan()}`]], (t) => scaleColor(1 - t)),
        element("p", { class: "hint" }, `Since the block of 8 × 8 × 8 voxels last changed.`)];
  }
}

export function drawLegend(layer, map, store) {
  document.getElementById("legend").replaceChildren(...(whyNot(layer, map) ? [] : parts(layer, map, store)));
}

/// Makes radio buttons, which call chosen(name).
export function makeLayers(chosen) {
  const group = document.getElementById("layers");
  kLayers.forEach((layer, i) => {
    const input = element("input", { type: "radio", name: "layer", id: `layer-${layer.name}`, value: layer.name });
    input.addEventListener("change", () => chosen(layer.name));
    group.append(element("label", { for: input.id }, input, element("span", {}, layer.title), element("kbd", { "aria-hidden": "true" }, String(i + 1))));
  });
}

export function showLayer(layer, map) {
  document.getElementById(`layer-${layer}`).checked = true;
  for (const { name } of kLayers) document.getElementById(`layer-${name}`).parentElement.classList.toggle("void", whyNot(name, map) !== "");
  document.getElementById("layer-note").textContent = whyNot(layer, map);
}
