// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a person sees: a bar that is redrawn in place on a terminal, a few lines in a log.
#include "base/progress.hpp"

#include <poll.h>
#include <pty.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <optional>
#include <stdexcept>
#include <string>

#include "base/file_descriptor.hpp"
#include "base/monotonic_clock.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

/// Two ends of a pipe or of a pseudo terminal: what is written to one is read from the other.
class Screen {
 public:
  static Screen pipe() {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
    return Screen(ends[0], ends[1]);
  }
  static Screen terminal(unsigned short columns) {
    ::setenv("TERM", "xterm", 1);
    int ends[2];
    winsize size{};
    size.ws_col = columns;
    size.ws_row = 25;
    if (::openpty(&ends[0], &ends[1], nullptr, nullptr, &size) != 0) {
      throw std::runtime_error("no pseudo terminal");
    }
    return Screen(ends[0], ends[1]);
  }

  [[nodiscard]] int descriptor() const { return write_end_.get(); }
  /// What was written since the last call; there must be something.
  [[nodiscard]] std::string shown() const {
    std::string text;
    // A pseudo terminal hands its content over in pieces, some of them a little later.
    int patience_ms = 2000;
    pollfd readable{read_end_.get(), POLLIN, 0};
    while (::poll(&readable, 1, patience_ms) > 0) {
      char piece[4096];
      const ssize_t count = ::read(read_end_.get(), piece, sizeof piece);
      if (count <= 0) break;
      text.append(piece, static_cast<std::size_t>(count));
      patience_ms = 50;
    }
    return text;
  }

 private:
  Screen(int read_end, int write_end) : read_end_(read_end), write_end_(write_end) {}
  FileDescriptor read_end_;
  FileDescriptor write_end_;
};

std::ptrdiff_t count_of(const std::string& text, char c) {
  return std::count(text.begin(), text.end(), c);
}

TEST_CASE("Progress: without a terminal, a plain line for each tenth of the work") {
  const Screen screen = Screen::pipe();
  Progress progress("map", 271, screen.descriptor());
  for (std::uint64_t done = 1; done <= 271; ++done) progress.update(done, "12.3 ms/scan");
  progress.finish();
  const std::string text = screen.shown();
  CHECK(count_of(text, '\n') == 10);
  CHECK(count_of(text, '\r') == 0);
  CHECK_THAT(text, StartsWith("map: 10 %, 28/271, 0:00 elapsed, 0:00 left, 12.3 ms/scan\n"));
  CHECK_THAT(text, Contains("map: 100 %, 271/271, 0:00 elapsed, 12.3 ms/scan\n"));
}

TEST_CASE("Progress: few steps give few lines, and the end is shown once") {
  const Screen screen = Screen::pipe();
  Progress progress("map", 3, screen.descriptor());
  for (std::uint64_t done = 1; done <= 3; ++done) progress.update(done);
  progress.finish();
  progress.finish();
  CHECK(count_of(screen.shown(), '\n') == 3);
}

TEST_CASE("Progress: ending early shows how far it came") {
  const Screen screen = Screen::pipe();
  Progress progress("map", 100, screen.descriptor());
  progress.update(45);
  progress.update(47);
  progress.finish();
  CHECK_THAT(screen.shown(), Contains("45/100") && Contains("47/100"));
}

TEST_CASE("Progress: work without an end shows how much is done, and no share or rest of it") {
  const Screen screen = Screen::pipe();
  Progress progress("scans mapped", Progress::kEndless, screen.descriptor());
  for (std::uint64_t done = 1; done <= 271; ++done) progress.update(done, "one of two");
  progress.finish();
  CHECK(screen.shown() == "scans mapped: 271 done, 0:00 elapsed, one of two\n");
}

TEST_CASE("Progress: no work at all is complete") {
  const Screen screen = Screen::pipe();
  Progress progress("map", 0, screen.descriptor());
  progress.finish();
  CHECK_THAT(screen.shown(), StartsWith("map: 100 %, 0/0"));
}

TEST_CASE("Progress: on a terminal, one line, redrawn at most ten times a second") {
  const Screen screen = Screen::terminal(80);
  const std::int64_t start_us = MonotonicClock::now_us();
  Progress progress("map", 100000, screen.descriptor());
  for (std::uint64_t done = 1; done <= 100000; ++done) progress.update(done);
  progress.finish();
  const std::int64_t tenths = (MonotonicClock::now_us() - start_us) / 100'000;
  const std::string text = screen.shown();
  // The terminal's driver turns the one line feed at the end into two characters.
  CHECK(count_of(text, '\n') == 1);
  CHECK(count_of(text, '[') >= 2);
  CHECK(count_of(text, '%') <= tenths + 2);
  CHECK_THAT(text, Contains("\rmap [####") && Contains("100 %  100000/100000  0:0"));
}

TEST_CASE("Progress: a terminal that cannot redraw gets plain lines") {
  const Screen screen = Screen::terminal(80);
  ::setenv("TERM", "dumb", 1);
  Progress progress("map", 100, screen.descriptor());
  progress.update(10);
  CHECK_THAT(screen.shown(), StartsWith("map: 10 %, 10/100"));
}

TEST_CASE("Progress: a line never reaches the terminal's last column, however narrow it is") {
  const auto columns = GENERATE(as<unsigned short>(), 1, 10, 30, 50, 80, 200, 1000);
  const Screen screen = Screen::terminal(columns);
  {
    Progress progress("a rather long label", 100, screen.descriptor());
    progress.update(50, "and a suffix of some length");
  }
  std::string text = screen.shown();
  const std::size_t end = text.find("\x1b[K");
  REQUIRE(end != std::string::npos);
  CHECK(end - 1 < columns);  // Without the carriage return.
}

TEST_CASE("Progress: a note clears the bar, stands on its own line, and the bar comes back") {
  const Screen screen = Screen::terminal(80);
  Progress progress("map", 100, screen.descriptor());
  progress.update(10);
  static_cast<void>(screen.shown());
  progress.note("warning: 3 points left out");
  CHECK_THAT(screen.shown(), StartsWith("\r\x1b[Kwarning: 3 points left out\r\n"));
  progress.update(11);
  CHECK_THAT(screen.shown(), Contains("11/100"));
}

TEST_CASE("Progress: an unfinished bar leaves the next line to others") {
  const Screen screen = Screen::terminal(80);
  { Progress("map", 100, screen.descriptor()).update(10); }
  CHECK_THAT(screen.shown(), Catch::Matchers::EndsWith("\n"));
}

TEST_CASE("Progress: labels and suffixes of any length are cut, not overrun") {
  const Screen screen = Screen::pipe();
  Progress progress(std::string(500, 'l'), 1, screen.descriptor());
  progress.update(1, std::string(500, 's'));
  const std::string text = screen.shown();
  CHECK(count_of(text, 'l') <= 32 + 1);  // One more in "elapsed".
  CHECK_THAT(text, Catch::Matchers::EndsWith(std::string(47, 's') + "\n"));
}

}  // namespace
}  // namespace tessera
