// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/config_file.hpp"

#include <catch2/catch.hpp>

#include "sample_options.hpp"

namespace tessera {
namespace {

ConfigFile parsed(std::string_view text) {
  Outcome<ConfigFile> file = ConfigFile::parse(text, "folder/node.toml");
  REQUIRE(file.ok());
  return *file;
}

std::string said(const Outcome<void>& outcome) {
  return outcome.ok() ? "" : outcome.failure().text();
}

/// What is refused; empty: nothing.
std::string refused(std::string_view text) {
  ConfigFile file = parsed(text);
  SampleOptions options;
  file.read(kSample, options);
  return said(file.finish());
}

TEST_CASE("ConfigFile: a key that is given replaces the default, one that is not leaves it") {
  ConfigFile file = parsed(
      "[a]\nwhole = 3\nreal_m = 2\non = true\ncell_m = 'off'\n"
      "[b]\ntext = 'x'\nlist = [1, 2]\nreals = [1, 0.5]\nside = 'right'\nbytes = '1M'\n");
  SampleOptions options;
  file.read(kSample, options);
  REQUIRE(said(file.finish()).empty());
  CHECK(options.whole == 3);
  CHECK(options.real_m == Approx(2.0));
  CHECK(options.on);
  CHECK(options.cell_m == Approx(0.0));
  CHECK(options.text == "x");
  CHECK(options.list == std::vector<std::uint32_t>{1, 2});
  CHECK(options.reals == std::vector<double>{1.0, 0.5});
  CHECK(options.side == Side::kRight);
  CHECK(options.bytes == 1U << 20U);
  CHECK(options.way == "near");
  CHECK_FALSE(options.maybe);
  CHECK(file.values()["b"]["way"] == "near");
  CHECK(file.values()["a"]["on"] == true);
}

TEST_CASE("ConfigFile: what nobody asks for is refused with the nearest name") {
  CHECK(refused("[a]\nwhole = 2\nwhoel = 2\n") ==
        "folder/node.toml, line 3: unknown key whoel in [a]; did you mean whole?");
  CHECK(refused("\n[c]\n") == "folder/node.toml, line 2: unknown table [c]; did you mean [a]?");
  CHECK(refused("[b]\nwhole = 2\n") ==
        "folder/node.toml, line 2: unknown key whole in [b]; it is in [a]");
}

TEST_CASE("ConfigFile: a value of another type or out of its range is refused with its line") {
  CHECK(refused("[a]\n\nwhole = 1\n") ==
        "folder/node.toml, line 3: [a] whole: 1 is not allowed; give a whole number from 2 to 9");
  for (const char* const text :
       {"whole = 10", "whole = 2.0", "whole = 'x'", "real_m = 9.1", "real_m = nan", "real_m = 'x'",
        "on = 1", "on = 'true'", "cell_m = 'on'", "cell_m = true", "cell_m = 0.1"}) {
    INFO(text);
    CHECK_THAT(refused("[a]\n" + std::string(text)),
               Catch::StartsWith("folder/node.toml, line 2: [a] "));
  }
  for (const char* const text :
       {"side = 'up'", "side = 1", "way = 'up'", "bytes = 'many'", "bytes = -1", "bytes = 1.5",
        "list = 3", "list = [-1]", "list = [9007199254740993]", "list = [4294967296]",
        "list = [0.5]", "reals = 1", "reals = '1'", "text = 3", "path = true", "deep = -1"}) {
    INFO(text);
    CHECK_THAT(refused("[b]\n" + std::string(text)),
               Catch::StartsWith("folder/node.toml, line 2: [b] "));
  }
}

TEST_CASE("ConfigPlaces: a failure is about the line of the setting that it names first") {
  const ConfigFile file = parsed("[a]\nreal_m = 3\n\nwhole = 5\n");
  const auto worded = [&file](const Message& message) {
    return file.places().worded({message}).text();
  };
  CHECK(worded(Message(kSample["--whole"]) + " is more than " + kSample["--real"]) ==
        "folder/node.toml, line 4: [a] whole: is more than real_m");
  CHECK(worded("too many; give a smaller " + Message(kSample["--real"])) ==
        "folder/node.toml, line 2: [a] real_m: too many; give a smaller real_m");
  CHECK(worded(Message(kSample["--cell"]) + " is missing") ==
        "folder/node.toml, line 1: [a] cell_m: is missing");
  CHECK(worded(Message(kSample["--side"]) + " is missing") ==
        "folder/node.toml: [b] side: is missing");
  CHECK(worded("no route to the group") == "no route to the group");
}

TEST_CASE("ConfigFile: an array of tables gives options for each, and errors the line of theirs") {
  struct Item {
    std::string file;
    double weight = 0.5;
  };
  static constexpr Setting kRows[] = {
      path_row<&Item::file>({.table = "items", .key = "file"}, "", {.required = "a file"}),
      row<&Item::weight>({.table = "items", .key = "weight"}, "", {.allowed = from_to(0.0, 1.0)}),
  };
  constexpr SettingTable<Item> kItems{kRows};
  std::vector<Item> items;
  const auto refused_items = [&](std::string_view text) {
    ConfigFile file = parsed(text);
    SampleOptions options;
    items.clear();
    file.read(kSample, options);
    file.read_all(kItems, items);
    CHECK(file.values()["items"].size() == items.size());
    return said(file.finish());
  };
  CHECK(refused_items("[a]\nwhole = 3\n").empty());
  CHECK(items.empty());
  CHECK(refused_items("[[items]]\nfile = 'a.tsm'\n[a]\nwhole = 3\n[[items]]\nfile = '/b.tsm'\n"
                      "weight = 0.25\n")
            .empty());
  REQUIRE(items.size() == 2);
  CHECK(items[0].file == "folder/a.tsm");
  CHECK(items[0].weight == 0.5);
  CHECK(items[1].file == "/b.tsm");
  CHECK(items[1].weight == 0.25);
  CHECK(refused_items("[[items]]\nfile = 'a.tsm'\n[[items]]\nweight = 1\n") ==
        "folder/node.toml, line 3: [items] file: is missing; give a file");
  CHECK(refused_items("[[items]]\nfile = 'a'\n\n[[items]]\nfile = 'b'\nweight = 2\n") ==
        "folder/node.toml, line 6: [items] weight: 2 is not allowed; give a number from 0 to 1");
  CHECK(refused_items("[[items]]\nfile = 'a'\nwieght = 1\n") ==
        "folder/node.toml, line 3: unknown key wieght in [items]; did you mean weight?");
  CHECK(refused_items("[items]\nfile = 'a'\n") ==
        "folder/node.toml, line 1: [items] is written as [[items]]");
  CHECK(refused_items("[[a]]\nwhole = 3\n") == "folder/node.toml, line 1: [[a]] is written as [a]");
  CHECK(refused_items("[[c]]\n") ==
        "folder/node.toml, line 1: unknown table [c]; did you mean [a]?");
}

TEST_CASE("ConfigFile: text that is no such file is refused") {
  for (const char* const text : {"[a", "a = 1", "[a.b]\nc = 1", "[a]\nb = ['x']",
                                 "[a]\nb = 1979-05-27", "[a]\nb = 1\nb = 2"}) {
    INFO(text);
    const Outcome<ConfigFile> file = ConfigFile::parse(text, "node.toml");
    REQUIRE_FALSE(file.ok());
    CHECK(file.failure().text().starts_with("node.toml, line "));
    CHECK(file.failure().kind == FailureKind::kUsage);
  }
}

TEST_CASE("ConfigFile: paths are relative to the file, and what is required is asked for") {
  struct Paths {
    std::string one, two, three;
  };
  static constexpr Setting kRows[] = {
      path_row<&Paths::one>({.table = "a", .key = "one"}, ""),
      path_row<&Paths::two>({.table = "a", .key = "two"}, ""),
      row<&Paths::three>({.table = "a", .key = "three"}, "", {.required = "a file"}),
  };
  ConfigFile file = parsed("[a]\none = 'maps/one.tsm'\ntwo = '/maps/two.tsm'\n");
  Paths paths;
  file.read(SettingTable<Paths>(kRows), paths);
  CHECK(paths.one == "folder/maps/one.tsm");
  CHECK(paths.two == "/maps/two.tsm");
  CHECK(said(file.finish()) == "folder/node.toml, line 1: [a] three: is missing; give a file");
}

}  // namespace
}  // namespace tessera
