// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The voxels of a map in the page: one run of vertices per block, in one piece of memory that is copied to the graphics
// card. docs/reference/view.md has the format of messages.

import { kMovedFlag } from "/layers.js";

export const kVertexBytes = 20;
const kWords = kVertexBytes / 4;
const kHead = 64;
const kBlockHead = 20;
const kVoxel = 8;
const kRound = 8; // The run of a block is a multiple of this.
/// Instead of a label: this vertex is not drawn.
const kEmpty = 255;

export function readHeader(view) {
  if (view.byteLength < kHead || view.getUint32(0, true) !== 0x31565354) throw new Error("this is no message of blocks");
  const flags = view.getUint32(56, true);
  return {
    session: view.getBigUint64(8, true), since: view.getBigUint64(16, true), round: view.getBigUint64(24, true),
    key: view.getBigUint64(32, true), page: view.getUint32(40, true), met: view.getUint32(48, true),
    blocks: view.getUint32(52, true), over: (flags & 1) !== 0, deferred: (flags & 2) !== 0,
  };
}

const keyOf = (x, y, z) => `${x} ${y} ${z}`;

/// Unpacks a key of the server: three numbers of 21 bits.
export function unpackedKey(packed) {
  const part = (shift) => Number((packed >> shift) & 0x1fffffn) - 1048576;
  return keyOf(part(0n), part(21n), part(42n));
}

export class Store {
  constructor() {
    this.capacity = 1 << 16;
    this.words = new Int32Array(this.capacity * kWords);
    this.clear();
  }

  clear() {
    this.blocks = new Map(); // Key to { first, room, count, x, y, z, revision }.
    this.free = new Map(); // First places by room.
    this.end = 0;
    this.voxels = 0; // Those that are there; of those that moved, see moved.
    this.received = 0;
    this.labels = new Uint32Array(256);
    this.moved = new Uint32Array(256); // By the class that they were of.
    this.newest = 0;
    this.oldest = 0xffffffff;
    this.dirtyFrom = 0;
    this.dirtyTo = 0;
    this.grown = true;
    this.measured = 0; // Voxels when heights were measured.
    this.heights = [0, 1];
  }

  /// Lower and upper end of the heights, in voxels, without the highest and the lowest 2 %; measured again when the map has
  /// grown or shrunk by a tenth.
  heightSpan() {
    if (this.voxels === 0 || Math.abs(this.voxels - this.measured) <= 0.1 * this.measured) return this.heights;
    this.measured = this.voxels;
    const counts = new Map(); // Voxels by the height of their block.
    for (const block of this.blocks.values()) counts.set(block.z, (counts.get(block.z) ?? 0) + block.count - block.gone);
    const levels = [...counts].sort((a, b) => a[0] - b[0]);
    const at = (share) => {
      let below = 0;
      return levels.find(([, count]) => (below += count) >= share * this.voxels)?.[0] ?? 0;
    };
    this.heights = [8 * at(0.02), 8 * at(0.98) + 8];
    return this.heights;
  }

  ageSpan() {
    return Math.max(1, this.newest - Math.min(this.oldest, this.newest));
  }

  /// The span of ages of the current blocks.
  measure() {
    [this.newest, this.oldest] = [0, 0xffffffff];
    for (const block of this.blocks.values()) {
      this.newest = Math.max(this.newest, block.revision);
      this.oldest = Math.min(this.oldest, block.revision);
    }
  }

  /// Takes the blocks of a message.
  take(buffer, count) {
    const view = new DataView(buffer);
    let at = kHead;
    for (let i = 0; i < count; ++i) {
      const [x, y, z] = [view.getInt32(at, true), view.getInt32(at + 4, true), view.getInt32(at + 8, true)];
      const voxels = view.getUint32(at + 16, true);
      this.put(x, y, z, view.getUint32(at + 12, true), view, at + kBlockHead, voxels);
      at += kBlockHead + kVoxel * voxels;
    }
  }

