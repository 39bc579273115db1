// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Everything that open() refuses, each with the file's name and what to do; and what it must
// accept.
#include <catch2/catch.hpp>
#include <filesystem>

#include "sample_dataset.hpp"
#include "scans/dataset.hpp"
#include "support/read_scan.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::SampleDataset;

/// The message, after checking that it is one line and the user's move.
std::string refusal(const std::string& dir, const DatasetOptions& options = {}) {
  const Outcome<Dataset> dataset = Dataset::open(dir, options);
  REQUIRE_FALSE(dataset.ok());
  CHECK(dataset.failure().kind == FailureKind::kUsage);
  CHECK(dataset.failure().text().find('\n') == std::string::npos);
  return dataset.failure().text();
}

TEST_CASE("Dataset: a complete folder opens with all its scans") {
  const SampleDataset sample;
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  CHECK(dataset->num_scans() == 3);
  CHECK(dataset->scan_number(2) == 2);
  CHECK(dataset->num_points(1) == 2);
  CHECK(dataset->max_points() == 3);
  CHECK(dataset->has_labels());
  CHECK(dataset->missing().empty());
}

TEST_CASE("Dataset: a missing or wrong dataset folder") {
  const SampleDataset sample;
  CHECK_THAT(refusal(sample.dir() + "/none"),
             Contains(sample.dir() + "/none does not exist") && Contains("check the name"));
  CHECK_THAT(refusal(sample.dir() + "/poses.txt"), Contains("poses.txt is not a folder"));
}

TEST_CASE("Dataset: a missing scan folder, and one without scans") {
  const SampleDataset sample;
  sample.remove("velodyne");
  CHECK_THAT(refusal(sample.dir()), Contains(sample.dir() + "/velodyne does not exist") &&
                                        Contains("needs velodyne/000000.bin"));
  sample.folder().write("velodyne/0.bin", "");
  CHECK_THAT(refusal(sample.dir()),
             Contains("no scans in " + sample.dir() + "/velodyne") && Contains("000000.bin"));
}

TEST_CASE("Dataset: missing poses") {
  const SampleDataset sample;
  sample.remove("poses.txt");
  CHECK_THAT(refusal(sample.dir()),
             Contains(sample.dir() + "/poses.txt does not exist") && Contains("12 numbers"));
}

TEST_CASE("Dataset: fewer poses than scans names both counts, unless the range does without") {
  const SampleDataset sample;
  sample.folder().write("poses.txt", std::string(test::kIdentityRow) + test::kIdentityRow);
  CHECK_THAT(refusal(sample.dir()),
             Contains("poses.txt has 2 poses") && Contains("3 chosen scans") && Contains("--last"));
  CHECK(Dataset::open(sample.dir(), {.first = {}, .last = 1}).ok());
}

TEST_CASE("Dataset: a malformed pose row names its line") {
  const SampleDataset sample;
  sample.folder().write("poses.txt", std::string(test::kIdentityRow) + "1 2 3\n");
  CHECK_THAT(refusal(sample.dir()), Contains("poses.txt, line 2: 3 numbers instead of 12"));
}

TEST_CASE("Dataset: a truncated scan names its size") {
  const SampleDataset sample;
  sample.folder().write("velodyne/000001.bin", std::string(33, '\0'));
  CHECK_THAT(refusal(sample.dir()), Contains("velodyne/000001.bin has 33 bytes") &&
                                        Contains("multiple of the 16") &&
                                        Contains("complete copy"));
}

TEST_CASE("Dataset: a scan of absurd size is refused before any memory is asked for") {
  const SampleDataset sample;
  std::filesystem::resize_file(sample.dir() + "/velodyne/000001.bin", 16ULL * ((1U << 24U) + 1U));
  CHECK_THAT(refusal(sample.dir()),
             Contains("000001.bin has 16777217 points") && Contains("limit"));
}

TEST_CASE("Dataset: a folder in a scan's place") {
  const SampleDataset sample;
  sample.remove("velodyne/000001.bin");
  std::filesystem::create_directory(sample.dir() + "/velodyne/000001.bin");
  CHECK_THAT(refusal(sample.dir()), Contains("000001.bin") && Contains("not a regular file"));
}

TEST_CASE("Dataset: a missing label folder, named or by default") {
  const SampleDataset sample;
  CHECK_THAT(refusal(sample.dir(), {.first = {}, .last = {}, .labels = "guesses"}),
             Contains(sample.dir() + "/guesses does not exist") && Contains("--labels none"));
  sample.remove("predictions");
  CHECK_THAT(refusal(sample.dir()), Contains("/predictions does not exist"));
  CHECK(Dataset::open(sample.dir(), {.first = {}, .last = {}, .labels = "none"}).ok());
  CHECK_THAT(refusal(sample.dir(), {.first = {}, .last = {}, .labels = ""}), Contains("no name"));
}

TEST_CASE("Dataset: a missing label file") {
  const SampleDataset sample;
  sample.remove("predictions/000002.label");
  CHECK_THAT(refusal(sample.dir()),
             Contains("predictions/000002.label: No such file") && Contains("check the name"));
}

