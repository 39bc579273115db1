// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What read() delivers, that it does so without the heap, and what it says when files change under
// it.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "base/allocation_counter.hpp"
#include "sample_dataset.hpp"
#include "scans/dataset.hpp"
#include "support/read_scan.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::SampleDataset;

TEST_CASE("Dataset::read: points, labels, pose and number of a scan") {
  const SampleDataset sample;
  sample.write_points(1, {1.5F, -2.0F, 3.0F, 0.25F, 4.0F, 5.0F, 6.0F, 0.5F});
  sample.write_labels("predictions", 1, {10, 0x00070048U});
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 1);
  REQUIRE(scan.ok());
  CHECK(scan->number == 1);
  CHECK(scan->num_points() == 2);
  CHECK(std::vector<float>(scan->points_xyzi.begin(), scan->points_xyzi.end()) ==
        std::vector<float>{1.5F, -2.0F, 3.0F, 0.25F, 4.0F, 5.0F, 6.0F, 0.5F});
  CHECK(scan->components[0] == 1);   // 10: car.
  CHECK(scan->components[1] == 17);  // 0x48 = 72: terrain; the upper half is the instance.
  CHECK(scan->T_map_sensor == Matrix34d(Matrix34d::Identity()));
  CHECK(scan->unknown.points == 0);
}

TEST_CASE("Dataset::read: labels with weights, and the heaviest of them for eval") {
  const SampleDataset sample;
  constexpr auto label = [](std::uint32_t raw_id, std::uint32_t weight) {
    return raw_id | (weight << 16U);
  };
  // A car or a truck; a road twice; an id that is in no class; no weight at all; too much of it.
  sample.write_points(1, std::vector<float>(20, 1.0F));
  sample.write_weighted_labels(
      "topk", 1,
      {label(10, 100), label(18, 155), label(40, 60), label(40, 50), label(7, 20), label(10, 10),
       label(7, 0), label(10, 0), label(10, 200), label(18, 56)});
  const DatasetOptions options{.first = 1, .last = 1, .labels = "topk"};
  const Outcome<Dataset> dataset = Dataset::open(sample.dir(), options);
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 0);
  REQUIRE(scan.ok());
  const auto as_ints = [](const std::vector<std::uint8_t>& bytes) {
    return std::vector<int>(bytes.begin(), bytes.end());
  };
  CHECK(as_ints(scan->components) == std::vector<int>{1, 4, 9, 9, 20, 1, 20, 1, 1, 4});
  CHECK(as_ints(scan->label_weights) == std::vector<int>{100, 155, 60, 50, 20, 10, 0, 0, 200, 56});
  CHECK(scan->unknown.points == 1);  // Without a weight it is no label.
  std::vector<std::uint8_t> best(5);
  const Outcome<UnknownRawIds> unknown = dataset->read_labels(0, "topk", best);
  REQUIRE(unknown.ok());
  // What the library has as a point's label: of the fourth none, and of the last, of wrong weights,
  // none.
  CHECK(as_ints(best) == std::vector<int>{4, 9, 1, 20, 20});
}

TEST_CASE("Dataset::read: a label's weight above one is told with its place") {
  const SampleDataset sample;
  sample.write_points(0, std::vector<float>(8, 1.0F));
  sample.write_weighted_labels("topk", 0, {40 | (255U << 16U), 40 | (256U << 16U)});
  const Outcome<Dataset> dataset =
      Dataset::open(sample.dir(), {.first = 0, .last = 0, .labels = "topk"});
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 0);
  REQUIRE_FALSE(scan.ok());
  CHECK_THAT(scan.failure().text(), Contains("topk/000000.topk gives a label of point 1 the weight "
                                             "256; weights are in 255ths, 0 to 255"));
}

TEST_CASE("Dataset::read: an empty scan has no points") {
  const SampleDataset sample;
  sample.write_points(1, {});
  sample.write_labels("predictions", 1, {});
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 1);
  REQUIRE(scan.ok());
  CHECK(scan->num_points() == 0);
}

TEST_CASE("Dataset::read: points that are not finite are passed on, for registration to refuse") {
  const SampleDataset sample;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  sample.write_points(0, {nan, inf, -inf, 0.0F});
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 0);
  REQUIRE(scan.ok());
  CHECK(std::isnan(scan->points_xyzi[0]));
  CHECK(std::isinf(scan->points_xyzi[2]));
}

TEST_CASE("Dataset::read: without labels every point is unlabelled") {
  const SampleDataset sample;
  const Outcome<Dataset> dataset =
      Dataset::open(sample.dir(), {.first = {}, .last = {}, .labels = "none"});
  REQUIRE(dataset.ok());
  CHECK_FALSE(dataset->has_labels());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 2);
  REQUIRE(scan.ok());
  CHECK(std::vector<int>(scan->components.begin(), scan->components.end()) ==
        std::vector<int>{20, 20, 20});
}