  put(x, y, z, revision, view, at, count) {
    const key = keyOf(x, y, z);
    let block = this.blocks.get(key);
    if (block && (block.room < count || block.room > 4 * count + kRound)) {
      this.remove(key);
      block = undefined;
    }
    if (block) this.forget(block);
    else {
      const room = Math.ceil(Math.max(1, count) / kRound) * kRound;
      block = { first: this.allot(room), room, count: 0, gone: 0, x, y, z, revision };
      this.blocks.set(key, block);
    }
    block.count = count;
    block.gone = 0;
    block.revision = revision;
    this.newest = Math.max(this.newest, revision);
    this.oldest = Math.min(this.oldest, revision); // Until it is measured.
    this.received += count;
    const bytes = new Uint8Array(this.words.buffer);
    let word = block.first * kWords;
    for (let i = 0; i < block.room; ++i, at += kVoxel, word += kWords) {
      if (i >= count) {
        bytes[4 * word + 12] = kEmpty;
        continue;
      }
      const row = view.getUint16(at, true);
      const label = view.getUint8(at + 2);
      this.words[word] = 8 * x + (row & 7);
      this.words[word + 1] = 8 * y + ((row >> 3) & 7);
      this.words[word + 2] = 8 * z + (row >> 6);
      // Label, probability, variance, contributor; then the revision above a byte of flags.
      this.words[word + 3] = view.getInt32(at + 2, true);
      this.words[word + 4] = ((revision & 0xffffff) << 8) | view.getUint8(at + 6);
      const moved = (view.getUint8(at + 6) & kMovedFlag) !== 0;
      ++(moved ? this.moved : this.labels)[label];
      block.gone += moved ? 1 : 0;
    }
    this.voxels += count - block.gone;
    this.touch(block);
  }

  /// Removes the counts of a block that is replaced.
  forget(block) {
    const bytes = new Uint8Array(this.words.buffer);
    for (let i = 0; i < block.count; ++i) {
      const at = (block.first + i) * kWords;
      --((this.words[at + 4] & kMovedFlag) !== 0 ? this.moved : this.labels)[bytes[4 * at + 12]];
    }
    this.voxels -= block.count - block.gone;
  }

  remove(key) {
    const block = this.blocks.get(key);
    this.forget(block);
    this.blocks.delete(key);
    const bytes = new Uint8Array(this.words.buffer);
    for (let i = 0; i < block.room; ++i) bytes[4 * (block.first + i) * kWords + 12] = kEmpty;
    if (!this.free.has(block.room)) this.free.set(block.room, []);
    this.free.get(block.room).push(block.first);
    this.touch(block);
  }

  /// Removes every block that is not among these keys.
  keepOnly(keys) {
    for (const key of [...this.blocks.keys()]) if (!keys.has(key)) this.remove(key);
  }

  allot(room) {
    const free = this.free.get(room);
    if (free && free.length > 0) return free.pop();
    const first = this.end;
    this.end += room;
    if (this.end > this.capacity) {
      while (this.end > this.capacity) this.capacity *= 2;
      const words = new Int32Array(this.capacity * kWords);
      words.set(this.words);
      this.words = words;
      this.grown = true;
    }
    return first;
  }

  touch(block) {
    if (this.dirtyTo === this.dirtyFrom) [this.dirtyFrom, this.dirtyTo] = [block.first, block.first];
    this.dirtyFrom = Math.min(this.dirtyFrom, block.first);
    this.dirtyTo = Math.max(this.dirtyTo, block.first + block.room);
  }

  /// Corners of the box of most blocks, without a few that are far away.
  box() {
    if (this.blocks.size === 0) return null;
    const corner = (axis) => {
      const all = Int32Array.from([...this.blocks.values()], (block) => block[axis]).sort();
      const cut = Math.floor(all.length * 0.01);
      return [8 * all[cut], 8 * (all[all.length - 1 - cut] + 1)];
    };
    const axes = ["x", "y", "z"].map(corner);
    return { low: axes.map((a) => a[0]), high: axes.map((a) => a[1]) };
  }
}
