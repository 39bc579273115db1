// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The table of classes: up to 62, each with a name of at most 31 bytes and a colour.
#include "tessera/semantics/class_table.hpp"

#include <catch2/catch.hpp>
#include <string>

namespace tessera {
namespace {

TEST_CASE("ClassTable: an empty table has free and unlabelled only") {
  const ClassTable table;
  CHECK(table.num_classes() == 0);
  CHECK(table.num_components() == 2);
  CHECK(table.unlabelled() == 1);
}

TEST_CASE("ClassTable: classes are numbered from 1 in the order they were added") {
  ClassTable table;
  REQUIRE(table.add("road", {128, 64, 128}) == Status::kOk);
  REQUIRE(table.add("car", {0, 0, 142}) == Status::kOk);
  CHECK(table[1].name_view() == "road");
  CHECK(table[2].name_view() == "car");
  CHECK(table[2].color == Color{0, 0, 142});
  CHECK(table.num_components() == 4);
  CHECK(table.unlabelled() == 3);
}

TEST_CASE("ClassTable: takes 61 and 62 classes and refuses the 63rd, unchanged") {
  ClassTable table;
  for (int i = 1; i <= kMaxClasses; ++i) {
    REQUIRE(table.num_classes() == i - 1);
    REQUIRE(table.add("class " + std::to_string(i), {}) == Status::kOk);
  }
  const ClassTable before = table;
  CHECK(table.add("one more", {}) == Status::kResourceExhausted);
  CHECK(table == before);
  CHECK(table.num_components() == kMaxComponents);
  CHECK(table[kMaxClasses].name_view() == "class 62");
}

TEST_CASE("SemanticClass: names of 30 and 31 bytes are kept, longer ones are cut") {
  for (const std::size_t length : {0U, 1U, 30U, 31U, 32U, 100U}) {
    const std::string name(length, 'x');
    const SemanticClass c = SemanticClass::make(name, {});
    CHECK(c.name_view().size() == (length < 31 ? length : 31));
    CHECK(c.name.back() == '\0');
  }
}

TEST_CASE("ClassTable: equal iff names, colours and order are") {
  ClassTable a;
  ClassTable b;
  REQUIRE(a.add("road", {1, 2, 3}) == Status::kOk);
  CHECK_FALSE(a == b);
  REQUIRE(b.add("road", {1, 2, 4}) == Status::kOk);
  CHECK_FALSE(a == b);
  ClassTable c;
  REQUIRE(c.add("road", {1, 2, 3}) == Status::kOk);
  CHECK(a == c);
}

}  // namespace
}  // namespace tessera
