// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is left of a journal where power was lost or bytes were damaged.
#include <algorithm>
#include <catch2/catch.hpp>

#include "driven_journal.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

/// What a file system may make of bytes that were appended and not synced: each sector of 512 bytes
/// is there, is still zero, or holds anything; or the file ends before it.
std::string crashed(const std::string& whole, std::size_t synced, Random& random) {
  constexpr std::size_t kSector = 512;
  std::string bytes = whole;
  for (std::size_t at = synced; at < bytes.size();) {
    const std::size_t end = std::min(bytes.size(), (at / kSector + 1) * kSector);
    const int fate = random.below(4);
    for (std::size_t i = at; i < end && fate >= 2; ++i)
      bytes[i] = fate == 2 ? '\0' : static_cast<char>(random.below(256));
    at = end;
  }
  if (random.below(2) == 0)
    bytes.resize(synced + static_cast<std::size_t>(random.uniform() *
                                                   static_cast<double>(bytes.size() - synced)));
  return bytes;
}

TEST_CASE("MapJournal: after power was lost each block is as it was at the last step or later") {
#if TESSERA_ASSERTS  // with sanitizers, which are slow
  constexpr int kTraces = 60;
#else
  constexpr int kTraces = 1000;
#endif
  constexpr int kSteps = 4;
  const test::TemporaryFolder folder;
  const std::string path = folder.file("kept.tsj");
  const std::uint64_t seed = 3107;
  Random random(seed);
  int later = 0;
  int torn = 0;
  for (int trace = 0; trace < kTraces; ++trace) {
    Driven driven(seed + static_cast<std::uint64_t>(trace));
    const auto journal = journal_of(driven, path);
    std::vector<Blocks> states;
    std::vector<JournalNote> notes;
    std::vector<std::size_t> synced;
    for (int i = 0; i < kSteps; ++i) {
      for (int n = random.below(3); n != 0; --n) driven.drive();
      REQUIRE(journal->step(driven.note()).ok());
      states.push_back(blocks_of(driven.map));
      notes.push_back(driven.note());
      synced.push_back(folder.read("kept.tsj").size());
    }
    const std::string whole = folder.read("kept.tsj");
    // All prefixes: power is lost in each of the steps.
    for (std::size_t i = 0; i + 1 < states.size(); ++i) {
      folder.write("crashed.tsj", crashed(whole.substr(0, synced[i + 1]), synced[i], random));
      const Read read(folder.file("crashed.tsj"));
      REQUIRE(read.content.note.has_value());
      // What is not whole is of the append that was not finished, and no damage of what was
      // durable.
      if (read.content.note == notes[i] && notes[i] != notes[i + 1]) {
        REQUIRE(read.content.damaged_bytes == 0);
        torn += read.content.torn_bytes != 0 ? 1 : 0;
      }
      for (const auto& [key, bytes] : read.blocks) {
        const auto before = states[i].find(key);
        const auto after = states[i + 1].find(key);
        REQUIRE(after != states[i + 1].end());
        const bool is_later = bytes == after->second;
        later += is_later && (before == states[i].end() || before->second != bytes) ? 1 : 0;
        REQUIRE((is_later || (before != states[i].end() && bytes == before->second)));
      }
      for (const auto& [key, bytes] : states[i]) REQUIRE(read.blocks.count(key) == 1);
    }
  }
  CHECK(later > kTraces);  // Otherwise nothing was torn.
  CHECK(torn > kTraces);
}

TEST_CASE("MapJournal: damage costs the blocks that it is in, and the rest can be continued") {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("kept.tsj");
  Driven driven(11);
  {
    const auto journal = journal_of(driven, path);
    for (int i = 0; i < 40; ++i) driven.drive();
    REQUIRE(journal->step(driven.note()).ok());
  }
  const std::string whole = folder.read("kept.tsj");
  const Blocks all = blocks_of(driven.map);
  Random random(12);
  for (int i = 0; i < 100; ++i) {
    std::string damaged = whole;
    // Behind the header, which is what the file is a map of.
    const std::size_t at = 1024 + static_cast<std::size_t>(
                                      random.uniform() * static_cast<double>(whole.size() - 1024));
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random.below(8)));
    folder.write("kept.tsj", damaged);
    const Read read(path);
    // Where it is the note that is damaged the append may as well not have been finished.
    const bool has_note = read.content.note.has_value();
    REQUIRE((read.content.torn_bytes != 0) == !has_note);
    REQUIRE((has_note || read.content.damaged_bytes == 0));
    int lost = 0;
    for (const auto& [key, bytes] : all) {
      const auto found = read.blocks.find(key);
      lost += found == read.blocks.end() ? 1 : 0;
      if (found != read.blocks.end()) REQUIRE(found->second == bytes);
    }
    CHECK(lost <= 1);
    CHECK((lost == 0 || read.content.damaged_bytes != 0));
    Driven continued(13);
    REQUIRE(read_journal(path, &continued.map).ok());
    {
      const auto journal = journal_of(continued, path, &read.content);
      continued.drive();
      REQUIRE(journal->step(continued.note()).ok());
    }
    REQUIRE(Read(path).blocks == blocks_of(continued.map));
  }
}

}  // namespace
}  // namespace tessera
