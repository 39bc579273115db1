// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is written as a dataset is read as the same scans.
#include "scans/kitti_writer.hpp"

#include <catch2/catch.hpp>

#include "made_scans.hpp"
#include "scans/dataset.hpp"
#include "support/read_scan.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::MadeScans;
using test::TemporaryFolder;

void write(const RecordedScans& scans, KittiWriter& writer) {
  Outcome<ScanReader> reader = ScanReader::make(scans);
  REQUIRE(reader.ok());
  for (std::size_t i = 0; i < scans.num_scans(); ++i) {
    const Outcome<ScanView> view = reader->read(i);
    REQUIRE(view.ok());
    REQUIRE(writer.add(reader->scan(), *view).ok());
  }
}

TEST_CASE("KittiWriter: scans are read as they were written, numbered from 0") {
  const MadeScans scans(3);
  const TemporaryFolder folder;
  const std::string out = folder.file("new");
  Outcome<KittiWriter> writer = KittiWriter::create(out, scans.classes(), false);
  REQUIRE(writer.ok());
  write(scans, *writer);
  CHECK_FALSE(Dataset::open(out).ok());  // poses.txt is not there yet.
  REQUIRE(writer->finish(nullptr).ok());
  const Outcome<Dataset> dataset = Dataset::open(out);
  REQUIRE(dataset.ok());
  REQUIRE(dataset->num_scans() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const Outcome<test::ReadScan> from = test::read_scan(scans, i);
    const Outcome<test::ReadScan> to = test::read_scan(*dataset, i);
    REQUIRE((from.ok() && to.ok()));
    CHECK(to->number == static_cast<int>(i));
    CHECK(to->points_xyzi == from->points_xyzi);
    CHECK(to->components == from->components);
    CHECK(to->T_map_sensor == from->T_map_sensor);
    CHECK(to->unknown.points == 0);
  }
}

TEST_CASE("KittiWriter: labels with weights are read as they were written") {
  const DatasetClasses classes = DatasetClasses::semantic_kitti();
  const TemporaryFolder folder;
  Outcome<KittiWriter> writer = KittiWriter::create(folder.file("new"), classes, false);
  REQUIRE(writer.ok());
  const std::vector<float> points(6, 1.0F);
  const std::vector<std::uint8_t> components{9, 1, 20, 17, 2, 5};
  const std::vector<std::uint8_t> weights{100, 90, 65, 255, 0, 0};
  REQUIRE(writer
              ->add(Scan(), {.points = points.data(),
                             .stride_floats = 3,
                             .count = 2,
                             .components = components.data(),
                             .labels_per_point = 3,
                             .label_weights = weights.data()})
              .ok());
  REQUIRE(writer->finish(nullptr).ok());
  const Outcome<Dataset> dataset = Dataset::open(folder.file("new"));
  REQUIRE(dataset.ok());
  CHECK(dataset->weighted_labels() == 3);
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 0);
  REQUIRE(scan.ok());
  CHECK(scan->components == components);
  CHECK(scan->label_weights == weights);
}

TEST_CASE("KittiWriter: points without labels are unlabelled, by an id that is known") {
  const DatasetClasses classes = DatasetClasses::semantic_kitti();
  const TemporaryFolder folder;
  Outcome<KittiWriter> writer = KittiWriter::create(folder.file("new"), classes, false);
  REQUIRE(writer.ok());
  const std::array<float, 3> point{1.0F, 2.0F, 3.0F};
  REQUIRE(writer->add(Scan(), {.points = point.data(), .stride_floats = 3, .count = 1}).ok());
  REQUIRE(writer->finish(nullptr).ok());
  const Outcome<Dataset> dataset = Dataset::open(folder.file("new"));
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 0);
  REQUIRE(scan.ok());
  CHECK(scan->points_xyzi == std::vector<float>{1.0F, 2.0F, 3.0F, 0.0F});
  CHECK(scan->components == std::vector<std::uint8_t>{classes.unlabelled()});
  CHECK(scan->unknown.points == 0);
}

TEST_CASE("KittiWriter: a pose that is not rigid, or has no number, is passed on") {
  const DatasetClasses classes = DatasetClasses::semantic_kitti();
  const TemporaryFolder folder;
  Outcome<KittiWriter> writer = KittiWriter::create(folder.file("new"), classes, false);
  REQUIRE(writer.ok());
  ScanView view;
  REQUIRE(writer->add(Scan(), view).ok());
  view.T_map_sensor(0, 0) = 3.0;
  view.T_map_sensor(1, 3) = std::numeric_limits<double>::quiet_NaN();
  REQUIRE(writer->add(Scan(), view).ok());
  REQUIRE(writer->finish(nullptr).ok());
  const Outcome<Dataset> dataset = Dataset::open(folder.file("new"));
  REQUIRE(dataset.ok());
  CHECK(std::isnan(dataset->T_map_sensor(1)(1, 3)));
}

TEST_CASE("KittiWriter: it writes into a new or empty folder alone") {
  const DatasetClasses classes = DatasetClasses::semantic_kitti();
  const TemporaryFolder folder;
  folder.write("used/a.txt", "a");
  const Outcome<KittiWriter> used = KittiWriter::create(folder.file("used"), classes, false);
  REQUIRE_FALSE(used.ok());
  CHECK_THAT(used.failure().text(), Contains("used has files; name a new folder"));
  const Outcome<KittiWriter> file = KittiWriter::create(folder.file("used/a.txt"), classes, false);
  REQUIRE_FALSE(file.ok());
  CHECK_THAT(file.failure().text(), Contains("is not a folder"));
}

}  // namespace
}  // namespace tessera
