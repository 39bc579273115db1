// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Draws voxels: each is one point, in which a ray is intersected with a cube, so that 500,000 of them are 500,000 vertices.
// While the picture moves they are plain squares, and as many as the machine draws smoothly; a still picture has all cubes.
import { kToneOf, toLight } from "/light.js";
import { add, cross, dot } from "/matrix.js";
import { kVertexBytes } from "/store.js";

const kVoxelVertex = `#version 300 es
precision highp float;
precision highp int;
layout(location = 0) in ivec3 voxel;
layout(location = 1) in uvec4 told;
layout(location = 2) in uint more;
uniform ivec3 origin;
uniform mat4 clip;
uniform vec3 eye;
uniform float pixels, near, swell, newest, span;
uniform vec2 heights;
uniform int layer;
uniform highp sampler2D palette;
flat out vec3 center;
flat out vec3 color;
flat out float size;
ivec2 place() {
  if (layer == 7) return (more & 2u) != 0u ? ivec2(int(told.x), 0) : ivec2(2, 3);
  if (layer == 0) return ivec2(int(told.x), 0);
  if (layer == 3) return ivec2(int(told.w), 1);
  if (layer == 4) return ivec2(told.w == 255u ? 3 : told.w < 253u ? 2 : int(more & 1u), 3);
  if (layer == 6) return ivec2(int(255.0 * clamp((float(voxel.z) + 0.5 - heights.x) / (heights.y - heights.x), 0.0, 1.0)), 2);
  if (layer == 5) return ivec2(int(255.0 * (1.0 - clamp((newest - float(more >> 8)) / span, 0.0, 1.0))), 2);
  if (told.x == 0u) return ivec2(0, 0);
  if (layer == 1) return ivec2(255 - int(told.y), 2);
  return ivec2(int(255.0 * clamp((240.0 - float(told.z)) / 216.0, 0.0, 1.0)), 2);
}
void main() {
  center = vec3(voxel - origin) + 0.5;
  gl_Position = clip * vec4(center, 1.0);
  bool gone = (more & 2u) != 0u && layer != 7;
  if (told.x == 255u || gone || gl_Position.w < near) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = 1.0;
    return;
  }
  // Of two cubes on a ray the one with the nearer center is in front, as a ray leaves the eye on every axis.
  gl_Position.z = (1.0 - 2.0 * near / max(distance(center, eye), near)) * gl_Position.w;
  size = pixels / gl_Position.w;
  gl_PointSize = max(1.0, swell * size);
  color = texelFetch(palette, place(), 0).rgb;
}`;

const kVoxelFragment = `#version 300 es
precision highp float;
uniform vec3 eye, right, up, forward;
uniform vec2 screen, to_light;
uniform bool cubes;
flat in vec3 center;
flat in vec3 color;
flat in float size;
out vec4 drawn;${kToneOf}
void main() {
  if (!cubes || size < 1.5) {
    drawn = vec4(color * 0.87, 1.0);
    return;
  }
  vec2 at = gl_FragCoord.xy * screen - 1.0;
  vec3 ray = forward + at.x * right + at.y * up;
  vec3 inverse = 1.0 / ray;
  vec3 middle = (center - eye) * inverse;
  vec3 half_way = 0.5 * abs(inverse);
  vec3 enters = middle - half_way;
  vec3 leaves = middle + half_way;
  float first = max(max(enters.x, enters.y), enters.z);
  if (first > min(min(leaves.x, leaves.y), leaves.z)) discard;
  float light = tone_of(first == enters.z ? 2 : first == enters.x ? 0 : 1, ray, to_light);
  // A thin darker line at the edges, if a cube is large enough for it.
  vec3 local = abs(eye + first * ray - center);
  float second = max(min(local.x, local.y), min(max(local.x, local.y), local.z));
  float edge = smoothstep(0.5 - 1.4 / size, 0.5, second) * clamp((size - 7.0) / 9.0, 0.0, 1.0);
  drawn = vec4(color * light * (1.0 - 0.28 * edge), 1.0);
}`;

const kLineVertex = `#version 300 es
precision highp float;
layout(location = 0) in vec3 at;
layout(location = 1) in vec3 tint;
uniform mat4 clip;
uniform vec3 eye;
uniform float near;
out vec3 color;
void main() {
  gl_Position = clip * vec4(at, 1.0);
  // A little nearer than the surface under them.
  if (gl_Position.w > near) gl_Position.z = (1.0 - 2.0 * near / max(distance(at, eye) - 2.0, near)) * gl_Position.w;
  color = tint;
}`;
const kLineFragment = `#version 300 es
precision highp float;
in vec3 color;
out vec4 drawn;
void main() { drawn = vec4(color, 1.0); }`;

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made));
  const places = {};
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); ++i) {
    const { name } = gl.getActiveUniform(made, i);
    places[name] = gl.getUniformLocation(made, name);
  }
  return { made, places };
}

