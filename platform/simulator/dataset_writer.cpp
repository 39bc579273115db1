// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Failures travel as an exception inside this file and leave it as an Outcome.
#include "simulator/dataset_writer.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "base/atomic_file.hpp"
#include "pictures/png_image.hpp"
#include "scans/label_files.hpp"
#include "simulator/dataset_formats.hpp"
#include "simulator/random.hpp"
#include "simulator/traffic.hpp"

namespace tessera {
namespace {

namespace fs = std::filesystem;
using street::label_bytes;
using street::number_bytes;
using street::point_bytes;
using street::rows_text;
using street::scan_name;
using street::text_of;

constexpr const char* kBeliefs = "topk";  ///< Folder of labels with weights.
constexpr const char* kScanFolders[] = {"velodyne", "labels", "predictions"};

struct WriteError {
  Failure failure;
};

[[noreturn]] void fail(const fs::path& path, const char* what, const std::string& reason,
                       FailureKind kind) {
  throw WriteError{{"cannot " + std::string(what) + " " + path.string() + " (" + reason +
                        "); choose a writable folder with free space, or fix its "
                        "permissions",
                    kind}};
}

void make_folder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path, error))
    fail(path, "create the folder", error ? error.message() : "not a folder", FailureKind::kUsage);
}

void remove_if_there(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  if (error) fail(path, "replace", error.message(), FailureKind::kFailure);
}

void write_file(const fs::path& path, std::string_view bytes) {
  Outcome<AtomicFile> file = AtomicFile::open(path.string());
  if (!file.ok()) throw WriteError{file.failure()};
  file->write(std::as_bytes(std::span(bytes)));  // commit() reports a failure
  const Outcome<void> committed = file->commit();
  if (!committed.ok()) throw WriteError{committed.failure()};
}

/// The suffix of a scan's file, by its folder.
const char* suffix_of(const fs::path& folder) {
  if (folder.parent_path().filename() == "cameras") return ".png";
  if (folder.filename() == kBeliefs) return kWeightedSuffix;
  const bool numbers = folder.filename() == "velodyne" || folder.filename() == "times";
  return numbers ? ".bin" : ".label";
}

/// True if the name is that of a scan with number >= scans, left from a longer run.
bool is_left_over(const fs::path& file, int scans) {
  const std::string stem = file.stem().string();
  const bool numbered =
      stem.size() == 6 && stem.find_first_not_of("0123456789") == std::string::npos;
  return numbered && file.extension() == suffix_of(file.parent_path()) && std::stoi(stem) >= scans;
}

void clear_left_overs(const fs::path& folder, int scans) {
  if (!fs::exists(folder)) return;
  std::vector<fs::path> left_over;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (is_left_over(entry.path(), scans)) left_over.push_back(entry.path());
  }
  for (const fs::path& path : left_over) remove_if_there(path);
}

/// Removes files of an earlier run with more options, which a reader would use.
void clear_folder(const fs::path& folder) {
  clear_left_overs(folder, 0);
  if (fs::exists(folder) && fs::is_empty(folder)) remove_if_there(folder);
}

Eigen::Isometry3d perturbed(const Eigen::Isometry3d& pose, const PoseError& error,
                            std::uint64_t hash) {
  street::Random random(hash);
  const auto draw = [&random](double sigma) {
    const double x = sigma * random.gaussian();
    const double y = sigma * random.gaussian();
    return Eigen::Vector3d(x, y, sigma * random.gaussian());
  };
  const Eigen::Vector3d shift = draw(error.translation_m);
  const Eigen::Vector3d turn = draw(error.rotation_deg * 3.141592653589793 / 180.0);
  Eigen::Isometry3d wrong = pose;
  wrong.translation() += shift;
  if (turn.norm() > 0.0)
    wrong.linear() =
        pose.linear() * Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  return wrong;
}

/// Marks a folder of this program, so that its scans may be replaced.
constexpr const char* kMarker = "simulated.txt";

