// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How the faces of a voxel are lit: as in the pictures, platform/pictures/oblique_view.cpp, whose constants have these names.
// (Shadows and dark ends of columns are of pictures alone: they need the heights of the whole map.)

export const kTopTone = 1.0;
export const kBottomTone = 0.45;
export const kSideTone = 0.72;
/// More on sides that face the light, and less on those that face away.
export const kSideContrast = 0.2;
/// The light comes from behind the viewer's left shoulder.
export const kLightFromForward = 2.5;

/// Direction to the light, level, for an eye that looks along forward.
export function toLight(forward) {
  const heading = Math.atan2(forward[1], forward[0]) + kLightFromForward;
  return [Math.cos(heading), Math.sin(heading)];
}

const text = (number) => number.toFixed(4);
/// GLSL: the tone of the face that a ray meets; axis: 0 .. 2 across it.
export const kToneOf = `
float tone_of(int axis, vec3 ray, vec2 to_light) {
  if (axis == 2) return ray.z < 0.0 ? ${text(kTopTone)} : ${text(kBottomTone)};
  return ${text(kSideTone)} - ${text(kSideContrast)} * sign(ray[axis]) * to_light[axis];
}`;