/// Lines of some pixels' width, two triangles each: those of WebGL are one pixel wide.
function widened(lines, frame, height) {
  const kWidth = 1.6; // Half of it, in pixels.
  const out = new Float32Array(3 * lines.length);
  let to = 0;
  for (let at = 0; at < lines.length; at += 12) {
    const ends = [lines.subarray(at, at + 3), lines.subarray(at + 6, at + 9)];
    const color = lines.subarray(at + 3, at + 6);
    const along = add(ends[1], ends[0], -1);
    const corners = ends.map((end) => {
      const away = add(end, frame.eye, -1);
      const side = cross(along, away);
      const scale = (kWidth * 2 * frame.tanHalf * Math.max(frame.near, dot(away, frame.forward))) / height / (Math.hypot(...side) || 1);
      return [add(end, side, scale), add(end, side, -scale)];
    });
    for (const corner of [corners[0][0], corners[0][1], corners[1][0], corners[1][0], corners[0][1], corners[1][1]]) {
      out.set(corner, to);
      out.set(color, to + 3);
      to += 6;
    }
  }
  return out;
}

export class Gpu {
  /// Null if the browser has no WebGL 2.
  static make(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "high-performance" });
    return gl ? new Gpu(canvas, gl) : null;
  }

  constructor(canvas, gl) {
    this.canvas = canvas;
    this.gl = gl;
    this.voxels = program(gl, kVoxelVertex, kVoxelFragment);
    this.lines = program(gl, kLineVertex, kLineFragment);
    this.buffer = gl.createBuffer();
    this.lineBuffer = gl.createBuffer();
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, which, gl.NEAREST);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    this.background = [0.06, 0.07, 0.09];
  }

  setPalette(bytes) {
    const { gl } = this;
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 256, 4, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  }

  upload(store) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    if (store.grown) {
      gl.bufferData(gl.ARRAY_BUFFER, store.words, gl.DYNAMIC_DRAW);
    } else if (store.dirtyTo > store.dirtyFrom) {
      const words = kVertexBytes / 4;
      gl.bufferSubData(gl.ARRAY_BUFFER, store.dirtyFrom * kVertexBytes, store.words, store.dirtyFrom * words, (store.dirtyTo - store.dirtyFrom) * words);
    }
    store.grown = false;
    store.dirtyFrom = store.dirtyTo = 0;
  }

  resize() {
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const [width, height] = [Math.max(1, Math.round(this.canvas.clientWidth * ratio)), Math.max(1, Math.round(this.canvas.clientHeight * ratio))];
    if (this.canvas.width === width && this.canvas.height === height) return;
    [this.canvas.width, this.canvas.height] = [width, height];
  }

  /// look: store, camera, layer (number), lines (Float32Array of x y z r g b relative to origin), origin, every: draws one
  /// voxel of this many, cubes: instead of plain squares.
  draw(look) {
    const { gl, canvas } = this;
    const aspect = canvas.width / canvas.height;
    const frame = look.camera.frame(aspect, look.origin);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...this.background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.drawVoxels(look, frame);
    if (look.lines.length > 0) this.drawLines(look.lines, frame);
  }

  drawVoxels(look, frame) {
    const { gl, canvas } = this;
    const { made, places } = this.voxels;
    gl.useProgram(made);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    const stride = kVertexBytes * look.every;
    gl.enableVertexAttribArray(0);
    gl.enableVertexAttribArray(1);
    gl.enableVertexAttribArray(2);
    gl.vertexAttribIPointer(0, 3, gl.INT, stride, 0);
    gl.vertexAttribIPointer(1, 4, gl.UNSIGNED_BYTE, stride, 12);
    gl.vertexAttribIPointer(2, 1, gl.UNSIGNED_INT, stride, 16);
    gl.uniform3i(places.origin, ...look.origin);
    gl.uniformMatrix4fv(places.clip, false, frame.clip);
    for (const name of ["eye", "right", "up", "forward"]) {
      const scale = name === "right" ? frame.tanHalf * frame.aspect : name === "up" ? frame.tanHalf : 1;
      gl.uniform3f(places[name], ...frame[name].map((v) => v * scale));
    }
    gl.uniform2f(places.to_light, ...toLight(frame.forward));
    gl.uniform2f(places.screen, 2 / canvas.width, 2 / canvas.height);
    gl.uniform1f(places.pixels, canvas.height / (2 * frame.tanHalf));
    gl.uniform1f(places.near, frame.near);
    // The corners of a cube reach beyond a square of its edge.
    gl.uniform1f(places.swell, look.cubes ? 1.85 : 1.2 * look.every ** 0.3);
    gl.uniform1f(places.newest, look.store.newest & 0xffffff);
    gl.uniform1f(places.span, look.store.ageSpan());
    gl.uniform2f(places.heights, ...look.store.heightSpan());
    gl.uniform1i(places.layer, look.layer);
    gl.uniform1i(places.cubes, look.cubes ? 1 : 0);
    gl.drawArrays(gl.POINTS, 0, Math.floor(look.store.end / look.every));
  }

  drawLines(thin, frame) {
    const { gl } = this;
    const lines = widened(thin, frame, this.canvas.height);
    const { made, places } = this.lines;
    gl.useProgram(made);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, lines, gl.DYNAMIC_DRAW);
    gl.disableVertexAttribArray(2);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 24, 0);
    gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 24, 12);
    gl.uniformMatrix4fv(places.clip, false, frame.clip);
    gl.uniform3f(places.eye, ...frame.eye);
    gl.uniform1f(places.near, frame.near);
    gl.drawArrays(gl.TRIANGLES, 0, lines.length / 6);
  }
}