/// Refuses a folder with foreign files, or with files that a reader of the dataset would use.
void check_folder(const fs::path& folder) {
  if (!fs::exists(folder) || fs::is_empty(folder)) return;
  if (!fs::exists(folder / kMarker)) {
    throw WriteError{{"cannot write " + folder.string() +
                      ": it has files that were not simulated; choose another folder"}};
  }
  for (const char* const name : {"calib.txt", "classes.toml"}) {
    if (fs::exists(folder / name)) {
      throw WriteError{
          {"cannot write " + folder.string() + ": it has a " + name +
           ", which is not part of a simulated dataset; remove it or choose another folder"}};
    }
  }
}

class Writer {
 public:
  Writer(const StreetSimulator& simulator, const fs::path& out, const DatasetWriterOptions& options)
      : simulator_(simulator), out_(out), options_(options) {}

  void write() {
    make_folder(out_);
    for (int robot = 0; robot < simulator_.config().robots; ++robot) check_folder(folder_of(robot));
    for (int robot = 0; robot < simulator_.config().robots; ++robot) write_robot(robot);
  }

 private:
  [[nodiscard]] fs::path folder_of(int robot) const {
    return out_ / (fmt::format("robot_{}", robot));
  }

  void write_robot(int robot) {
    const int scans = simulator_.config().scans;
    const fs::path folder = folder_of(robot);
    make_folder(folder);
    const SimulatorConfig& config = simulator_.config();
    write_file(folder / kMarker,
               fmt::format("scene {}, seed {}, robot {}, {} scans, starts {} m apart\n",
                           config.scene, config.seed, robot, scans, config.apart_m));
    for (const char* name : kScanFolders) {
      make_folder(folder / name);
      clear_left_overs(folder / name, scans);
    }
    remove_if_there(folder / "poses.txt");
    prepare_extras(folder);
    write_frames(folder, robot);
    if (options_.cameras || config.sweep) write_dense_poses(folder, robot);
    std::string poses;
    std::string times;
    for (int index = 0; index < scans; ++index) {
      write_scan(folder, robot, index);
      poses += rows_text(simulator_.T_map_sensor(robot, index), 3, ' ');
      times += text_of(index * street::kScanPeriod_s) + '\n';
    }
    write_file(folder / "times.txt", times);
    write_file(folder / "poses.txt", poses);
  }

  /// Makes the folders of cameras and times, or removes those of an earlier run.
  void prepare_extras(const fs::path& folder) {
    const int scans = simulator_.config().scans;
    const auto prepare = [scans](const fs::path& extra, bool wanted) {
      if (wanted) make_folder(extra);
      wanted ? clear_left_overs(extra, scans) : clear_folder(extra);
    };
    prepare(folder / "times", simulator_.config().sweep);
    prepare(folder / kBeliefs, simulator_.config().weighted_labels > 0);
    for (const char* name : {"cameras.toml", "poses_dense.txt"}) remove_if_there(folder / name);
    const std::vector<SimulatedCamera> cameras = simulator_.cameras();
    for (std::size_t camera = 0; camera < cameras.size(); ++camera)
      prepare(folder / "cameras" / std::to_string(camera), options_.cameras);
    if (options_.cameras)
      write_file(folder / "cameras.toml", street::cameras_toml(cameras));
    else
      clear_folder(folder / "cameras");
  }

  /// Every 10 ms, with two turns of the scanner before the first scan and after the last.
  void write_dense_poses(const fs::path& folder, int robot) {
    constexpr int kPosesPerScan = 10;
    constexpr int kAround = 2 * kPosesPerScan;
    std::string poses;
    for (int i = -kAround; i <= (simulator_.config().scans - 1) * kPosesPerScan + kAround; ++i) {
      const double stamp_s = i * street::kScanPeriod_s / kPosesPerScan;
      poses +=
          text_of(stamp_s) + ' ' + rows_text(simulator_.T_map_sensor_at(robot, stamp_s), 3, ' ');
    }
    write_file(folder / "poses_dense.txt", poses);
  }

