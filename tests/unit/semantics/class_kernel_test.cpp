// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The kernels of classes: by name, or set.
#include "tessera/semantics/class_kernel.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "tessera/semantics/class_table.hpp"

namespace tessera {
namespace {

TEST_CASE("ClassKernel: names of common data sets have a shape, all others the usual one") {
  CHECK(kernel_by_name("vegetation") == ClassKernel{});
  CHECK(kernel_by_name("") == ClassKernel{});
  // Small, upright, flat, a wall.
  CHECK(kernel_by_name("car").reach_m < ClassKernel{}.reach_m);
  CHECK(kernel_by_name("pole").height_m > 1.0F);
  CHECK(kernel_by_name("sidewalk").height_m < ClassKernel{}.height_m);
  CHECK(kernel_by_name("building").reach_m > ClassKernel{}.reach_m);
  CHECK(kernel_by_name("Traffic Sign") == kernel_by_name("traffic-sign"));
  CHECK(kernel_by_name("GUARD_RAIL") == kernel_by_name("fence"));
  CHECK(kernel_by_name("car park") == ClassKernel{});
}

TEST_CASE("ClassTable: a class has the kernel of its name until another is set") {
  ClassTable table;
  REQUIRE(table.add("pole", {}) == Status::kOk);
  REQUIRE(table.add("thing", {}) == Status::kOk);
  CHECK(table.kernel(1) == kernel_by_name("pole"));
  CHECK(table.kernel(2) == ClassKernel{});
  const ClassTable before = table;
  CHECK(table.set_kernel(2, {1.5F, 3.0F}) == Status::kOk);
  CHECK(table.kernel(2) == ClassKernel{1.5F, 3.0F});
  CHECK(table.kernel(1) == kernel_by_name("pole"));
  // What a map says does not depend on it.
  CHECK(table == before);
}

TEST_CASE("ClassTable: lengths of a kernel are from a millimetre to a kilometre") {
  ClassTable table;
  REQUIRE(table.add("thing", {}) == Status::kOk);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const float wrong : {0.0F, -1.0F, 9e-4F, 1001.0F, kNan}) {
    CAPTURE(wrong);
    CHECK(table.set_kernel(1, {wrong, 1.0F}) == Status::kInvalidArgument);
    CHECK(table.set_kernel(1, {1.0F, wrong}) == Status::kInvalidArgument);
  }
  CHECK(table.kernel(1) == ClassKernel{});
  CHECK(table.set_kernel(1, {1e-3F, 1e3F}) == Status::kOk);
}

}  // namespace
}  // namespace tessera
