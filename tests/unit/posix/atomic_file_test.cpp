// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What AtomicFile promises: all or nothing under the final name, and sentences that help.
#include "base/atomic_file.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <optional>
#include <utility>

#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::TemporaryFolder;

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

/// Writing beyond the limit fails with EFBIG while one of these lives.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t limit_bytes) : handler_before_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limited = before_;
    limited.rlim_cur = limit_bytes;
    ::setrlimit(RLIMIT_FSIZE, &limited);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    static_cast<void>(std::signal(SIGXFSZ, handler_before_));
  }

 private:
  rlimit before_{};
  void (*handler_before_)(int);
};

TEST_CASE("AtomicFile: the content is there after commit and nothing else") {
  const TemporaryFolder folder;
  Outcome<AtomicFile> file = AtomicFile::open(folder.file("a.tsm"));
  REQUIRE(file.ok());
  CHECK(file->write(bytes_of("hello ")));
  CHECK(file->write(bytes_of("world")));
  REQUIRE(file->commit().ok());
  CHECK(folder.read("a.tsm") == "hello world");
  CHECK(folder.num_entries() == 1);
}

TEST_CASE("AtomicFile: a process that is killed leaves nothing") {
  const TemporaryFolder folder;
  const int unnamed = ::open(folder.path().c_str(), O_TMPFILE | O_WRONLY, 0600);
  if (unnamed < 0) {
    WARN("skipped: this file system has no files without names");
    return;
  }
  ::close(unnamed);
  const pid_t child = ::fork();
  if (child == 0) {
    Outcome<AtomicFile> file = AtomicFile::open(folder.file("a.tsm"));
    const std::string much(200000, 'x');
    const bool written = file.ok() && file->write(bytes_of(much));
    ::_exit(written ? 0 : 1);  // No destructors, as after a signal.
  }
  int status = -1;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK(status == 0);
  CHECK(folder.num_entries() == 0);
}

TEST_CASE("AtomicFile: pieces of any size arrive whole and in order") {
  const TemporaryFolder folder;
  Outcome<AtomicFile> file = AtomicFile::open(folder.file("a"));
  REQUIRE(file.ok());
  std::string expected;
  for (const std::size_t size : {0U, 1U, 65535U, 1U, 65536U, 65537U, 3U, 300000U, 7U}) {
    const std::string piece(size, static_cast<char>('a' + expected.size() % 26));
    CHECK(file->write(bytes_of(piece)));
    expected += piece;
  }
  REQUIRE(file->commit().ok());
  CHECK(folder.read("a") == expected);
}

TEST_CASE("AtomicFile: without commit the target stays as it was and the temporary is removed") {
  const TemporaryFolder folder;
  folder.write("a", "before");
  {
    Outcome<AtomicFile> file = AtomicFile::open(folder.file("a"));
    REQUIRE(file.ok());
    file->write(bytes_of(std::string(100000, 'x')));
    CHECK(folder.read("a") == "before");
  }
  CHECK(folder.read("a") == "before");
  CHECK(folder.num_entries() == 1);
}

TEST_CASE("AtomicFile: a moved file is committed once, by its last owner") {
  const TemporaryFolder folder;
  Outcome<AtomicFile> first = AtomicFile::open(folder.file("a"));
  Outcome<AtomicFile> second = AtomicFile::open(folder.file("b"));
  REQUIRE((first.ok() && second.ok()));
  first->write(bytes_of("one"));
  second->write(bytes_of("two"));
  *second = std::move(*first);
  REQUIRE(second->commit().ok());
  CHECK(folder.read("a") == "one");
  CHECK(folder.num_entries() == 1);
}

TEST_CASE("AtomicFile: two writers of one target do not disturb each other, the last commit wins") {
  const TemporaryFolder folder;
  Outcome<AtomicFile> first = AtomicFile::open(folder.file("a"));
  Outcome<AtomicFile> second = AtomicFile::open(folder.file("a"));
  REQUIRE((first.ok() && second.ok()));
  first->write(bytes_of("one"));
  second->write(bytes_of("two"));
  REQUIRE(second->commit().ok());
  CHECK(folder.read("a") == "two");
  REQUIRE(first->commit().ok());
  CHECK(folder.read("a") == "one");
}

