// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Vectors as arrays of three, matrices of four by four by columns, as in WebGL.

export const add = (a, b, scale = 1) => [a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/// From the frame of the eye's axes to clip space; near and far: distances along the look.
export function projection(tanHalf, aspect, near, far) {
  const out = new Float32Array(16);
  out[0] = 1 / (tanHalf * aspect);
  out[5] = 1 / tanHalf;
  out[10] = (far + near) / (near - far);
  out[11] = -1;
  out[14] = (2 * far * near) / (near - far);
  return out;
}

/// The eye looks along forward; all unit vectors.
export function viewMatrix(eye, right, up, forward) {
  return new Float32Array([right[0], up[0], -forward[0], 0, right[1], up[1], -forward[1], 0, right[2], up[2], -forward[2], 0,
    -dot(right, eye), -dot(up, eye), dot(forward, eye), 1]);
}

export function multiply(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; ++column) {
    for (let row = 0; row < 4; ++row) {
      let sum = 0;
      for (let i = 0; i < 4; ++i) sum += a[4 * i + row] * b[4 * column + i];
      out[4 * column + row] = sum;
    }
  }
  return out;
}

/// T: twelve numbers, row by row; a point in metres.
export const transform = (T, p) => [0, 1, 2].map((r) => T[4 * r] * p[0] + T[4 * r + 1] * p[1] + T[4 * r + 2] * p[2] + T[4 * r + 3]);
