// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/config_file.hpp"

#include <catch2/catch.hpp>

namespace tessera {
namespace {

ConfigFile parsed(std::string_view text) {
  Outcome<ConfigFile> file = ConfigFile::parse(text, "folder/node.toml");
  REQUIRE(file.ok());
  return *file;
}

std::string said(const Outcome<void>& outcome) {
  return outcome.ok() ? "" : outcome.failure().message;
}

TEST_CASE("ConfigFile: a key that is given replaces the default, one that is not leaves it") {
  ConfigFile file = parsed("[a]\nwhole = 3\nreal = 2\nyes = true\ntext = 'x'\nlist = [1, 2]\n");
  std::uint32_t whole = 1, other = 7;
  double real = 1.5;
  bool yes = false;
  std::string text;
  std::vector<std::uint32_t> list;
  file.take({"a", "whole"}, whole, {0, 9});
  file.take({"a", "other"}, other, {0, 9});
  file.take({"a", "real"}, real, ConfigFile::Real{0.0, 9.0});
  file.take({"a", "yes"}, yes);
  file.take({"a", "text"}, text);
  file.take({"a", "list"}, list);
  REQUIRE(said(file.finish()).empty());
  CHECK(whole == 3);
  CHECK(other == 7);
  CHECK(real == Approx(2.0));
  CHECK(yes);
  CHECK(text == "x");
  CHECK(list == std::vector<std::uint32_t>{1, 2});
  CHECK(file.values()["a"]["other"] == 7);
}

TEST_CASE("ConfigFile: what nobody asks for is refused with the nearest name") {
  double rate = 1.0;
  const auto refused = [&](std::string_view text) {
    ConfigFile file = parsed(text);
    file.take({"replay", "rate_hz"}, rate, ConfigFile::Real{0.0, 9.0});
    file.take({"replay", "first"}, rate, ConfigFile::Real{0.0, 9.0});
    file.take({"run", "tick_ms"}, rate, ConfigFile::Real{0.0, 9.0});
    return said(file.finish());
  };
  CHECK(refused("[replay]\nrate_hz = 1\nrtae_hz = 1\n") ==
        "folder/node.toml, line 3: unknown key rtae_hz in [replay]; did you mean rate_hz?");
  CHECK(refused("\n[repaly]\n") ==
        "folder/node.toml, line 2: unknown table [repaly]; did you mean [replay]?");
  CHECK(refused("[run]\nrate_hz = 1\n") ==
        "folder/node.toml, line 2: unknown key rate_hz in [run]; it is in [replay]");
}

TEST_CASE("ConfigFile: a value of another type or out of its range is refused with its line") {
  const auto refused = [&](std::string_view text) {
    ConfigFile file = parsed(text);
    std::uint32_t whole = 1;
    double real = 1.5;
    bool yes = false;
    std::string name = "left";
    std::size_t bytes = 1;
    std::string number;
    file.take({"a", "whole"}, whole, {2, 9});
    file.take({"a", "real"}, real, ConfigFile::Real{0.0, 9.0});
    file.take({"a", "yes"}, yes);
    file.take({"a", "name"}, name, {"left", "right"});
    file.take_bytes({"a", "bytes"}, bytes);
    file.take_number_or({"a", "number"}, number, "off");
    return said(file.finish());
  };
  CHECK(
      refused("[a]\nwhole = 2\nreal = 9\nyes = true\nname = 'right'\nbytes = '1K'\nnumber = 'off'")
          .empty());
  CHECK(refused("[a]\n\nwhole = 1\n") ==
        "folder/node.toml, line 3: [a] whole: 1 is not allowed; give a whole number from 2 to 9");
  for (const char* const text :
       {"whole = 10", "whole = 2.0", "whole = 'x'", "real = 9.1", "real = nan", "real = 'x'",
        "yes = 1", "yes = 'true'", "name = 'up'", "name = 1", "bytes = 'many'", "bytes = -1",
        "bytes = 1.5", "number = 'on'", "number = true"}) {
    INFO(text);
    CHECK_THAT(refused("[a]\n" + std::string(text)),
               Catch::StartsWith("folder/node.toml, line 2: [a] "));
  }
}

TEST_CASE("ConfigFile: text that is no such file is refused") {
  for (const char* const text : {"[a", "a = 1", "[a.b]\nc = 1", "[a]\nb = ['x']",
                                 "[a]\nb = 1979-05-27", "[a]\nb = 1\nb = 2"}) {
    INFO(text);
    const Outcome<ConfigFile> file = ConfigFile::parse(text, "node.toml");
    REQUIRE_FALSE(file.ok());
    CHECK(file.failure().message.starts_with("node.toml, line "));
    CHECK(file.failure().kind == FailureKind::kUsage);
  }
}

TEST_CASE("ConfigFile: paths are relative to the file, and what is required is asked for") {
  ConfigFile file = parsed("[a]\npath = 'maps/one.tsm'\nwhole = '/maps/two.tsm'\n");
  std::string path, whole, other;
  file.take_path({"a", "path"}, path);
  file.take_path({"a", "whole"}, whole);
  CHECK(path == "folder/maps/one.tsm");
  CHECK(whole == "/maps/two.tsm");
  file.require({"a", "other"}, "a file");
  file.take_path({"a", "other"}, other);
  CHECK(said(file.finish()) == "folder/node.toml, line 1: [a] other: is missing; give a file");
}

}  // namespace
}  // namespace tessera
