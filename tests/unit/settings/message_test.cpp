// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/message.hpp"

#include <catch2/catch.hpp>

namespace tessera {
namespace {

constexpr SettingName kRange{"--max-range", "map", "max_range_m"};
constexpr SettingName kMemory{"--memory", "map", "memory", "memory_bytes"};
constexpr SettingName kPrior{.option = "--prior-map"};
constexpr SettingName kShare{.table = "fusion", .key = "robot_share"};

TEST_CASE("name_of: each speaker has its name for a setting, or the nearest one") {
  CHECK(name_of(kRange, Speaker::kCommand) == "--max-range");
  CHECK(name_of(kRange, Speaker::kFile) == "max_range_m");
  CHECK(name_of(kRange, Speaker::kPython) == "max_range_m");
  CHECK(name_of(kMemory, Speaker::kFile) == "memory");
  CHECK(name_of(kMemory, Speaker::kPython) == "memory_bytes");
  CHECK(name_of(kPrior, Speaker::kFile) == "--prior-map");
  CHECK(name_of(kPrior, Speaker::kPython) == "prior_map");
  CHECK(name_of(kShare, Speaker::kCommand) == "robot_share");
}

TEST_CASE("Message: one sentence in the words of each speaker") {
  const Message message = "metres, under " + Message(kRange) + ", in " + bytes_text(64U << 20U);
  CHECK(message.text() == "metres, under --max-range, in 64M");
  CHECK(message.text(Speaker::kFile) == "metres, under max_range_m, in 64M");
  CHECK(message.text(Speaker::kPython) == "metres, under max_range_m, in 67108864 bytes");
}

TEST_CASE("Message: text from outside is never taken for the name of a setting") {
  const Message message("folder --max-range of max_range_m is missing");
  for (const Speaker speaker : {Speaker::kCommand, Speaker::kFile, Speaker::kPython})
    CHECK(message.text(speaker) == "folder --max-range of max_range_m is missing");
  CHECK(message.subject() == nullptr);
}

TEST_CASE("Message: it is about the setting that it names first") {
  const Message about = Message(kRange) + " needs " + kMemory;
  CHECK(about.subject() == &kRange);
  CHECK(about.begins_with_subject());
  const Message later = "no memory; give a larger " + Message(kMemory);
  CHECK(later.subject() == &kMemory);
  CHECK_FALSE(later.begins_with_subject());
  CHECK_FALSE(Message().begins_with_subject());
}

TEST_CASE("bytes_text: whole MiB as a user types them, all else exactly") {
  CHECK(bytes_text(0).text() == "0 bytes");
  CHECK(bytes_text(100).text() == "100 bytes");
  CHECK(bytes_text(std::size_t{1} << 30U).text() == "1024M");
  CHECK(bytes_text((1U << 20U) + 1).text() == "1048577 bytes");
}

}  // namespace
}  // namespace tessera