TEST_CASE("Dataset: labels and points that differ in number") {
  const SampleDataset sample;
  sample.write_labels("predictions", 1, {40, 40, 40});
  CHECK_THAT(refusal(sample.dir()), Contains("predictions/000001.label has 3 labels") &&
                                        Contains("2 points") && Contains("belong to this scan"));
  sample.folder().write("predictions/000001.label", "1234567");
  CHECK_THAT(refusal(sample.dir()), Contains("000001.label has 7 bytes"));
}

TEST_CASE("Dataset: broken calibration and classes name their file") {
  const SampleDataset sample;
  sample.folder().write("calib.txt", "P0: 1 2 3\n");
  CHECK_THAT(refusal(sample.dir()), Contains("calib.txt has no line that starts with 'Tr:'"));
  sample.folder().write("classes.toml", "[[class]\n");
  CHECK_THAT(refusal(sample.dir()), Contains("classes.toml, line 1: not valid TOML"));
}

TEST_CASE("Dataset: a range chooses scans, ends included") {
  const SampleDataset sample(6);
  const Outcome<Dataset> dataset = Dataset::open(sample.dir(), {.first = 2, .last = 4});
  REQUIRE(dataset.ok());
  CHECK(dataset->num_scans() == 3);
  CHECK(dataset->scan_number(0) == 2);
  CHECK(dataset->max_points() == 5);
}

TEST_CASE("Dataset: a range without scans, a reversed and a negative one") {
  const SampleDataset sample;
  CHECK_THAT(refusal(sample.dir(), {.first = 7, .last = 9}),
             Contains("no scan from 7 to 9") && Contains("0 to 2") && Contains("choose"));
  CHECK_THAT(refusal(sample.dir(), {.first = 7, .last = {}}), Contains("0 to 2"));
  CHECK_THAT(refusal(sample.dir(), {.first = 2, .last = 1}), Contains("swap"));
  CHECK_THAT(refusal(sample.dir(), {.first = -1, .last = {}}), Contains("negative"));
}

TEST_CASE("Dataset: gaps in the numbers are no error, and are told") {
  const SampleDataset sample(6);
  sample.remove("velodyne/000001.bin");
  sample.remove("velodyne/000003.bin");
  sample.remove("velodyne/000004.bin");
  const Outcome<Dataset> dataset = Dataset::open(sample.dir(), {.first = {}, .last = 7});
  REQUIRE(dataset.ok());
  CHECK(dataset->num_scans() == 3);
  CHECK(to_text(dataset->missing()) == "1, 3-4, 6-7");
}

TEST_CASE("Dataset: trouble outside the chosen range does not matter") {
  const SampleDataset sample;
  sample.folder().write("velodyne/000002.bin", "x");
  CHECK(Dataset::open(sample.dir(), {.first = {}, .last = 1}).ok());
}

TEST_CASE("Dataset: labels with weights, of one number for every point of a folder") {
  const SampleDataset sample;
  for (int scan = 0; scan < 3; ++scan) {
    const auto points = static_cast<std::size_t>(scan) + 1;
    sample.write_weighted_labels("topk", scan, std::vector<std::uint32_t>(2 * points, 40));
  }
  const DatasetOptions topk{.first = {}, .last = {}, .labels = "topk"};
  CHECK(Dataset::open(sample.dir(), topk)->weighted_labels() == 2);
  CHECK(Dataset::open(sample.dir())->weighted_labels() == 0);
  sample.write_weighted_labels("topk", 1, {40, 40});
  CHECK_THAT(refusal(sample.dir(), topk),
             Contains("2 with weights for each point of scan 0, and 1 of scan 1"));
  for (int empty = 0; empty < 3; ++empty) {
    const SampleDataset with_gap;
    for (int scan = 0; scan < 3; ++scan) {
      const auto points = scan == empty ? 0U : static_cast<std::size_t>(scan) + 1;
      if (points == 0) with_gap.write_points(scan, {});
      with_gap.write_weighted_labels("topk", scan, std::vector<std::uint32_t>(3 * points, 40));
    }
    const Outcome<Dataset> dataset = Dataset::open(with_gap.dir(), topk);
    REQUIRE(dataset.ok());
    CHECK(dataset->weighted_labels() == 3);
    for (std::size_t scan = 0; scan < 3; ++scan) CHECK(test::read_scan(*dataset, scan).ok());
  }
  for (const std::size_t labels : {0U, 1U, 3U, 5U, 7U, 8U, 10U}) {
    sample.write_weighted_labels("topk", 1, std::vector<std::uint32_t>(labels, 40));
    CHECK_THAT(refusal(sample.dir(), topk),
               Contains("topk/000001.topk has " + std::to_string(labels) + " labels") &&
                   Contains("2 points, of 1 to 3 labels each"));
  }
}

TEST_CASE("Dataset: check_labels checks another folder as open does") {
  const SampleDataset sample;
  const Outcome<Dataset> dataset = Dataset::open(sample.dir());
  REQUIRE(dataset.ok());
  CHECK(dataset->check_labels("labels").ok());
  CHECK_THAT(dataset->check_labels("truth").failure().text(),
             Contains("/truth does not exist") && Contains("name a folder"));
  sample.write_labels("labels", 0, {});
  CHECK_THAT(dataset->check_labels("labels").failure().text(),
             Contains("labels/000000.label has 0 labels"));
}

}  // namespace
}  // namespace tessera
