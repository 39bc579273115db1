// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The standard classes, and everything that a classes.toml can say rightly or wrongly.
#include <catch2/catch.hpp>
#include <set>

#include "scans/dataset_classes.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::TemporaryFolder;

std::string entry(const std::string& id, const std::string& name, const std::string& raw,
                  const std::string& color = "[1, 2, 3]") {
  return "[[class]]\nid = " + id + "\nname = \"" + name + "\"\ncolor = " + color +
         "\nraw = " + raw + "\n";
}

std::string refusal(const std::string& text) {
  const Outcome<DatasetClasses> classes = DatasetClasses::parse(text, "some/classes.toml");
  REQUIRE_FALSE(classes.ok());
  CHECK(classes.failure().kind == FailureKind::kUsage);
  CHECK(classes.failure().text().find('\n') == std::string::npos);
  CHECK_THAT(classes.failure().text(), Contains("some/classes.toml"));
  return classes.failure().text();
}

TEST_CASE("semantic_kitti: nineteen classes with their names and colours") {
  const DatasetClasses classes = DatasetClasses::semantic_kitti();
  CHECK(classes.table().num_classes() == 19);
  CHECK(classes.unlabelled() == 20);
  CHECK(classes.table()[1].name_view() == "car");
  CHECK(classes.table()[19].name_view() == "traffic-sign");
  CHECK(classes.table()[9].color == Color{255, 0, 255});
}

TEST_CASE("semantic_kitti: moving things belong to the class of their kind") {
  const DatasetClasses classes = DatasetClasses::semantic_kitti();
  CHECK(classes.component(10) == 1);
  CHECK(classes.component(252) == 1);
  CHECK(classes.component(60) == 9);
  CHECK(classes.component(259) == 5);
  CHECK(classes.component(81) == 19);
}

TEST_CASE("classes: what may move is known by its name, or said") {
  const ClassTable table = DatasetClasses::semantic_kitti().table();
  for (int label = 1; label <= 19; ++label) CHECK(table.moves(label) == (label <= 8));
  CHECK(table.moving() == 0x1feU);
  const Outcome<DatasetClasses> said = DatasetClasses::parse(
      entry("1", "car", "[1]") + entry("2", "car-park", "[2]") + entry("3", "van", "[3]") +
          "moves = false\n" + entry("4", "door", "[4]") + "moves = true\n",
      "classes.toml");
  REQUIRE(said.ok());
  CHECK(said->table().moving() == 0b10010U);
  CHECK_THAT(refusal(entry("1", "car", "[1]") + "moves = 1\n"),
             Contains("moves is not true or false"));
  CHECK(moves_by_name("Car"));
  CHECK(moves_by_name("PEDESTRIAN"));
  CHECK_FALSE(moves_by_name("carpet"));
  CHECK_FALSE(moves_by_name(""));
  // What moves is no part of what a map says: maps of both can be fused.
  const Outcome<DatasetClasses> other =
      DatasetClasses::parse(entry("1", "car", "[1]") + "moves = false\n", "classes.toml");
  const Outcome<DatasetClasses> same = DatasetClasses::parse(entry("1", "car", "[1]"), "");
  REQUIRE((other.ok() && same.ok()));
  CHECK(other->table() == same->table());
}

TEST_CASE("semantic_kitti: 34 raw ids are known, four of them as unlabelled") {
  const DatasetClasses classes = DatasetClasses::semantic_kitti();
  std::set<int> unlabelled;
  int known = 0;
  bool others_unlabelled = true;
  for (int raw_id = 0; raw_id < 65536; ++raw_id) {
    const auto id = static_cast<std::uint16_t>(raw_id);
    if (!classes.is_known(id)) {
      others_unlabelled = others_unlabelled && classes.component(id) == 20;
      continue;
    }
    ++known;
    if (classes.component(id) == 20) unlabelled.insert(raw_id);
  }
  CHECK(known == 34);
  CHECK(others_unlabelled);
  CHECK(unlabelled == std::set<int>{0, 1, 52, 99});
}

TEST_CASE("DatasetClasses::load: without a file SemanticKITTI's, with one that") {
  const TemporaryFolder folder;
  CHECK(DatasetClasses::load(folder.path().string())->table().num_classes() == 19);
  folder.write("classes.toml", entry("1", "a", "[1]"));
  CHECK(DatasetClasses::load(folder.path().string())->table().num_classes() == 1);
  folder.write("classes.toml", "x");
  CHECK_THAT(DatasetClasses::load(folder.path().string()).failure().text(),
             Contains(folder.file("classes.toml")));
}

TEST_CASE("classes.toml: ids in any order, both notations of colours, known unlabelled ids") {
  const std::string text = "unlabelled = [0, 9]\n" +
                           entry("2", "wall", "[7, 65535]", "\"#0aFF10\"") +
                           entry("1", "floor", "[]", "[0, 128, 255]");
  const Outcome<DatasetClasses> classes = DatasetClasses::parse(text, "classes.toml");
  REQUIRE(classes.ok());
  CHECK(classes->table()[1].name_view() == "floor");
  CHECK(classes->table()[1].color == Color{0, 128, 255});
  CHECK(classes->table()[2].color == Color{10, 255, 16});
  CHECK(classes->component(65535) == 2);
  CHECK(classes->component(9) == 3);
  CHECK(classes->is_known(9));
  CHECK_FALSE(classes->is_known(8));
}