  void write_images(const fs::path& folder, int robot, int index) {
    const int cameras = static_cast<int>(simulator_.cameras().size());
    for (int camera = 0; camera < cameras; ++camera) {
      const SimulatedLabelImage image = simulator_.label_image(robot, camera, index);
      const Outcome<std::vector<std::byte>> png =
          encode_png({image.width_px, image.height_px, 1, image.predictions.data()});
      if (!png.ok()) throw WriteError{png.failure()};
      write_file(folder / "cameras" / std::to_string(camera) / (scan_name(index) + ".png"),
                 {reinterpret_cast<const char*>(png->data()), png->size()});
    }
  }

  void write_frames(const fs::path& folder, int robot) {
    const Eigen::Isometry3d T_global_map = simulator_.T_global_map(robot);
    write_file(folder / "T_global_map.txt", rows_text(T_global_map, 4, '\n'));
    remove_if_there(folder / "T_global_map_perturbed.txt");
    const PoseError& error = options_.pose_error;
    if (error.translation_m <= 0.0 && error.rotation_deg <= 0.0) return;
    const std::uint64_t hash =
        street::hash_of(simulator_.config().seed, street::Stream::kPoseError, robot);
    write_file(folder / "T_global_map_perturbed.txt",
               rows_text(perturbed(T_global_map, error, hash), 4, '\n'));
  }

  void write_scan(const fs::path& folder, int robot, int index) {
    const SimulatedScan scan = simulator_.scan(robot, index);
    const std::string name = scan_name(index);
    write_file(folder / "velodyne" / (name + ".bin"), point_bytes(scan.points));
    write_file(folder / "labels" / (name + ".label"), label_bytes(scan.labels));
    write_file(folder / "predictions" / (name + ".label"), label_bytes(scan.predictions));
    if (!scan.beliefs.empty())
      write_file(folder / kBeliefs / (name + kWeightedSuffix), label_bytes(scan.beliefs));
    if (!scan.times_s.empty())
      write_file(folder / "times" / (name + ".bin"), number_bytes(scan.times_s));
    if (options_.cameras) write_images(folder, robot, index);
    ++done_;
    if (options_.progress) {
      options_.progress(done_, simulator_.config().robots * simulator_.config().scans);
    }
  }

  const StreetSimulator& simulator_;
  const fs::path& out_;
  const DatasetWriterOptions& options_;
  int done_ = 0;
};

bool is_sigma(double value) { return std::isfinite(value) && value >= 0.0; }

}  // namespace

Outcome<void> write_dataset(const StreetSimulator& simulator, const fs::path& out,
                            const DatasetWriterOptions& options) {
  if (!is_sigma(options.pose_error.translation_m) || !is_sigma(options.pose_error.rotation_deg)) {
    return Failure{"a pose error must be a finite number of metres or degrees; give zero or more"};
  }
  std::error_code ignored;
  if (fs::exists(out, ignored) && !fs::is_directory(out, ignored)) {
    return Failure{out.string() + " is not a folder; choose another name for the output"};
  }
  const fs::path beyond = out / (fmt::format("robot_{}", simulator.config().robots));
  if (fs::exists(beyond, ignored)) {
    return Failure{beyond.string() +
                   " is left from a run with more robots and would be mixed with this one; remove "
                   "it, or choose another folder"};
  }
  try {
    Writer(simulator, out, options).write();
  } catch (const WriteError& error) {
    return error.failure;
  } catch (const fs::filesystem_error& error) {
    return Failure{"cannot read the folder " + error.path1().string() + " (" +
                       error.code().message() + "); fix its permissions, or choose another folder",
                   FailureKind::kFailure};
  }
  return {};
}

}  // namespace tessera
