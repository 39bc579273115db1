// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A recorded sequence in the folder layout of KITTI odometry and SemanticKITTI:
// velodyne/NNNNNN.bin, <labels>/NNNNNN.label, poses.txt, calib.txt, classes.toml; and, beyond that
// layout, times/NNNNNN.bin (a float32 per point, seconds from the scan's stamp), times.txt,
// poses_dense.txt, cameras.toml and the cameras' NNNNNN.png of class numbers. open() checks by
// names and sizes alone that everything exists and matches; read() then reads one scan at a time
// into memory that is allocated once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/outcome.hpp"
#include "scans/camera_labels.hpp"
#include "scans/dataset_classes.hpp"
#include "scans/scan_listing.hpp"
#include "scans/scan_motion.hpp"
#include "tessera/base/geometry.hpp"
#include "tessera/registration/depth_image.hpp"
#include "tessera/registration/deskew.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

inline constexpr std::string_view kNoLabels = "none";
/// Labels by projection from the cameras of cameras.toml.
inline constexpr std::string_view kCameraLabels = "cameras";

/// Whether scans with times of their points are corrected for the robot's motion.
enum class Deskewing : std::uint8_t {
  kWhereTimed,  ///< If the dataset has a folder times.
  kOn,          ///< Refuses a dataset without it.
  kOff,
};

/// "on", "off", or "" for kWhereTimed. Fails with kUsage iff it is something else.
Outcome<Deskewing> parse_deskewing(std::string_view text);

struct DatasetOptions {
  std::optional<int> first;  ///< Scan number; by default the lowest.
  std::optional<int> last;   ///< Inclusive; by default the highest.
  /// Folder of labels to use, kCameraLabels or kNoLabels.
  std::string labels = "predictions";
  Deskewing deskew = Deskewing::kWhereTimed;
  /// Also load the robot's motion, and check the times of points, if the dataset has them and this
  /// class itself needs neither.
  bool with_motion = false;
};

/// Raw label ids that the classes do not know, in one scan.
struct UnknownRawIds {
  static constexpr std::size_t kMaxExamples = 8;

  std::uint64_t points = 0;
  std::array<std::uint16_t, kMaxExamples>
      examples{};  ///< Different ids, in the order of their appearance.
  std::size_t num_examples = 0;

  void add(std::uint16_t raw_id) noexcept;
};

/// Memory into which scans are read.
class ScanBuffer {
 public:
  explicit ScanBuffer(std::size_t max_points) { reserve(max_points); }
  /// Grows if necessary; never shrinks.
  void reserve(std::size_t max_points);
  /// The memory of a scan with this number of points; reserves it if necessary.
  [[nodiscard]] std::span<float> points_xyzi(std::size_t num_points);
  [[nodiscard]] std::span<std::uint8_t> components(std::size_t num_points);

 private:
  friend class Dataset;
  std::vector<float> points_xyzi_;
  std::vector<std::uint8_t> components_;
  std::vector<float> times_s_;
};

/// One scan. The spans point into the ScanBuffer that it was read into, until the next read.
struct DatasetScan {
  int number = 0;
  /// x y z in metres, sensor frame, and intensity; as stored, or deskewed.
  std::span<const float> points_xyzi;
  std::span<const std::uint8_t> components;  ///< One per point: 1 .. C, or C + 1.
  UnknownRawIds unknown;
  std::optional<DeskewReport> deskew;              ///< If motion was corrected.
  std::optional<LabelReport> projection;           ///< If the labels are from cameras.
  std::optional<DepthReport> depth{};              ///< If the scan is a depth image.
  Matrix34d T_map_sensor = Matrix34d::Identity();  ///< As recorded: may be not rigid or not finite.

  [[nodiscard]] std::size_t num_points() const noexcept { return components.size(); }
  /// The input of the library.
  [[nodiscard]] ScanView view() const noexcept;
};

/// A source of scans to map.
class RecordedScans {
 public:
  virtual ~RecordedScans() = default;
  [[nodiscard]] virtual std::size_t num_scans() const noexcept = 0;
  /// Points of the largest scan; the size that a ScanBuffer needs.
  [[nodiscard]] virtual std::size_t max_points() const noexcept = 0;
  [[nodiscard]] virtual const DatasetClasses& classes() const noexcept = 0;
  /// True if read() uses the heap for decoding files.
  [[nodiscard]] virtual bool decodes() const noexcept = 0;
  /// Reads scan i, one at a time.
  virtual Outcome<DatasetScan> read(std::size_t i, ScanBuffer& buffer) const = 0;

 protected:
  RecordedScans() = default;
  RecordedScans(const RecordedScans&) = default;
  RecordedScans& operator=(const RecordedScans&) = default;
  RecordedScans(RecordedScans&&) = default;
  RecordedScans& operator=(RecordedScans&&) = default;
};

