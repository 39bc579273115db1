// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/setting.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "sample_options.hpp"

namespace tessera {
namespace {

/// What is refused; empty: the option has taken the text.
std::string given(SampleOptions& options, std::string_view option, const std::string& text) {
  const Setting& row = sample_row(option);
  const Outcome<SettingValue> value = parse_value(row, text);
  if (!value.ok()) return value.failure().text();
  const Outcome<void> done = assign(row, &options, *value);
  return done.ok() ? "" : done.failure().text();
}

TEST_CASE("Setting: a value that is given as text reaches its member in its own type") {
  SampleOptions options;
  for (const auto& [option, text] : {std::pair{"--on", "on"},
                                     {"--real", "2.5"},
                                     {"--cell", "off"},
                                     {"--whole", "9"},
                                     {"--maybe", "-3"},
                                     {"--bytes", "2K"},
                                     {"--side", "right"},
                                     {"--way", "far"},
                                     {"--text", "any thing"},
                                     {"--path", "folder/file"},
                                     {"--reals", "-0.5,1e2,3"},
                                     {"--deep", "12"}}) {
    INFO(option);
    CHECK(given(options, option, text).empty());
  }
  CHECK(options.on);
  CHECK(options.real_m == Approx(2.5));
  CHECK(options.cell_m == Approx(0.0));
  CHECK(options.whole == 9);
  CHECK(options.maybe == -3);
  CHECK(options.bytes == 2048);
  CHECK(options.side == Side::kRight);
  CHECK(options.way == "far");
  CHECK(options.text == "any thing");
  CHECK(options.path == "folder/file");
  CHECK(options.reals == std::vector<double>{-0.5, 100.0, 3.0});
  CHECK(options.inner.deep == 12);
}

TEST_CASE("Setting: a list of numbers has a comma between each two, and no other character") {
  SampleOptions options;
  for (const char* const text : {"", ",", "1,", ",1", "1,,2", "1 2", "1, 2", "1;2", "x", "1,2x"}) {
    INFO(text);
    CHECK_THAT(given(options, "--reals", text),
               Catch::EndsWith("is not allowed; give numbers with commas between them"));
  }
  CHECK(options.reals.empty());
  const Setting& row = sample_row("--reals");
  REQUIRE(assign(row, &options, std::vector<double>{0.25, -4.0}).ok());
  CHECK(text_of(row, row.member.get(&options)) == "0.25,-4");
  CHECK(json_of(row, &options) == Json({0.25, -4.0}));
  CHECK_FALSE(assign(row, &options, 3.0).ok());
}

TEST_CASE("Setting: what is not allowed is refused with the setting, the value and the range") {
  SampleOptions options;
  CHECK(given(options, "--on", "yes") == "--on yes is not allowed; give on or off");
  CHECK(given(options, "--real", "9.5") == "--real 9.5 is not allowed; give metres from 0 to 9");
  CHECK(given(options, "--cell", "0.2") ==
        "--cell 0.2 is not allowed; give metres from 0.5 to 2, or off");
  CHECK(given(options, "--whole", "1") ==
        "--whole 1 is not allowed; give a whole number from 2 to 9");
  CHECK(given(options, "--maybe", "1.5") ==
        "--maybe 1.5 is not allowed; give a whole number from -2147483648 to 2147483647");
  CHECK(given(options, "--bytes", "many") ==
        "--bytes many is not allowed; give bytes, or a number with K, M or G");
  CHECK(given(options, "--side", "up") == "--side up is not allowed; give left or right");
  CHECK(given(options, "--deep", "-1") ==
        "--deep -1 is not allowed; give a whole number from 0 to 18446744073709551615");
  CHECK(given(options, "--deep", "18446744073709551615").empty());
  CHECK(options.inner.deep == std::numeric_limits<std::uint64_t>::max());
  CHECK(json_of(sample_row("--deep"), &options) == std::numeric_limits<std::uint64_t>::max());
  for (const char* const text : {"", "nan", "inf", "1e999", "2 m", "0x3", "2,5"}) {
    INFO(text);
    CHECK_FALSE(given(options, "--real", text).empty());
  }
  CHECK(options.real_m == Approx(1.5));
  CHECK(options.whole == 1);
}

TEST_CASE("Setting: a refusal in Python has its names and numbers") {
  const Outcome<SettingValue> cell = parse_value(sample_row("--cell"), "3");
  CHECK(cell.failure().text(Speaker::kPython) ==
        "cell_m 3 is not allowed; give metres from 0.5 to 2, or 0 for none");
  const Outcome<SettingValue> bytes = parse_value(sample_row("--bytes"), "-1");
  CHECK(bytes.failure().text(Speaker::kPython) ==
        "size_bytes -1 is not allowed; give bytes, at most 10^15");
}

TEST_CASE("Setting: a limit that is not allowed itself is said to be so") {
  struct Limits {
    double above_zero = 1.0;
    double share = 0.5;
  };
  static constexpr Setting kRows[] = {
      row<&Limits::above_zero>({"--above"}, "", {.allowed = above(0.0, 1e6, "metres")}),
      row<&Limits::share>({"--share"}, "", {.allowed = between(0.0, 1.0)}),
  };
  CHECK(parse_value(kRows[0], "0").failure().text() ==
        "--above 0 is not allowed; give metres above 0, to 1e6");
  CHECK(parse_value(kRows[0], "1e6").ok());
  CHECK(parse_value(kRows[1], "1").failure().text() ==
        "--share 1 is not allowed; give a number between 0 and 1");
  CHECK_FALSE(parse_value(kRows[1], "0").ok());
}

TEST_CASE("Setting: values of another type, and none where one must be, are refused") {
  SampleOptions options;
  CHECK_FALSE(assign(sample_row("--real"), &options, std::string("2")).ok());
  CHECK_FALSE(assign(sample_row("--real"), &options, std::int64_t{2}).ok());
  CHECK_FALSE(assign(sample_row("--real"), &options, std::monostate()).ok());
  CHECK_FALSE(
      assign(sample_row("--real"), &options, std::numeric_limits<double>::quiet_NaN()).ok());
  options.cell_m = 1.0;
  CHECK(assign(sample_row("--cell"), &options, std::monostate()).ok());
  CHECK_FALSE(options.cell_m);
}

TEST_CASE("Setting: reports have values in their types, and words where the command has words") {
  SampleOptions options;
  options.cell_m = 0.0;
  options.list = {1, 2};
  CHECK(json_of(sample_row("--on"), &options) == "off");
  CHECK(json_of(sample_row("--cell"), &options) == "off");
  CHECK(json_of(sample_row("--maybe"), &options).is_null());
  CHECK(json_of(sample_row("--bytes"), &options) == 1024);
  CHECK(json_of(sample_row("--side"), &options) == "left");
}

TEST_CASE("SettingTable: a setting is found by its option, and by its table and key") {
  STATIC_REQUIRE(kSample["--real"].key == "real_m");
  STATIC_REQUIRE(kSample["b.list"].key == "list");
}

}  // namespace
}  // namespace tessera
