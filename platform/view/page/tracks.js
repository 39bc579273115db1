// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Poses and tracks of robots, as lines in the shown map.
import { robotColor } from "/layers.js";
import { element } from "/legend.js";
import { transform } from "/matrix.js";

/// The point in voxels of the shown map; robots send theirs in the frame of their own map.
function placer(map, robot, origin) {
  const scale = 1 / map.resolution_m;
  return (p) => {
    const q = map.kind === "global" ? transform(robot.T_global_map, p) : p;
    return q.map((v, i) => v * scale - origin[i]);
  };
}

const is_shown = (map, robot) => map.kind === "global" || map.robot === robot.robot;

/// robots: from /status. Returns x y z r g b of the ends of each line.
export function lines(map, robots, origin) {
  const out = [];
  robots.filter((robot) => is_shown(map, robot)).forEach((robot, index) => {
    const color = robotColor(index).map((c) => Math.min(1, 0.25 + c / 255));
    const place = placer(map, robot, origin);
    const line = (a, b) => out.push(...place(a), ...color, ...place(b), ...color);
    for (let i = 1; i < robot.track.length; ++i) line(robot.track[i - 1], robot.track[i]);
    if (!robot.T_map_sensor) return;
    // Its axes: forward longer than the others.
    const T = robot.T_map_sensor;
    const length = 12 * map.resolution_m;
    const at = transform(T, [0, 0, 0]);
    line(at, transform(T, [2 * length, 0, 0]));
    line(transform(T, [0, -length, 0]), transform(T, [0, length, 0]));
    line(at, transform(T, [0, 0, length]));
    line(transform(T, [2 * length, 0, 0]), transform(T, [1.4 * length, -0.4 * length, 0]));
    line(transform(T, [2 * length, 0, 0]), transform(T, [1.4 * length, 0.4 * length, 0]));
  });
  return out;
}

export function showRobots(map, robots) {
  const panel = document.getElementById("robots-panel");
  panel.hidden = robots.length === 0;
  document.getElementById("robots").replaceChildren(...robots.filter((robot) => is_shown(map, robot)).map((robot, index) => {
    const T = robot.T_map_sensor;
    const at = T ? `${[3, 7, 11].map((i) => T[i].toFixed(2)).join("  ")} m` : "no pose yet";
    return element("li", {}, element("span", { class: "swatch", color: robotColor(index) }), element("span", { class: "name" }, `robot ${robot.robot}`), element("span", { class: "count" }, at));
  }));
}
