// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>

#include "driven_journal.hpp"
#include "maps/stored_map.hpp"
#include "support/temporary_folder.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {
namespace {

TEST_CASE("MapJournal: what a step has returned for is in the file, and can be continued") {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("kept.tsj");
  Driven driven(7);
  {
    const auto journal = journal_of(driven, path);
    CHECK_FALSE(std::filesystem::exists(path));
    for (int i = 0; i < 30; ++i) {
      driven.drive();
      REQUIRE(journal->step(driven.note()).ok());
      const Read read(path);
      CHECK(read.blocks == blocks_of(driven.map));
      CHECK(content_of(read.map.map) == content_of(driven.map));
      CHECK(read.content.note == driven.note());
      CHECK(read.content.header.identity.epoch == 2);
      CHECK(read.content.damaged_bytes + read.content.torn_bytes == 0);
    }
    const std::uint64_t before = journal->written_bytes();
    REQUIRE(journal->step(driven.note()).ok());
    CHECK(journal->written_bytes() - before < 200);  // Nothing has changed: the note alone.
  }
  // As any map file is read.
  const auto stored = load_map(path);
  REQUIRE(stored.ok());
  CHECK(content_of((*stored)->map) == content_of(driven.map));
  CHECK((*stored)->header.revision == driven.map.revision());
  CHECK((*stored)->header.content.blocks == driven.map.block_count());
  CHECK(load_whole_header(path)->identity.robot == 1);
  SmallMap fitting(config_of_pages(kPages));
  CHECK(*load_into(path, fitting.map));
  SmallMap too_small(config_of_pages(4));
  CHECK_FALSE(*load_into(path, too_small.map));
  // Another process.
  const Read found(path);
  Driven continued(8);
  REQUIRE(read_journal(path, &continued.map).ok());
  const auto journal = journal_of(continued, path, &found.content);
  for (int i = 0; i < 5; ++i) continued.drive();
  REQUIRE(journal->step(continued.note()).ok());
  CHECK(Read(path).blocks == blocks_of(continued.map));
  CHECK(folder.num_entries() == 1);
  journal->remove();
  CHECK(folder.num_entries() == 0);
}

TEST_CASE("MapJournal: the file is written anew when it has grown, and is whole all the time") {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("kept.tsj");
  Driven driven(9);
  const auto journal = journal_of(driven, path, nullptr, 4096);
  std::uint64_t largest = 0;
  for (int i = 0; i < 300; ++i) {
    driven.drive();
    REQUIRE(journal->step(driven.note()).ok());
    CHECK(Read(path).blocks == blocks_of(driven.map));
    largest = std::max(largest, journal->file_bytes());
  }
  CHECK(journal->renewals() > 3);
  const std::uint64_t whole = std::filesystem::file_size(path);
  CHECK(largest < MapJournal::kMostGrowth * whole + 4096 + 40 * 1024);
}

TEST_CASE("MapJournal: a map that was cleared leaves nothing of before") {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("kept.tsj");
  Driven driven(10);
  const auto journal = journal_of(driven, path);
  for (int i = 0; i < 10; ++i) driven.drive();
  REQUIRE(journal->step(driven.note()).ok());
  driven.map.clear();
  driven.drive();
  REQUIRE(journal->begin_anew(driven.note()).ok());
  CHECK(Read(path).blocks == blocks_of(driven.map));
  driven.drive();
  REQUIRE(journal->step(driven.note()).ok());
  CHECK(Read(path).blocks == blocks_of(driven.map));
}

TEST_CASE("MapJournal: a file that is none, or of another map, is refused") {
  const test::TemporaryFolder folder;
  Driven driven(14);
  const std::string path = folder.file("kept.tsj");
  CHECK(read_journal(path, nullptr).failure().kind == FailureKind::kUsage);
  folder.write("kept.tsj", "not a map that is kept");
  CHECK(read_journal(path, nullptr).failure().text().find("this is not a kept map") !=
        std::string::npos);
  const auto journal = journal_of(driven, path);
  driven.drive();
  REQUIRE(journal->step(driven.note()).ok());
  MapConfig other = config_of_pages(kPages);
  other.resolution_m = 0.5;
  SmallMap coarse(other);
  CHECK(read_journal(path, &coarse.map).failure().text().find("other settings") !=
        std::string::npos);
  SmallMap more_classes(config_of_pages(kPages), 4);
  CHECK_FALSE(read_journal(path, &more_classes.map).ok());
  for (int i = 0; i < 40; ++i) driven.drive();
  REQUIRE(journal->step(driven.note()).ok());
  SmallMap small(config_of_pages(4));
  CHECK(read_journal(path, &small.map).failure().text().find("more than fits") !=
        std::string::npos);
}

TEST_CASE("MapJournal: on a full disk it fails, and what was durable stays; later it goes on") {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("kept.tsj");
  Driven driven(15);
  const auto journal = journal_of(driven, path);
  driven.drive();
  REQUIRE(journal->step(driven.note()).ok());
  const Blocks durable = blocks_of(driven.map);
  ::rlimit limit{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &limit) == 0);
  const auto ignored = ::signal(SIGXFSZ, SIG_IGN);
  ::rlimit small = limit;
  small.rlim_cur = journal->file_bytes() + 100;
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &small) == 0);
  for (int i = 0; i < 20; ++i) driven.drive();
  const Outcome<void> failed = journal->step(driven.note());
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
  ::signal(SIGXFSZ, ignored);
  REQUIRE_FALSE(failed.ok());
  CHECK(failed.failure().kind == FailureKind::kFailure);
  CHECK(failed.failure().text().find(path) != std::string::npos);
  CHECK(Read(path).blocks == durable);
  REQUIRE(journal->step(driven.note()).ok());
  CHECK(Read(path).blocks == blocks_of(driven.map));
}

}  // namespace
}  // namespace tessera
