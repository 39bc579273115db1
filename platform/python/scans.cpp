// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera.Dataset, tessera.Clouds and single files.
#include "scans.hpp"

#include <fmt/core.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <mutex>

#include "arrays.hpp"
#include "class_table.hpp"
#include "fusing.hpp"
#include "scans/cloud_folder.hpp"
#include "scans/dataset.hpp"
#include "scans/pcd_reader.hpp"
#include "scans/ply_reader.hpp"
#include "scans/transform_file.hpp"

namespace tessera::python {

namespace {

/// A registered scan with its memory, which views of it keep alive.
struct ReadScan {
  std::shared_ptr<Scan> scan;

  template <class T>
  [[nodiscard]] py::array_t<T> view(std::span<const T> values, std::size_t columns) const {
    const py::capsule owner(new std::shared_ptr<Scan>(scan), [](void* pointer) {
      delete static_cast<std::shared_ptr<Scan>*>(pointer);
    });
    return array_over(values, columns, owner);
  }
  /// (N,), or (N, K) where labels have weights.
  [[nodiscard]] py::array_t<std::uint8_t> labels_view(std::span<const std::uint8_t> values) const {
    return view(values.first(count() * scan->labels_per_point),
                scan->has_label_weights ? scan->labels_per_point : 0);
  }
  [[nodiscard]] std::size_t count() const { return scan->count; }
};

/// Scans of any kind; read one at a time.
class Scans {
 public:
  Scans(std::unique_ptr<RecordedScans> scans, const Dataset* dataset)
      : scans_(std::move(scans)),
        dataset_(dataset),
        reader_(value_of(ScanReader::make(*scans_))),
        classes_(classes_of(DatasetClasses(scans_->classes()))) {}

  [[nodiscard]] std::size_t size() const { return scans_->num_scans(); }
  [[nodiscard]] const Classes& classes() const { return classes_; }
  [[nodiscard]] std::size_t place_of(py::ssize_t i) const {
    const auto n = static_cast<py::ssize_t>(size());
    if (i < -n || i >= n) throw py::index_error(fmt::format("there are {} scans", n));
    return static_cast<std::size_t>(i < 0 ? i + n : i);
  }
  [[nodiscard]] ReadScan at(py::ssize_t i) const {
    const std::size_t place = place_of(i);
    const py::gil_scoped_release released;
    const std::scoped_lock lock(mutex_);
    ScanLimits limits = scans_->registration().limits;
    limits.points = scans_->num_points(place);
    auto scan = std::make_shared<Scan>(limits);
    static_cast<void>(value_of(reader_.read(place, *scan)));
    return {std::move(scan)};
  }
  [[nodiscard]] py::array_t<std::uint8_t> labels(py::ssize_t i, const std::string& folder) const {
    const std::size_t place = place_of(i);
    if (dataset_ == nullptr)
      throw InputError("clouds have their labels in their files; use scan.components");
    std::vector<std::uint8_t> components(dataset_->num_points(place));
    {
      const py::gil_scoped_release released;
      const std::scoped_lock lock(mutex_);
      check(dataset_->check_labels(folder));
      static_cast<void>(value_of(dataset_->read_labels(place, folder, components)));
    }
    return array_taking(std::move(components));
  }

 private:
  std::unique_ptr<RecordedScans> scans_;
  const Dataset* dataset_;
  mutable ScanReader reader_;
  Classes classes_;
  mutable std::mutex mutex_;
};
struct KittiScans : Scans {
  using Scans::Scans;
};
struct CloudScans : Scans {
  using Scans::Scans;
};

std::optional<int> number_of(const std::optional<std::int64_t>& given, const char* name) {
  return given ? std::optional(in_range<int>(*given, name)) : std::nullopt;
}

std::shared_ptr<KittiScans> open_kitti(const std::filesystem::path& folder,
                                       const std::optional<std::int64_t>& first,
                                       const std::optional<std::int64_t>& last,
                                       const std::string& labels,
                                       const std::optional<bool>& deskew) {
  const std::optional<int> from = number_of(first, "first");
  const std::optional<int> to = number_of(last, "last");
  const py::gil_scoped_release released;
  auto dataset = std::make_unique<Dataset>(value_of(
      Dataset::open(folder.string(),
                    {.first = from, .last = to, .labels = labels, .deskew = deskewing(deskew)})));
  const Dataset* const kitti = dataset.get();
  return std::make_shared<KittiScans>(std::move(dataset), kitti);
}

CloudFormat format_of(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".pcd") return CloudFormat::kPcd;
  if (extension == ".ply") return CloudFormat::kPly;
  throw InputError(one_line(path.string()) + " is neither .pcd nor .ply; give one of these");
}

std::shared_ptr<CloudScans> open_clouds(const std::filesystem::path& folder,
                                        const std::filesystem::path& poses,
                                        const std::string& format,
                                        const std::optional<std::int64_t>& first,
                                        const std::optional<std::int64_t>& last) {
  if (format != "pcd" && format != "ply")
    throw InputError("format " + one_line(format) + " is not allowed; give pcd or ply");
  const std::optional<int> from = number_of(first, "first");
  const std::optional<int> to = number_of(last, "last");
  const py::gil_scoped_release released;
  auto clouds = std::make_unique<CloudFolder>(value_of(CloudFolder::open(
      folder.string(), {.format = format == "pcd" ? CloudFormat::kPcd : CloudFormat::kPly,
                        .poses = poses.string(),
                        .first = from,
                        .last = to})));
  return std::make_shared<CloudScans>(std::move(clouds), nullptr);
}

py::tuple read_cloud(const std::filesystem::path& path) {
  const CloudFormat format = format_of(path);
  Cloud cloud;
  {
    const py::gil_scoped_release released;
    const std::string bytes = value_of(read_cloud_bytes(path.string()));
    const std::string name = path.string();
    check(format == CloudFormat::kPcd ? read_pcd({name, bytes}, cloud)
                                      : read_ply({name, bytes}, cloud));
  }
  const bool has_ids = !cloud.raw_ids.empty();
  py::object ids = py::none();
  if (has_ids) ids = array_taking(std::move(cloud.raw_ids));
  return py::make_tuple(array_taking(std::move(cloud.points_xyzi), 4), ids);
}

template <class T>
void add_reading(py::class_<T, std::shared_ptr<T>>& type) {
  type.def_property_readonly(
          "classes", [](const T& s) { return s.classes(); }, "Their ClassTable.")
      .def("__len__", [](const T& s) { return s.size(); })
      .def(
          "__getitem__", [](const T& s, py::ssize_t i) { return s.at(i); }, py::arg("i"),
          "Reads scan i. Raises IndexError, and Error or InputError iff its files can no longer be "
          "read.");
}

}  // namespace

