// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Data from the command: maps, changed blocks, status. The page polls, so that a slow one requests less, and one that lost
// its connection reconnects by itself.
import { readHeader, unpackedKey } from "/store.js";

const kLive_ms = 200; // Between two rounds of a map that changes.
const kStatus_ms = 1000;
const kIdle_ms = 3000; // The same for maps that do not change.
const kRetry_ms = [300, 1000, 3000];
const kCheck_ms = 10000; // Between two checks for removed blocks.
const kSoon_ms = 2000; // The same if their number differs.
const kLongest_ms = 8000;
// Sizes of a message. One that does not arrive in time is requested again in smaller parts, down to what a link of 2 kB/s carries.
const kMostBytes = 1 << 19;
const kFewestBytes = 1 << 14;

const wait = (ms) => new Promise((done) => setTimeout(done, ms));

async function get(path) {
  const reply = await fetch(path, { signal: AbortSignal.timeout(kLongest_ms), cache: "no-store" });
  if (reply.status === 503) return null;
  if (!reply.ok) throw new Error(`${path}: ${reply.status}`);
  return reply;
}

export class Feed {
  /// on: maps(list), blocks(complete), status(json), state(word).
  constructor(store, on) {
    this.store = store;
    this.on = on;
    this.session = null;
    this.maps = [];
    this.chosen = 0;
    this.cursor = null;
    this.turn = 0; // Calls of choose(): replies to earlier requests are dropped.
    this.tries = 0; // Tries of run(): loops of earlier ones end.
    this.most = kMostBytes;
  }

  choose(number) {
    this.chosen = number;
    ++this.turn;
    this.cursor = { since: 0n, round: 0n, key: 0n, page: 0, met: 0 };
    this.checked_ms = performance.now();
    this.store.clear();
  }

  async run() {
    let failures = 0;
    for (;;) {
      const turn = ++this.tries;
      try {
        await this.meet();
        failures = 0;
        await Promise.race([this.followBlocks(turn), this.followStatus(turn)]);
      } catch {
        // Tries again after any error; another server is detected by its session.
      }
      ++this.tries; // The other of the two ends when it wakes.
      this.on.state("lost");
      await wait(kRetry_ms[Math.min(failures++, kRetry_ms.length - 1)]);
    }
  }

  async meet() {
    const reply = await get("/maps");
    const told = await reply.json();
    if (told.session !== this.session) {
      this.session = told.session;
      this.maps = told.maps;
      this.choose(Math.min(this.chosen, told.maps.length - 1));
      this.on.maps(told.maps);
    }
    this.on.state(this.maps[this.chosen].live ? "live" : "file");
  }

  async followStatus(mine) {
    while (mine === this.tries) {
      const reply = await get("/status");
      const told = reply ? await reply.json() : null;
      if (mine !== this.tries) return;
      if (told && told.session !== this.session) throw new Error("another server");
      if (told) this.on.status(told);
      await wait(this.maps.some((map) => map.live) ? kStatus_ms : kIdle_ms);
    }
  }

  async followBlocks(mine) {
    while (mine === this.tries) await wait(await this.step(mine));
  }

  /// Requests a message of a size that arrives in time; null: try again later.
  async message(cursor) {
    try {
      const reply = await get(`/blocks?map=${this.chosen}&since=${cursor.since}&round=${cursor.round}&key=${cursor.key}&page=${cursor.page}&met=${cursor.met}&most=${this.most}`);
      const buffer = reply ? await reply.arrayBuffer() : null;
      this.most = Math.min(kMostBytes, 2 * this.most);
      return buffer;
    } catch (error) {
      if (error.name === "TimeoutError") this.most = Math.max(kFewestBytes, this.most / 4);
      throw error;
    }
  }

  /// Processes one message; returns the time to wait for the next.
  async step(mine) {
    const { turn, cursor } = this;
    const buffer = await this.message(cursor);
    if (turn !== this.turn || mine !== this.tries) return 0;
    if (!buffer) return kLive_ms;
    const header = readHeader(new DataView(buffer));
    if (String(header.session) !== String(this.session)) throw new Error("another server");
    this.store.take(buffer, header.blocks);
    this.cursor = header;
    if (header.over) await this.check(header, () => turn === this.turn && mine === this.tries);
    if (turn !== this.turn || mine !== this.tries) return 0;
    if (header.over) this.store.measure();
    if (header.blocks > 0 || header.over) this.on.blocks(header.over);
    if (header.over) return this.maps[this.chosen].live ? kLive_ms : kIdle_ms;
    return header.deferred ? kLive_ms : 0;
  }

  /// Removed blocks are not announced, but their keys are missing.
  async check(header, wanted) {
    const now_ms = performance.now();
    const live = this.maps[this.chosen].live;
    const rest_ms = now_ms - this.checked_ms;
    if (header.met === this.store.blocks.size ? !live || rest_ms < kCheck_ms : live && rest_ms < kSoon_ms) return;
    this.checked_ms = now_ms;
    const keys = new Set();
    let page = 0n;
    for (;;) {
      const reply = await get(`/keys?map=${this.chosen}&page=${page}`);
      if (!wanted()) return;
      if (!reply) {
        // The budget of this second is used up: requests this page again.
        await wait(kLive_ms);
        continue;
      }
      const words = new BigUint64Array(await reply.arrayBuffer());
      for (let i = 1; i < words.length; ++i) keys.add(unpackedKey(words[i]));
      if (words[0] === page) return; // The map is changing.
      page = words[0];
      if (page === 0n) break;
    }
    if (wanted()) this.store.keepOnly(keys);
  }
}
