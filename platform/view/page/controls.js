// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Mouse, touch and keys on the picture.

const kTap = 6; // Pixels that a click may move.
const kTurn = 0.006; // Radians per pixel.
const kKeyTurn = 0.06;
const kKeyMove = 0.04;
const kKeyZoom = 1.12;

/// on: moved(), pick(x, y), clear(), fit(), top(), layer(index); x, y in -1 .. 1, y up.
export function listen(canvas, camera, on) {
  const fingers = new Map();
  let travelled = 0;
  let moves = false;

  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [(2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height];
  };
  const middle = () => {
    const all = [...fingers.values()];
    const sum = all.reduce((a, b) => [a[0] + b[0], a[1] + b[1]], [0, 0]);
    const center = [sum[0] / all.length, sum[1] / all.length];
    return { center, spread: all.length < 2 ? 0 : Math.hypot(all[0][0] - all[1][0], all[0][1] - all[1][1]) };
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (fingers.size === 0) travelled = 0;
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    moves = event.button !== 0 || event.shiftKey;
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId)) return;
    const before = middle();
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    const after = middle();
    const dx = after.center[0] - before.center[0];
    const dy = after.center[1] - before.center[1];
    travelled += Math.abs(dx) + Math.abs(dy) + (fingers.size > 1 ? kTap : 0);
    if (travelled < kTap) return;
    if (fingers.size > 1 || moves) {
      camera.move(dx / canvas.clientHeight, -dy / canvas.clientHeight);
      if (before.spread > 0 && after.spread > 0) camera.zoom(before.spread / after.spread);
    } else {
      camera.turn(-dx * kTurn, dy * kTurn);
    }
    on.moved();
  });
  const lift = (event) => {
    if (!fingers.delete(event.pointerId)) return;
    if (event.type === "pointerup" && travelled < kTap && fingers.size === 0 && event.button === 0) on.pick(...place(event));
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    camera.zoom(Math.exp(Math.max(-200, Math.min(200, event.deltaY * lines)) * 0.0016));
    on.moved();
  }, { passive: false });

  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = arrows[event.key];
    if (arrow && event.shiftKey) camera.move(-arrow[0] * kKeyMove, -arrow[1] * kKeyMove);
    else if (arrow) camera.turn(arrow[0] * kKeyTurn, arrow[1] * kKeyTurn);
    else if (event.key === "+" || event.key === "=") camera.zoom(1 / kKeyZoom);
    else if (event.key === "-") camera.zoom(kKeyZoom);
    else if (event.key === "f" || event.key === "F") return on.fit();
    else if (event.key === "t" || event.key === "T") return on.top();
    else if (event.key === "Escape") return on.clear();
    else if (event.key === "Enter" || event.key === " ") on.pick(0, 0);
    else if (event.key >= "1" && event.key <= "8") return on.layer(Number(event.key) - 1);
    else return;
    event.preventDefault();
    on.moved();
  });
  const button = (id, act) => document.getElementById(id).addEventListener("click", () => {
    act();
    on.moved();
  });
  button("zoom-in", () => camera.zoom(1 / (kKeyZoom * kKeyZoom)));
  button("zoom-out", () => camera.zoom(kKeyZoom * kKeyZoom));
  button("fit", on.fit);
  button("top", on.top);
}