void add_scans(py::module_& module) {
  py::class_<ReadScan>(module, "Scan", "A recorded scan; its arrays are views of its own memory.")
      .def_property_readonly(
          "number", [](const ReadScan& s) { return s.scan->number; },
          "Number in the name of the file.")
      .def_property_readonly(
          "points",
          [](const ReadScan& s) {
            return s.view(std::span<const float>(s.scan->points()).first(4 * s.count()), 4);
          },
          "(N, 4) float32: x y z, metres, sensor frame, and intensity.")
      .def_property_readonly(
          "components", [](const ReadScan& s) { return s.labels_view(s.scan->components()); },
          "(N,) uint8: 1 .. C, or C + 1 for an unknown class; (N, K) where label_weights is not "
          "None.")
      .def_property_readonly(
          "label_weights",
          [](const ReadScan& s) -> py::object {
            if (!s.scan->has_label_weights) return py::none();
            return s.labels_view(s.scan->label_weights());
          },
          "(N, K) uint8, 255ths, of components; None: each point has one label.")
      .def_property_readonly(
          "T_map_sensor", [](const ReadScan& s) { return array_of(s.scan->T_map_sensor); },
          "(4, 4) float64, as recorded: may be not rigid.")
      .def_property_readonly(
          "has_pose",
          [](const ReadScan& s) { return check_rigid(s.scan->T_map_sensor) == Status::kOk; },
          "T_map_sensor is a rigid transform; LocalMap.integrate raises if it is not.")
      .def_property_readonly(
          "unknown_ids", [](const ReadScan& s) { return s.scan->unknown.points; },
          "Points whose raw id is in no class.");
  py::class_<KittiScans, std::shared_ptr<KittiScans>> kitti(
      module, "Dataset",
      "A folder in the layout of KITTI odometry and SemanticKITTI; a sequence of Scan.");
  kitti
      .def(
          py::init(&open_kitti), py::arg("folder"), py::kw_only(), py::arg("first") = py::none(),
          py::arg("last") = py::none(), py::arg("labels") = DatasetOptions{}.labels,
          py::arg("deskew") = py::none(),
          R"(first, last: scan numbers, inclusive. labels: the folder of labels to use, "cameras" or "none".

deskew: None: if there are times of points. Raises InputError iff something is missing or does not
match; docs/reference/cli.md has the layout.)")
      .def(
          "labels",
          [](const KittiScans& s, py::ssize_t i, const std::string& folder) {
            return s.labels(i, folder);
          },
          py::arg("i"), py::arg("folder") = "labels",
          "(N,) uint8 components of scan i from another folder: the truth. Raises as opening "
          "does.");
  add_reading(kitti);
  py::class_<CloudScans, std::shared_ptr<CloudScans>> clouds(
      module, "Clouds", "A folder of PCD or PLY files with a file of poses; a sequence of Scan.");
  clouds.def(
      py::init(&open_clouds), py::arg("folder"), py::arg("poses"), py::arg("format") = "pcd",
      py::kw_only(), py::arg("first") = py::none(), py::arg("last") = py::none(),
      R"(poses: KITTI rows of 12 numbers, TUM rows of 8, or 4x4 rows of 16; format: "pcd" or "ply".

Raises InputError iff something is missing, malformed or does not match.)");
  add_reading(clouds);
  module.def(
      "read_cloud", &read_cloud, py::arg("path"),
      R"(Points (N, 4) float32 x y z intensity of a .pcd or .ply file, and (N,) int64 raw ids or None.

Raises InputError iff it is malformed, Error iff it cannot be read.)");
  module.def(
      "read_transform",
      [](const std::filesystem::path& path) {
        return array_of(value_of(read_transform(path.string())));
      },
      py::arg("path"),
      "(4, 4) float64 of a text file: a rigid transform, row by row. Raises InputError.");
}

}  // namespace tessera::python
