// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "base/number_row.hpp"
#include "fuzz/fuzz.hpp"
#include "link/key_file.hpp"
#include "scans/calibration.hpp"
#include "scans/dataset.hpp"
#include "scans/poses.hpp"
#include "scans/transform_file.hpp"
#include "support/heap_peak.hpp"
#include "support/read_scan.hpp"
#include "support/reader_memory.hpp"
#include "support/temporary_folder.hpp"
#include "tessera/base/internal/crc32.hpp"

namespace tessera::fuzz {

namespace {

/// A file that is written again for every input.
class File {
 public:
  explicit File(std::string_view text) {
    folder().write("file", text);
    path_ = folder().file("file");
    require(::chmod(path_.c_str(), 0600) == 0, "chmod");
  }
  [[nodiscard]] const std::string& path() const { return path_; }
  static const test::TemporaryFolder& folder() {
    static const test::TemporaryFolder folder;
    return folder;
  }

 private:
  std::string path_;
};

/// Names the file and takes one line, however the file is made.
void check_failure(const Failure& failure, std::string_view name) {
  require(failure.kind == FailureKind::kUsage, "bad input is not the system's failure");
  require(failure.text().find(name) != std::string::npos, "a message that does not say where");
  for (const char letter : failure.text())
    require(static_cast<unsigned char>(letter) >= 0x20, "a message of several lines");
  require(failure.text().size() < 1024, "a message that nobody reads");
}

bool same_bits(const Matrix34d& a, const Matrix34d& b) {
  return std::memcmp(a.data(), b.data(), sizeof(double) * 12) == 0;
}

void poses(std::string_view text) {
  const File file(text);
  const test::HeapPeak peak;
  const Outcome<std::vector<Matrix34d>> read = read_poses(file.path());
  require(peak.bytes() <= test::poses_bytes(text.size()), "more memory than the stated sum");
  if (!read.ok()) return check_failure(read.failure(), file.path());
  std::string again;
  for (const Matrix34d& pose : *read) {
    for (int i = 0; i < 12; ++i) {
      char number[40];
      std::snprintf(number, sizeof number, "%.17g ", pose.data()[i]);
      again += number;
    }
    again += '\n';
  }
  const File second(again);
  const Outcome<std::vector<Matrix34d>> reread = read_poses(second.path());
  require(reread.ok() && reread->size() == read->size(), "written again they are refused");
  for (std::size_t i = 0; i < read->size(); ++i) {
    const bool finite = (*read)[i].allFinite();
    require(!finite || same_bits((*read)[i], (*reread)[i]), "written again they are others");
  }
}

void rigid(const Outcome<Matrix34d>& read, const File& file) {
  if (!read.ok()) return check_failure(read.failure(), file.path());
  require(read->allFinite() && check_rigid(*read) == Status::kOk, "not rigid");
}

void classes(std::string_view text) {
  const test::HeapPeak peak;
  const Outcome<DatasetClasses> read = DatasetClasses::parse(text, "classes.toml");
  require(peak.bytes() <= test::toml_bytes(text.size()), "more memory than the stated sum");
  if (!read.ok()) return check_failure(read.failure(), "classes.toml");
  const int num_classes = read->table().num_classes();
  require(num_classes >= 1 && num_classes <= kMaxClasses, "a number of classes");
  for (unsigned raw = 0; raw < 65536; ++raw) {
    const int component = read->component(static_cast<std::uint16_t>(raw));
    require(component >= 1 && component <= num_classes + 1, "a component");
  }
  for (int c = 1; c <= num_classes; ++c)
    require(!read->table()[c].name_view().empty(), "a class without a name");
}

/// The check at the end of each line put right where the line has room for one, for the fuzzer to
/// get beyond it.
std::string with_checks(std::string_view text) {
  std::string mended;
  while (!text.empty()) {
    std::string_view line = take_line(text);
    std::string said;
    std::string_view last;
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
      if (!last.empty()) said.append(said.empty() ? "" : " ").append(last);
      last = word;
    }
    char check[9];
    std::snprintf(check, sizeof check, "%08x", crc32c(std::as_bytes(std::span(said))));
    mended.append(said).append(" ").append(last.size() == 8 ? check : last).append("\n");
  }
  return mended;
}

void keys(std::string_view text, int kind) {
  const File file(text);
  const auto check = [&](const auto& read) {
    if (read.ok()) return true;
    check_failure(read.failure(), file.path());
    return false;
  };
  if (kind == 0) static_cast<void>(check(read_fleet_key(file.path())));
  if (kind == 1) static_cast<void>(check(read_robot_secret(file.path())));
  if (kind != 2) return;
  const Outcome<std::vector<RobotPublic>> read = read_public_keys(file.path());
  if (!check(read)) return;
  require(!read->empty(), "no key");
  for (std::size_t i = 1; i < read->size(); ++i)
    require((*read)[i - 1].robot < (*read)[i].robot, "robots ascend");
}

/// Points, their labels and a row of poses.
void dataset(Input input) {
  const Bytes points = input.bytes(input.u16());
  const Bytes labels = input.bytes(input.u16());
  const auto text = [](Bytes bytes) {
    return std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const test::TemporaryFolder& folder = File::folder();
  folder.write("velodyne/000000.bin", text(points));
  folder.write("predictions/000000.label", text(labels));
  folder.write("poses.txt", text(input.rest()));
  const Outcome<Dataset> opened = Dataset::open(folder.path().string());
  if (!opened.ok()) return check_failure(opened.failure(), folder.path().string());
  require(opened->num_scans() == 1 && opened->num_points(0) == points.size() / 16, "points");
  const Outcome<test::ReadScan> scan = test::read_scan(*opened, 0);
  require(scan.ok(), "what was opened is not read");
  require(scan->num_points() == labels.size() / 4, "as many labels");
  require(std::memcmp(scan->points_xyzi.data(), points.data(), points.size()) == 0, "as stored");
  for (const std::uint8_t component : scan->components)
    require(component >= 1 && component <= opened->classes().unlabelled(), "a component");
}

}  // namespace

void text_files(Bytes bytes) {
  Input input(bytes);
  const int kind = input.below(9);
  const std::string_view text(reinterpret_cast<const char*>(input.rest().data()),
                              input.rest().size());
  if (kind == 0) return poses(text);
  if (kind == 1) {
    const File file(text);
    return rigid(read_calibration(file.path()), file);
  }
  if (kind == 2) {
    const File file(text);
    return rigid(read_transform(file.path()), file);
  }
  if (kind == 3) return classes(text);
  if (kind == 4) return dataset(input);
  if (kind == 5) return keys(text, 0);
  keys(with_checks(text), kind - 6);
}

}  // namespace tessera::fuzz
