// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Scans with times of their points are read as the sensor would have seen them at the stamp.
#include <catch2/catch.hpp>
#include <cstring>

#include "base/allocation_counter.hpp"
#include "sample_dataset.hpp"
#include "scans/dataset.hpp"
#include "support/read_scan.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::SampleDataset;

void write_times(const SampleDataset& sample, int scan, const std::vector<float>& times_s) {
  std::string bytes(times_s.size() * sizeof(float), '\0');
  std::memcpy(bytes.data(), times_s.data(), bytes.size());
  sample.folder().write(test::scan_name("times", scan, ".bin"), bytes);
}

/// Scan 1 at 0.1 s while the robot drives 10 m/s; its points are 5 m ahead at their own times.
void write_sweep(const SampleDataset& sample) {
  write_times(sample, 0, {0.0F});
  sample.write_points(1, {5.0F, 0.0F, 0.0F, 0.5F, 5.0F, 1.0F, 0.0F, 0.25F});
  write_times(sample, 1, {-0.05F, 0.04F});
  write_times(sample, 2, {0.0F, 0.0F, 0.0F});
  sample.folder().write("times.txt", "0\n0.1\n0.2\n");
  sample.folder().write("poses.txt",
                        "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n"
                        "1 0 0 2 0 1 0 0 0 0 1 0\n");
}

TEST_CASE(
    "deskewed dataset: points are where the sensor sees them at the stamp, without the heap") {
  const SampleDataset sample;
  write_sweep(sample);
  for (const bool dense : {false, true}) {
    if (dense)
      sample.folder().write("poses_dense.txt",
                            "0 1 0 0 0 0 1 0 0 0 0 1 0\n0.2 1 0 0 2 0 1 0 0 0 0 1 0\n");
    const Outcome<Dataset> dataset = Dataset::open(sample.dir());
    REQUIRE(dataset.ok());
    CHECK(dataset->deskews());
    Outcome<ScanReader> reader = ScanReader::make(*dataset);
    REQUIRE(reader.ok());
    const auto before = heap_allocations();
    const Outcome<ScanView> scan = reader->read(1);
    CHECK(heap_allocations() == before);
    REQUIRE(scan.ok());
    REQUIRE(reader->registration().deskew);
    CHECK(reader->registration().deskew->moved == 2);
    CHECK(scan->points[0] == Approx(4.5F));
    CHECK(scan->points[4] == Approx(5.4F));
    CHECK(scan->points[5] == Approx(1.0F));
    CHECK(scan->points[7] == 0.25F);
  }
}

TEST_CASE("deskewed dataset: off reads the points as they are, and needs no times") {
  const SampleDataset sample;
  write_sweep(sample);
  sample.remove("times.txt");
  const Outcome<Dataset> dataset = Dataset::open(
      sample.dir(), {.first = {}, .last = {}, .labels = "predictions", .deskew = Deskewing::kOff});
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 1);
  REQUIRE(scan.ok());
  CHECK_FALSE(scan->deskew);
  CHECK(scan->points_xyzi[0] == 5.0F);
}

TEST_CASE("deskewed dataset: what is missing or wrong is told by its name and line") {
  const auto failure = [](const auto& change, Deskewing deskew = Deskewing::kWhereTimed) {
    const SampleDataset sample;
    write_sweep(sample);
    change(sample);
    const Outcome<Dataset> dataset = Dataset::open(
        sample.dir(), {.first = {}, .last = {}, .labels = "predictions", .deskew = deskew});
    return dataset.ok() ? std::string() : dataset.failure().text();
  };
  const auto writes = [](const char* name, const char* text) {
    return [=](const SampleDataset& s) { s.folder().write(name, text); };
  };
  CHECK(failure([](const SampleDataset&) {}).empty());
  CHECK_THAT(failure([](const SampleDataset& s) { s.remove("times.txt"); }),
             Contains("times.txt does not exist"));
  CHECK_THAT(failure(writes("times.txt", "0\n0.1\n")), Contains("times.txt has 2 stamps"));
  CHECK_THAT(failure(writes("times.txt", "0\n0.1\nx\n")),
             Contains("times.txt, line 3") && Contains("a word is not a number"));
  CHECK_THAT(failure(writes("times.txt", "0\nnan\n0.2\n")), Contains("times.txt, line 2"));
  CHECK_THAT(failure(writes("times.txt", "0\n1e300\n0.2\n")), Contains("times.txt, line 2"));
  CHECK_THAT(failure(writes("times.txt", "0\n0.2\n0.2\n")),
             Contains("line 3") && Contains("not later"));
  CHECK_THAT(failure(writes("times.txt", "0 1\n0.1\n0.2\n")),
             Contains("line 1") && Contains("more than one"));
  CHECK_THAT(failure(writes("poses_dense.txt", "0 1 0 0 0\n")),
             Contains("poses_dense.txt, line 1") && Contains("12"));
  CHECK_THAT(failure(writes("poses_dense.txt",
                            "0 1 0 0 0 0 1 0 0 0 0 1 0\n\n"
                            "0 1 0 0 0 0 1 0 0 0 0 1 0\n")),
             Contains("line 3") && Contains("not later"));
  CHECK_THAT(failure(writes("times/000001.bin", "1234")),
             Contains("times/000001.bin has 4 bytes") && Contains("--deskew off"));
  CHECK_THAT(failure([](const SampleDataset& s) { s.remove("times/000002.bin"); }),
             Contains("times/000002.bin"));
  CHECK_THAT(failure([](const SampleDataset& s) { s.remove("times"); }, Deskewing::kOn),
             Contains("times does not exist") && Contains("--deskew off"));
  CHECK(failure([](const SampleDataset& s) { s.remove("times"); }).empty());
}

TEST_CASE("deskewed dataset: a dense pose that is not rigid leaves a gap and no more") {
  const SampleDataset sample;
  write_sweep(sample);
  sample.folder().write("poses_dense.txt",
                        "0 1 0 0 0 0 1 0 0 0 0 1 0\n0.09 nan 0 0 2 0 1 0 0 0 0 1 0\n"
                        "0.2 1 0 0 2 0 1 0 0 0 0 1 0\n");
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 1);
  REQUIRE(scan.ok());
  CHECK(scan->deskew->moved == 2);
}

TEST_CASE("deskewed dataset: off with its motion leaves the points; times are read if asked for") {
  const SampleDataset sample;
  write_sweep(sample);
  DatasetOptions options;
  options.deskew = Deskewing::kOff;
  options.with_motion = true;
  const Outcome<Dataset> dataset = Dataset::open(sample.dir(), options);
  REQUIRE(dataset.ok());
  CHECK(dataset->motion() != nullptr);
  CHECK_FALSE(dataset->has_times());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 1);
  REQUIRE(scan.ok());
  CHECK_FALSE(scan->deskew);
  CHECK(scan->points_xyzi[0] == 5.0F);
  options.with_times = true;
  const Outcome<Dataset> timed = Dataset::open(sample.dir(), options);
  REQUIRE(timed.ok());
  CHECK(timed->has_times());
  Scan raw(timed->registration().limits);
  REQUIRE(timed->read(1, raw).ok());
  CHECK(raw.has_times);
  CHECK(raw.times_s()[1] == 0.04F);
  CHECK(raw.points()[0] == 5.0F);
}

TEST_CASE("deskewing: on, off, and where there are times if nothing is said") {
  CHECK(deskewing(std::nullopt) == Deskewing::kWhereTimed);
  CHECK(deskewing(true) == Deskewing::kOn);
  CHECK(deskewing(false) == Deskewing::kOff);
}

}  // namespace
}  // namespace tessera
