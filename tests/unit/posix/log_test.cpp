// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Lines as people read them, and what becomes of those that there is no room or time for.
#include "base/log.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <string>

#include "base/file_descriptor.hpp"

namespace tessera {
namespace {

/// A pipe that is written to and read at once.
struct Pipe {
  Pipe() {
    std::array<int, 2> ends{};
    REQUIRE(::pipe(ends.data()) == 0);
    from = FileDescriptor(ends[0]);
    to = FileDescriptor(ends[1]);
  }
  std::string read() {
    std::array<char, 1 << 16> text{};
    const ssize_t size = ::read(from.get(), text.data(), text.size());
    REQUIRE(size > 0);
    return {text.data(), static_cast<std::size_t>(size)};
  }
  FileDescriptor from;
  FileDescriptor to;
};

void write(LogWriter& writer, LogQueue& queue) {
  LogQueue* const queues[] = {&queue};
  writer.write(queues);
}

TEST_CASE("log: a line has its thread, its level and its numbers") {
  Pipe pipe;
  LogWriter writer(pipe.to.get(), false);
  LogQueue queue("mapping");
  CHECK(queue.say(LogLevel::kInfo, 0, "cycle of % ms, budget % ms", 104, -3));
  CHECK(queue.say(LogLevel::kWarning, 0, "no scan for % ms", 300));
  CHECK(queue.say(LogLevel::kError, 0, "100 % of % % %", 1, 2, 3));
  write(writer, queue);
  CHECK(pipe.read() ==
        "mapping: cycle of 104 ms, budget -3 ms\n"
        "mapping: warning: no scan for 300 ms\n"
        "mapping: error: 100 1 of 2 3 %\n");
  CHECK(writer.lines() == 3);
}

TEST_CASE("log: for the journal each line begins with its level") {
  Pipe pipe;
  LogWriter writer(pipe.to.get(), true);
  LogQueue queue("can");
  queue.say(LogLevel::kWarning, 0, "bus off");
  write(writer, queue);
  CHECK(pipe.read() == "<4>can: warning: bus off\n");
}

TEST_CASE("log: a text that is said over and over is written once a second, with its number") {
  Pipe pipe;
  LogWriter writer(pipe.to.get(), false);
  LogQueue queue("can");
  static const char* const text = "frame refused";
  for (std::int64_t i = 0; i < 100; ++i) queue.say(LogLevel::kWarning, 5000 + i, text);
  queue.say(LogLevel::kWarning, 5000 + LogWriter::kQuiet_us, text);
  write(writer, queue);
  CHECK(pipe.read() ==
        "can: warning: frame refused\n"
        "can: warning: frame refused (99 more of these before)\n");
}

TEST_CASE("log: what there is no room for is counted and said") {
  Pipe pipe;
  LogWriter writer(pipe.to.get(), false);
  LogQueue queue("link", 2);
  static const std::array<const char*, 4> texts{"one", "two", "three", "four"};
  int taken = 0;
  for (const char* const text : texts) taken += queue.say(LogLevel::kInfo, 0, text) ? 1 : 0;
  CHECK(taken == 2);
  CHECK(queue.lost() == 2);
  write(writer, queue);
  CHECK(pipe.read() ==
        "link: one\nlink: two\nlink: warning: 2 messages lost, as the queue was full\n");
}

TEST_CASE("log: a line ends after 255 bytes") {
  Pipe pipe;
  LogWriter writer(pipe.to.get(), false);
  LogQueue queue("link");
  static const std::string text(400, 'x');
  queue.say(LogLevel::kInfo, 0, text.c_str());
  write(writer, queue);
  CHECK(pipe.read() == "link: " + std::string(249, 'x') + "\n");
}

TEST_CASE("log: where nobody reads any more, nothing waits and nothing ends") {
  Pipe pipe;
  pipe.to = FileDescriptor(::open("/dev/full", 1));
  LogWriter writer(pipe.to.get(), false);
  LogQueue queue("link");
  queue.say(LogLevel::kInfo, 0, "lost");
  write(writer, queue);
  CHECK(writer.lines() == 0);
}

}  // namespace
}  // namespace tessera