class Dataset final : public RecordedScans {
 public:
  /// Fails with kUsage, naming the file and the remedy, iff: a folder (dir, velodyne, the labels)
  /// or poses.txt is missing; there are no scans in the range; poses.txt has no row for a scan; a
  /// .bin is not a multiple of 16 bytes or has more than 2^24 points; a label file is missing or
  /// has another number of points; poses.txt, calib.txt or classes.toml are malformed; if scans
  /// are deskewed, a file of times is missing or has another number of points, or ScanMotion::load
  /// fails; if the labels are from cameras, CameraLabels::open fails, an image is missing, or
  /// ScanMotion::load fails and is needed. Scans may be empty.
  static Outcome<Dataset> open(const std::string& dir, const DatasetOptions& options = {});

  [[nodiscard]] std::size_t num_scans() const noexcept override { return scans_.size(); }
  [[nodiscard]] int scan_number(std::size_t i) const { return scans_[i].number; }
  [[nodiscard]] std::size_t num_points(std::size_t i) const { return scans_[i].points; }
  [[nodiscard]] std::size_t max_points() const noexcept override { return max_points_; }
  [[nodiscard]] const DatasetClasses& classes() const noexcept override { return classes_; }
  [[nodiscard]] bool decodes() const noexcept override { return cameras_ != nullptr; }
  /// True if scans have labels from a folder.
  [[nodiscard]] bool has_labels() const noexcept {
    return labels_ != kNoLabels && labels_ != kCameraLabels;
  }
  [[nodiscard]] bool deskews() const noexcept { return deskews_; }
  /// Pose of scan i, as recorded: may be not rigid or not finite.
  [[nodiscard]] const Matrix34d& T_map_sensor(std::size_t i) const {
    return scans_[i].T_map_sensor;
  }
  /// Null unless scans are deskewed, cameras have offsets, or DatasetOptions::with_motion.
  [[nodiscard]] const ScanMotion* motion() const noexcept { return motion_ ? &*motion_ : nullptr; }
  /// True if read_times() may be called: scans are deskewed, or there are times and with_motion.
  [[nodiscard]] bool has_times() const noexcept { return has_times_; }
  /// Null unless the labels are from cameras.
  [[nodiscard]] const CameraLabels* cameras() const noexcept { return cameras_.get(); }
  /// Runs of numbers within the chosen range that have no scan, for a warning (to_text()).
  [[nodiscard]] const std::vector<ScanRange>& missing() const noexcept { return missing_; }

  /// Reads scan i, one at a time. Does not use the heap if the buffer holds max_points() and
  /// nothing fails, except for decoding the cameras' images. Fails with kFailure iff a file can no
  /// longer be read or has changed its size since open(), with kUsage iff CameraLabels::read does.
  Outcome<DatasetScan> read(std::size_t i, ScanBuffer& buffer) const override;

  /// Checks another folder of labels, for example ground truth, as open() does. Fails with kUsage.
  Outcome<void> check_labels(const std::string& folder) const;
  /// Reads the labels of scan i from that folder as components; out.size() must be num_points(i).
  /// No heap unless it fails, as read() does.
  Outcome<UnknownRawIds> read_labels(std::size_t i, std::string_view folder,
                                     std::span<std::uint8_t> out) const;

  /// Reads the times of the points of scan i, seconds from its stamp; out.size() must be
  /// num_points(i), and has_times(). No heap unless it fails, as read() does.
  Outcome<void> read_times(std::size_t i, std::span<float> out) const;

 private:
  struct Entry {
    int number = 0;
    std::size_t points = 0;
    Matrix34d T_map_sensor = Matrix34d::Identity();
  };

  Dataset(std::string dir, DatasetClasses classes, std::string labels);
  Outcome<void> choose_scans(const DatasetOptions& options);
  Outcome<void> measure_scans();
  Outcome<void> attach_poses();
  Outcome<void> check_times();
  Outcome<void> check_cameras();
  Outcome<DeskewReport> deskew(std::size_t i, ScanBuffer& buffer) const;
  Outcome<void> read_components(std::size_t i, std::span<std::uint8_t> out,
                                DatasetScan& scan) const;
  Outcome<void> check_label_files(const std::string& folder, std::string_view remedy) const;

  std::string dir_;
  DatasetClasses classes_;
  std::string labels_;
  bool deskews_ = false;
  bool has_times_ = false;
  bool wants_motion_ = false;  ///< If the dataset has any.
  std::optional<ScanMotion> motion_;
  std::unique_ptr<CameraLabels> cameras_;
  std::vector<Entry> scans_;
  std::vector<ScanRange> missing_;
  std::size_t max_points_ = 0;
};

}  // namespace tessera