TEST_CASE("classes.toml: 62 classes are accepted, an id of 63 is not") {
  std::string text;
  for (int id = 1; id <= 62; ++id) {
    const std::string number = std::to_string(id);
    text += entry(number, number, std::string("[").append(number).append("]"));
  }
  CHECK(DatasetClasses::parse(text, "f")->unlabelled() == 63);
  CHECK_THAT(refusal(text + entry("63", "c63", "[63]")), Contains("from 1 to 62"));
}

TEST_CASE("classes.toml: a syntax error names its line") {
  CHECK_THAT(refusal("\n\nname = = 3\n"), Contains(", line 3: not valid TOML") && Contains("fix"));
}

TEST_CASE("classes.toml: what is quoted of the file keeps the message one line") {
  CHECK_THAT(refusal("[[class]]\nid =n\n1 ame = \"ca\"\n"), Contains(", line 2: not valid TOML"));
  const std::string twice = entry("1", "a\\nb\\u001b", "[1]") + entry("2", "a\\nb\\u001b", "[2]");
  CHECK_THAT(refusal(twice), Contains("duplicate name 'a b '"));
}

TEST_CASE("classes.toml: no classes at all") {
  CHECK_THAT(refusal(""), Contains("no [[class]] entry") && Contains("add one"));
  CHECK_THAT(refusal("class = 3"), Contains("no [[class]] entry"));
  CHECK_THAT(refusal("class = [3]"), Contains("line 1: class is not a table"));
}

TEST_CASE("classes.toml: each key of a class is required") {
  CHECK_THAT(refusal("\n[[class]]\nid = 1\nname = \"a\"\nraw = [1]\n"),
             Contains("line 2: this class has no 'color'") && Contains("needs id, name, color"));
}

TEST_CASE("classes.toml: duplicate ids, gaps and ids out of range") {
  CHECK_THAT(refusal(entry("1", "a", "[1]") + entry("1", "b", "[2]")),
             Contains("line 6: duplicate id 1") && Contains("own id"));
  CHECK_THAT(refusal(entry("1", "a", "[1]") + entry("3", "b", "[2]")),
             Contains("line 6: the ids have a gap: there is 3 but no 2") && Contains("1, 2, 3"));
  CHECK_THAT(refusal(entry("2", "a", "[1]")), Contains("there is 2 but no 1"));
  for (const char* id : {"0", "-1", "63", "9223372036854775807", "\"1\"", "1.0"}) {
    CHECK_THAT(refusal(entry(id, "a", "[1]")), Contains("line 2: id is not") && Contains("number"));
  }
}

TEST_CASE("classes.toml: a raw id belongs to one class only, and fits into 16 bits") {
  CHECK_THAT(refusal(entry("1", "a", "[4, 5]") + entry("2", "b", "[5]")),
             Contains("line 10: duplicate raw id 5, also in line 5") && Contains("keep one"));
  CHECK_THAT(refusal("unlabelled = [5]\n" + entry("1", "a", "[5]")),
             Contains("duplicate raw id 5, also in"));
  for (const char* raw : {"[65536]", "[-1]", "[\"1\"]", "[1.5]"}) {
    CHECK_THAT(refusal(entry("1", "a", raw)),
               Contains("line 5: a raw id") && Contains("0 to 65535"));
  }
  CHECK_THAT(refusal(entry("1", "a", "7")), Contains("line 5: the raw ids are not a list"));
}

TEST_CASE("classes.toml: colours that are none") {
  for (const char* color : {"[1, 2]", "[1, 2, 256]", "[1, 2, -1]", "[1, 2, 0.5]", "\"red\"",
                            "\"#12345\"", "\"#12345g\"", "\"#+12345\"", "\"#1234567\"", "7"}) {
    CHECK_THAT(refusal(entry("1", "a", "[1]", color)),
               Contains("line 4: color is not a colour") && Contains("#rrggbb"));
  }
}

TEST_CASE("classes.toml: names are texts of 1 to 31 bytes, each used once") {
  CHECK(DatasetClasses::parse(entry("1", std::string(31, 'n'), "[1]"), "f").ok());
  CHECK_THAT(refusal(entry("1", std::string(32, 'n'), "[1]")), Contains("line 3: name is not"));
  CHECK_THAT(refusal(entry("1", "", "[1]")), Contains("line 3: name is not") && Contains("short"));
  CHECK_THAT(refusal(entry("1", "a", "[1]") + entry("2", "a", "[2]")),
             Contains("line 8: duplicate name 'a'"));
}

TEST_CASE("classes.toml: keys of very many parts are refused before they take the stack") {
  std::string key = "a";
  for (int i = 0; i < 100'000; ++i) key.append(".a");
  CHECK_THAT(refusal("# one\n" + key + " = 1\n"), Contains("line 2: over 4000 dots"));
}

}  // namespace
}  // namespace tessera
