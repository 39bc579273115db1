// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The network and the timing of a node, once a second.
import { element } from "/legend.js";

const whole = (n) => Number(n).toLocaleString("en").replace(/,/g, "\u202f");
const bytes = (n) => (n < 1e6 ? `${(n / 1e3).toFixed(1)} kB` : `${(n / 1e6).toFixed(2)} MB`);
const ms = (n) => `${Number(n).toFixed(1)} ms`;

function fill(id, rows) {
  document.getElementById(id).replaceChildren(...rows.flatMap(([name, value, bad]) => [element("dt", {}, name), element("dd", { id: `${id}-${name.replaceAll(" ", "-")}`, class: bad ? "bad" : "" }, value)]));
}

/// buckets: [milliseconds at most, count], of about the same ratio; drawn as bars.
function histogram(buckets, period_ms) {
  const holder = document.getElementById("histogram");
  const bars = new Array(24).fill(0);
  const most_ms = Math.max(1.1 * period_ms, ...buckets.map(([limit]) => limit));
  for (const [limit, count] of buckets) bars[Math.min(bars.length - 1, Math.floor((bars.length * limit) / most_ms))] += count;
  const tallest = Math.max(1, ...bars);
  const columns = bars.map((count, i) => {
    const column = element("span", { class: (i * most_ms) / bars.length >= period_ms ? "column late" : "column" });
    column.style.setProperty("--height", count === 0 ? 0 : Math.max(0.04, count / tallest));
    return column;
  });
  const limit = element("span", { class: "limit" });
  limit.style.setProperty("--at", `${(100 * period_ms) / most_ms}%`);
  holder.setAttribute("aria-label", `Cycles by their length, up to ${ms(most_ms)}; the period is ${period_ms} ms`);
  holder.replaceChildren(element("div", { class: "columns" }, ...columns, limit), element("div", { class: "axis" }, element("span", {}, "0"), element("span", {}, `period ${period_ms} ms`), element("span", {}, ms(most_ms))));
}

/// Where the team's links have each robot, what is in doubt, and why a comparison found nothing.
function frameRows(frames) {
  const rows = frames.robots.map((r) => {
    const held = r.robot === r.anchor ? r.state : `${r.state}, in the frame of robot ${r.anchor}`;
    const sure = r.in_use && r.sigma_m > 0 ? `, ± ${r.sigma_m.toFixed(2)} m ${r.sigma_deg.toFixed(2)}°` : "";
    const doubt = r.suspected ? "; its links contradict others" : r.in_use && !r.arrived ? "; follows" : "";
    return [`robot ${r.robot}`, `${r.in_use ? "" : "left out: "}${held}${sure}${doubt}`, !r.in_use || r.suspected];
  });
  const refused = frames.links.filter((l) => !["used", "not needed", "replaced", "of another epoch"].includes(l.verdict));
  return [...rows,
    ...frames.pairs.filter((p) => !p.stated).map((p) => [`compared with robot ${p.robot}`, p.result, p.attempts > 0]),
    ...refused.map((l) => [`link ${l.from} to ${l.to}`, l.verdict, true]),
    ["links used", `${frames.links.filter((l) => l.verdict === "used").length} of ${frames.links.length}`]];
}

export function showNode(told) {
  for (const name of ["timing", "network", "frames"]) document.getElementById(`${name}-panel`).hidden = !told[name];
  if (told.timing) {
    const t = told.timing;
    fill("timing", [["cycles", whole(t.cycles)], ["p50", ms(t.p50_ms)], ["p99", ms(t.p99_ms)], ["max", ms(t.max_ms)], ["missed", whole(t.missed), t.missed > 0], ["ticks of sharing", whole(t.ticks)],
      ...(t.unseen > 0 ? [["not shown here", whole(t.unseen)]] : [])]);
    histogram(t.buckets, t.period_ms);
  }
  if (told.network) {
    const n = told.network;
    fill("network", [["robots in reach", whole(n.in_reach)], ["contributions", `${n.complete} of ${n.contributions} complete`], ["sent", `${whole(n.sent)} · ${bytes(n.sent_bytes)}`], ["received", `${whole(n.received)} · ${bytes(n.received_bytes)}`],
      ["lost on the network", whole(n.missing), n.missing > 0], ["lost here", whole(n.lost_here), n.lost_here > 0], ["refused", whole(n.refused), n.refused > 0],
      ...(n.sessions?.length > 0 ? [["maps of earlier days", n.sessions.map((s) => s.date.slice(0, 10)).join(", ")]] : []),
      ...(n.exclude_differs?.length > 0 ? [["exclude other robots", `robots ${n.exclude_differs.join(", ")}`, true]] : []),
      ...(n.doubted ?? []).map((d) => [`robot ${d.robot} differs from most`, d.classes.join(", "), true])]);
  }
  if (told.frames) fill("frames", frameRows(told.frames));
}
