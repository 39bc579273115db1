// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A camera that looks at a point from a distance; z is up. Lengths are in voxels, for any resolution.
import { add, cross, dot, multiply, projection, viewMatrix } from "/matrix.js";

const kSteepest = Math.PI / 2 - 1e-3;

export class Camera {
  constructor() {
    this.target = [0, 0, 0];
    this.yaw = -2.2;
    this.pitch = 0.6;
    this.distance = 400;
    this.tanHalf = Math.tan(0.42);
    this.nearest = 2;
    this.farthest = 1e5;
  }

  axes() {
    const forward = [-Math.cos(this.pitch) * Math.cos(this.yaw), -Math.cos(this.pitch) * Math.sin(this.yaw), -Math.sin(this.pitch)];
    const right = [-Math.sin(this.yaw), Math.cos(this.yaw), 0];
    return { forward, right, up: cross(right, forward) };
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-kSteepest, Math.min(kSteepest, this.pitch + pitch));
  }

  /// Moves by shares of the picture's height; the target follows the pointer.
  move(right, up) {
    const height = 2 * this.distance * this.tanHalf;
    const axes = this.axes();
    this.target = add(add(this.target, axes.right, -right * height), axes.up, -up * height);
  }

  zoom(factor) {
    this.distance = Math.max(this.nearest, Math.min(this.farthest, this.distance * factor));
  }

  /// low, high: corners of the box to show.
  fit(low, high, aspect) {
    this.target = [0, 1, 2].map((i) => (low[i] + high[i]) / 2);
    const radius = Math.max(4, Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]) / 2);
    this.farthest = 20 * radius;
    // Every corner is inside of the picture, from any direction.
    const axes = this.axes();
    this.distance = this.nearest;
    for (let bits = 0; bits < 8; ++bits) {
      const corner = [0, 1, 2].map((i) => ((bits >> i) & 1 ? high[i] : low[i]) - this.target[i]);
      const wide = Math.max(Math.abs(dot(corner, axes.right)) / aspect, Math.abs(dot(corner, axes.up))) / this.tanHalf;
      this.distance = Math.max(this.distance, 1.06 * wide - dot(corner, axes.forward));
    }
  }

  /// origin: a voxel near the target, so that numbers stay small.
  frame(aspect, origin) {
    const axes = this.axes();
    const at = [0, 1, 2].map((i) => this.target[i] - origin[i]);
    const eye = add(at, axes.forward, -this.distance);
    const near = Math.max(0.2, this.distance / 500);
    const clip = multiply(projection(this.tanHalf, aspect, near, this.distance + 4 * this.farthest), viewMatrix(eye, axes.right, axes.up, axes.forward));
    return { ...axes, eye, near, clip, tanHalf: this.tanHalf, aspect };
  }

  /// x, y: in -1 .. 1 of the picture, y up. A ray in voxels.
  ray(x, y, aspect) {
    const axes = this.axes();
    const direction = add(add(axes.forward, axes.right, x * this.tanHalf * aspect), axes.up, y * this.tanHalf);
    return { from: add(this.target, axes.forward, -this.distance), direction };
  }
}
