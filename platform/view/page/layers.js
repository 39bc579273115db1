// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Meaning of colours: a table of four rows of 256 colours, and the row and column of a voxel.

export const kLayers = [
  { name: "class", title: "Class" },
  { name: "probability", title: "Probability" },
  { name: "variance", title: "Variance" },
  { name: "contributor", title: "Contributor" },
  { name: "disagreement", title: "Disagreement" },
  { name: "age", title: "Age" },
  { name: "height", title: "Height" },
  { name: "moved", title: "Moved" },
];

export const kNoLabel = [128, 128, 128];
/// From certain to uncertain, evenly lighter, for every kind of colour vision.
export const kScale = [[68, 1, 84], [70, 50, 127], [54, 92, 141], [39, 127, 142], [31, 161, 135], [74, 194, 109], [159, 218, 58], [253, 231, 37]];
/// Distinguishable with every kind of colour vision.
export const kRobots = [[86, 180, 233], [230, 159, 0], [0, 158, 115], [204, 121, 167], [240, 228, 66], [0, 114, 178], [213, 94, 0], [164, 206, 149]];
export const kOtherRobots = [176, 152, 126];
export const kTwoRobots = [110, 100, 165];
export const kMoreRobots = [72, 64, 120];
/// By disagreement: agree, disagree, one robot only, label of no robot.
export const kAgreement = [[0, 114, 178], [213, 94, 0], [158, 162, 170], [240, 228, 66]];
/// Of the other voxels, where those that moved are shown.
export const kStands = kAgreement[2];
/// A voxel's flag: free by now, with a label that may move.
export const kMovedFlag = 2;
/// VoxelMark's numbers.
export const kNobody = 255;
export const kTwo = 254;
export const kMore = 253;

/// Codes of variances at the ends of the scale: 0.25, the largest, and 1e-6.
export const kVarianceMost = 24;
export const kVarianceLeast = 240;

export function scaleColor(t) {
  const at = Math.max(0, Math.min(1, t)) * (kScale.length - 1);
  const i = Math.min(kScale.length - 2, Math.floor(at));
  return [0, 1, 2].map((c) => Math.round(kScale[i][c] + (at - i) * (kScale[i + 1][c] - kScale[i][c])));
}

export const robotColor = (index) => (index < kRobots.length ? kRobots[index] : kOtherRobots);

/// 256 x 4 colours, four bytes each: classes, contributors, the scale, agreement.
export function paletteOf(map) {
  const bytes = new Uint8Array(4 * 4 * 256);
  const put = (row, column, color) => bytes.set([...color, 255], 4 * (256 * row + column));
  for (let i = 0; i < 256; ++i) {
    put(0, i, i > 0 && i <= map.classes.length ? map.classes[i - 1].color : kNoLabel);
    put(1, i, robotColor(i));
    put(2, i, scaleColor(i / 255));
    put(3, i, kAgreement[Math.min(i, 3)]);
  }
  put(1, kTwo, kTwoRobots);
  put(1, kMore, kMoreRobots);
  put(1, kNobody, kNoLabel);
  return bytes;
}

/// Why a layer has nothing to show for a map; empty if it has.
export function whyNot(layer, map) {
  if (layer === "contributor" && map.contributors.length === 0)
    return "Give the local maps too: tessera view GLOBAL.tsm ROBOT.tsm ...";
  if (layer === "disagreement" && map.kind === "local") return "A local map has only one robot. Choose a global map.";
  if (layer === "disagreement" && map.contributors.length === 0) return whyNot("contributor", map);
  return "";
}