TEST_CASE("AtomicFile: a replaced file keeps its permissions") {
  const TemporaryFolder folder;
  folder.write("a", "before");
  REQUIRE(::chmod(folder.file("a").c_str(), 0640) == 0);
  Outcome<AtomicFile> file = AtomicFile::open(folder.file("a"));
  REQUIRE((file.ok() && file->commit().ok()));
  struct stat status {};
  REQUIRE(::stat(folder.file("a").c_str(), &status) == 0);
  CHECK((status.st_mode & 07777U) == 0640);
}

TEST_CASE("AtomicFile: through a symbolic link the file that it names is replaced") {
  const TemporaryFolder folder;
  folder.write("real", "before");
  std::filesystem::create_symlink("real", folder.file("link"));
  Outcome<AtomicFile> file = AtomicFile::open(folder.file("link"));
  REQUIRE(file.ok());
  file->write(bytes_of("after"));
  REQUIRE(file->commit().ok());
  CHECK(std::filesystem::is_symlink(folder.file("link")));
  CHECK(folder.read("real") == "after");
}

TEST_CASE("AtomicFile: a missing folder is refused by name and with a remedy") {
  const TemporaryFolder folder;
  const Outcome<AtomicFile> file = AtomicFile::open(folder.file("no/such/a.tsm"));
  REQUIRE_FALSE(file.ok());
  CHECK(file.failure().kind == FailureKind::kUsage);
  CHECK_THAT(file.failure().text(), Contains("no/such/a.tsm") && Contains("create it"));
}

TEST_CASE("AtomicFile: a folder, a device and an empty name are no targets") {
  const TemporaryFolder folder;
  CHECK_THAT(AtomicFile::open(folder.path().string()).failure().text(),
             Contains(folder.path().string()) && Contains("name a file in it"));
  CHECK_THAT(AtomicFile::open("/dev/null").failure().text(),
             Contains("/dev/null") && Contains("choose another name"));
  CHECK_THAT(AtomicFile::open("").failure().text(), Contains("name a file"));
}

TEST_CASE("AtomicFile: a failed write is remembered, reported by commit, and leaves nothing") {
  const TemporaryFolder folder;
  folder.write("a", "before");
  Outcome<AtomicFile> file = AtomicFile::open(folder.file("a"));
  REQUIRE(file.ok());
  {
    const FileSizeLimit limit(100000);
    CHECK_FALSE(file->write(bytes_of(std::string(200000, 'x'))));
  }
  CHECK_FALSE(file->write(bytes_of("later")));
  const Outcome<void> committed = file->commit();
  REQUIRE_FALSE(committed.ok());
  CHECK(committed.failure().kind == FailureKind::kFailure);
  CHECK_THAT(committed.failure().text(),
             Contains(folder.file("a")) && Contains("File too large") && Contains("ulimit -f"));
  CHECK(folder.read("a") == "before");
  CHECK(folder.num_entries() == 1);
  CHECK_FALSE(file->commit().ok());
}

TEST_CASE("AtomicFile: a failure that shows only when flushing is reported by commit") {
  const TemporaryFolder folder;
  Outcome<AtomicFile> file = AtomicFile::open(folder.file("a"));
  REQUIRE(file.ok());
  CHECK(file->write(bytes_of(std::string(1000, 'x'))));
  {
    const FileSizeLimit limit(10);
    CHECK_FALSE(file->commit().ok());
  }
  CHECK(folder.num_entries() == 0);
}

TEST_CASE("AtomicFile: a folder that vanished before commit is a failure with its name") {
  const TemporaryFolder folder;
  folder.write("sub/x", "");
  Outcome<AtomicFile> file = AtomicFile::open(folder.file("sub/a"));
  REQUIRE(file.ok());
  std::filesystem::remove_all(folder.file("sub"));
  const Outcome<void> committed = file->commit();
  REQUIRE_FALSE(committed.ok());
  CHECK_THAT(committed.failure().text(), Contains("sub/a") && Contains("check the name"));
}

TEST_CASE("AtomicFile: a second commit says that the file is complete") {
  const TemporaryFolder folder;
  Outcome<AtomicFile> file = AtomicFile::open(folder.file("a"));
  REQUIRE((file.ok() && file->commit().ok()));
  CHECK_FALSE(file->write(bytes_of("more")));
  CHECK_THAT(file->commit().failure().text(), Contains("already complete"));
  CHECK(folder.read("a").empty());
}

}  // namespace
}  // namespace tessera