TEST_CASE(
    "Dataset::read: unknown raw ids are unlabelled and counted, known unlabelled ones are not") {
  const SampleDataset sample(16);
  std::vector<std::uint32_t> labels{0, 1, 52, 99, 7, 7, 300, 2, 3, 4, 5, 6, 8, 9, 12, 65535};
  sample.write_labels("predictions", 15, labels);
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 15);
  REQUIRE(scan.ok());
  for (const int component : scan->components) CHECK(component == 20);
  CHECK(scan->unknown.points == 12);
  CHECK(scan->unknown.num_examples == 8);
  CHECK(scan->unknown.examples == std::array<std::uint16_t, 8>{7, 300, 2, 3, 4, 5, 6, 8});
}

TEST_CASE("Dataset::read: a scan longer than the internal pieces has its labels in order") {
  const SampleDataset sample(1);
  constexpr std::size_t kPoints = 10000;
  std::vector<std::uint32_t> labels(kPoints);
  for (std::size_t i = 0; i < kPoints; ++i) labels[i] = i % 3 == 0 ? 10 : 81;
  sample.write_points(0, std::vector<float>(kPoints * 4, 1.0F));
  sample.write_labels("predictions", 0, labels);
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 0);
  REQUIRE(scan.ok());
  bool in_order = true;
  for (std::size_t i = 0; i < kPoints; ++i) {
    in_order = in_order && scan->components[i] == (i % 3 == 0 ? 1 : 19);
  }
  CHECK(in_order);
}

TEST_CASE("Dataset::read: reading scans and labels does not use the heap") {
  const SampleDataset sample;
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  Outcome<ScanReader> reader = ScanReader::make(*dataset);
  REQUIRE(reader.ok());
  std::vector<std::uint8_t> truth(dataset->max_points());
  const auto before = heap_allocations();
  bool ok = true;
  for (std::size_t i = 0; i < dataset->num_scans(); ++i) {
    ok = ok && reader->read(i).ok();
    ok = ok && dataset->read_labels(i, "labels", std::span(truth).first(i + 1)).ok();
  }
  const auto after = heap_allocations();
  CHECK(ok);
  CHECK(before == after);
}

TEST_CASE("Dataset::read_labels: a second folder, by relative or absolute name") {
  const SampleDataset sample;
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  std::vector<std::uint8_t> truth(2);
  REQUIRE(dataset->read_labels(1, "labels", truth).ok());
  CHECK(truth == std::vector<std::uint8_t>{15, 15});
  REQUIRE(dataset->read_labels(1, sample.dir() + "/predictions", truth).ok());
  CHECK(truth == std::vector<std::uint8_t>{9, 9});
}

TEST_CASE("Dataset::read: the folder's own classes.toml is used") {
  const SampleDataset sample;
  sample.folder().write("classes.toml",
                        "[[class]]\nid = 1\nname = \"ground\"\ncolor = \"#102030\"\nraw = [40]\n");
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  std::vector<std::uint8_t> components(1);
  REQUIRE(dataset->read_labels(0, "predictions", components).ok());
  CHECK(components[0] == 1);
  const Outcome<UnknownRawIds> unknown = dataset->read_labels(0, "labels", components);
  REQUIRE(unknown.ok());
  CHECK(components[0] == 2);
  CHECK(unknown->points == 1);
}

TEST_CASE("Dataset::read: files that vanish or change after open are failures, not crashes") {
  const SampleDataset sample;
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  sample.remove("velodyne/000000.bin");
  sample.folder().write("velodyne/000001.bin", std::string(17, '\0'));
  sample.remove("predictions/000002.label");
  const auto message = [&](std::size_t i) {
    const Outcome<test::ReadScan> scan = test::read_scan(*dataset, i);
    REQUIRE_FALSE(scan.ok());
    CHECK(scan.failure().kind == FailureKind::kFailure);
    return scan.failure().text();
  };
  CHECK_THAT(message(0), Contains("velodyne/000000.bin") && Contains("check the name"));
  CHECK_THAT(message(1),
             Contains("000001.bin has 17 bytes, but had 32") && Contains("do not change"));
  CHECK_THAT(message(2), Contains("predictions/000002.label"));
  std::vector<std::uint8_t> truth(3);
  sample.write_labels("labels", 2, {1, 2, 3, 4});
  const Outcome<UnknownRawIds> labels = dataset->read_labels(2, "labels", truth);
  REQUIRE_FALSE(labels.ok());
  CHECK_THAT(labels.failure().text(), Contains("labels/000002.label has 16 bytes, but had 12"));
}

}  // namespace
}  // namespace tessera
