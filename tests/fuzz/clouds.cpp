// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fuzz/fuzz.hpp"
#include "scans/pcd_reader.hpp"
#include "scans/ply_reader.hpp"
#include "scans/pose_file.hpp"
#include "support/heap_peak.hpp"
#include "support/reader_memory.hpp"
#include "support/temporary_folder.hpp"

namespace tessera::fuzz {

namespace {

/// Names the file and is a line of text.
void check_failure(const Failure& failure, std::string_view name) {
  require(failure.kind == FailureKind::kUsage, "bad input is not the system's failure");
  require(failure.text().find(name) != std::string::npos, "a message that does not say where");
  for (const char letter : failure.text())
    require(letter >= ' ' && letter <= '~', "a message of several lines, or of no text");
  require(failure.text().size() < 1024, "a message that nobody reads");
}

struct Format {
  Outcome<CloudSummary> (*inspect)(const CloudBytes&, std::uint64_t);
  Outcome<void> (*read)(const CloudBytes&, Cloud&);
  std::size_t most_points_a_byte;
  std::size_t (*most_bytes)(std::size_t);
};

void cloud(std::string_view text, const Format& format) {
  const CloudBytes file{"a.cloud", text};
  const test::HeapPeak peak;
  const Outcome<CloudSummary> summary = format.inspect(file, text.size());
  if (!summary.ok()) check_failure(summary.failure(), file.path);
  Cloud read;
  const Outcome<void> done = format.read(file, read);
  require(peak.bytes() <= format.most_bytes(text.size()), "more memory than the stated sum");
  // Bounded by the file, whatever it claims.
  const std::size_t most_points = (text.size() + 3) * format.most_points_a_byte;
  require(read.points_xyzi.capacity() <= 4 * most_points, "memory that the file cannot fill");
  require(read.raw_ids.capacity() <= most_points, "memory that the file cannot fill");
  if (!done.ok()) return check_failure(done.failure(), file.path);
  require(summary.ok(), "read although its header is refused");
  require(read.num_points() <= summary->points, "more points than the header says");
  require(read.raw_ids.size() == (summary->has_labels ? read.num_points() : 0), "a label a point");
  Cloud unlabelled;
  require(format.read({file.path, text, false}, unlabelled).ok() && unlabelled.raw_ids.empty() &&
              std::ranges::equal(std::as_bytes(std::span(read.points_xyzi)),
                                 std::as_bytes(std::span(unlabelled.points_xyzi))),
          "other points without labels");
}

void poses(std::string_view text) {
  static const test::TemporaryFolder folder;
  folder.write("poses.txt", text);
  const std::string path = folder.file("poses.txt");
  const test::HeapPeak peak;
  const Outcome<PoseRows> read = read_pose_rows(path);
  require(peak.bytes() <= test::poses_bytes(text.size()), "more memory than the stated sum");
  if (!read.ok()) return check_failure(read.failure(), path);
  require(read->T_map_sensor.size() <= text.size() / 15 + 1,
          "more poses than the text has room for");
}

}  // namespace

void clouds(Bytes bytes) {
  Input input(bytes);
  const int kind = input.below(3);
  const std::string_view text(reinterpret_cast<const char*>(input.rest().data()),
                              input.rest().size());
  // Three bytes are the least that a point takes; compressed ones may be 88 times as many.
  if (kind == 0) return cloud(text, {inspect_pcd, read_pcd, 88, test::packed_cloud_bytes});
  if (kind == 1) return cloud(text, {inspect_ply, read_ply, 1, test::cloud_bytes});
  poses(text);
}

}  // namespace tessera::fuzz
