// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What InputFile promises: at most the caller's span, and a sentence for whatever goes wrong.
#include "base/input_file.hpp"

#include <sys/stat.h>

#include <catch2/catch.hpp>

#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::TemporaryFolder;

TEST_CASE("InputFile: consecutive reads continue, and the last one is short") {
  const TemporaryFolder folder;
  folder.write("a", "0123456789");
  Outcome<InputFile> file = InputFile::open(folder.file("a"));
  REQUIRE(file.ok());
  CHECK(file->size_bytes() == 10);
  CHECK(file->path() == folder.file("a"));
  std::string text(6, '?');
  CHECK(*file->read(std::as_writable_bytes(std::span(text))) == 6);
  CHECK(text == "012345");
  CHECK(*file->read(std::as_writable_bytes(std::span(text))) == 4);
  CHECK(text == "678945");
}

TEST_CASE("InputFile: an empty file has size 0 and reads nothing") {
  const TemporaryFolder folder;
  folder.write("a", "");
  Outcome<InputFile> file = InputFile::open(folder.file("a"));
  REQUIRE(file.ok());
  CHECK(file->size_bytes() == 0);
  CHECK(file->read_exactly({}).ok());
}

TEST_CASE("InputFile: read_exactly refuses a file that ends too early, with the counts") {
  const TemporaryFolder folder;
  folder.write("a", "0123456789");
  Outcome<InputFile> file = InputFile::open(folder.file("a"));
  REQUIRE(file.ok());
  std::string text(16, '?');
  const Outcome<void> read = file->read_exactly(std::as_writable_bytes(std::span(text)));
  REQUIRE_FALSE(read.ok());
  CHECK(read.failure().kind == FailureKind::kFailure);
  CHECK_THAT(read.failure().text(), Contains(folder.file("a")) && Contains("after 10 bytes") &&
                                        Contains("by 6") && Contains("complete copy"));
}

TEST_CASE("InputFile: a missing file, a folder, a pipe and an endless name are refused") {
  const TemporaryFolder folder;
  const Outcome<InputFile> missing = InputFile::open(folder.file("no"));
  REQUIRE_FALSE(missing.ok());
  CHECK(missing.failure().kind == FailureKind::kUsage);
  CHECK_THAT(missing.failure().text(), Contains(folder.file("no")) && Contains("check the name"));
  CHECK_THAT(InputFile::open(folder.path().string()).failure().text(), Contains("it is a folder"));
  REQUIRE(::mkfifo(folder.file("pipe").c_str(), 0600) == 0);
  CHECK_THAT(InputFile::open(folder.file("pipe")).failure().text(),
             Contains("pipe") && Contains("not a regular file"));
  CHECK_THAT(InputFile::open(std::string(5000, 'x')).failure().text(), Contains("shorter path"));
}

TEST_CASE("read_text_file: the whole content, up to a limit") {
  const TemporaryFolder folder;
  folder.write("a", "ten bytes!");
  CHECK(*read_text_file(folder.file("a"), 10) == "ten bytes!");
  folder.write("marked",
               "\xef\xbb\xbf"
               "1 2\n\xef\xbb\xbf");
  CHECK(*read_text_file(folder.file("marked"), 10) == "1 2\n\xef\xbb\xbf");
  const Outcome<std::string> refused = read_text_file(folder.file("a"), 9);
  REQUIRE_FALSE(refused.ok());
  CHECK_THAT(refused.failure().text(),
             Contains(folder.file("a")) && Contains("10 bytes") && Contains("limit is 9"));
  CHECK_FALSE(read_text_file(folder.file("no"), 9).ok());
}

}  // namespace
}  // namespace tessera
