// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads cameras.toml. Every refusal names the file, the line and what to write instead.
#include "scans/cameras_toml.hpp"

#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "base/input_file.hpp"
#include "base/number_row.hpp"
#include "base/toml_nesting.hpp"

namespace tessera {
namespace {

constexpr double kMostOffset_s = 10.0;

constexpr std::array<std::string_view, 11> kKeys{
    "name",  "folder", "mask",       "model",          "width",       "height",
    "focal", "centre", "distortion", "T_camera_lidar", "stamp_offset"};

constexpr std::array<std::string_view, 11> kDepthKeys{
    "model",       "width",       "height", "focal",     "centre",   "distortion",
    "depth_scale", "depth_along", "step",   "min_depth", "max_depth"};

/// The keys that an entry may have, and the message if a required one is missing.
struct EntryKind {
  std::span<const std::string_view> keys;
  const char* needs;
};
constexpr EntryKind kCameraEntry{
    kKeys, "each [[camera]] needs name, model, width, height, focal, centre and T_camera_lidar"};
constexpr EntryKind kDepthEntry{
    kDepthKeys, "a depth camera needs model, width, height, focal, centre and depth_scale"};

/// One [[camera]] entry, or the file of a depth camera. Keeps the first error, and reads the rest
/// of the entry nevertheless.
class Entry {
 public:
  Entry(const toml::table& table, const std::string& path, const EntryKind& kind)
      : table_(table), path_(path), kind_(kind) {
    for (const auto& [key, value] : table) {
      const std::string_view known = key.str();
      if (std::find(kind.keys.begin(), kind.keys.end(), known) == kind.keys.end())
        refuse(value, "unknown key '" + std::string(known) + "' of a camera",
               "remove it or fix its name");
    }
  }

  [[nodiscard]] const std::optional<Failure>& failure() const { return failure_; }

  std::string text(const char* key, bool needed) {
    const toml::node* node = find(key, needed);
    if (node == nullptr) return {};
    const std::string value = node->is_string() ? node->as_string()->get() : std::string();
    if (value.empty() || value.find('\0') != std::string::npos)
      refuse(*node, std::string(key) + " is not a text", "write it in quotes");
    return value;
  }

  /// From 1 to most; 1 if an optional key is missing.
  int pixels(const char* key, bool needed = true, int most = CameraModel::kMostPixels) {
    const toml::node* node = find(key, needed);
    if (node == nullptr) return 1;
    const std::int64_t value = node->is_integer() ? node->as_integer()->get() : 0;
    if (value >= 1 && value <= most) return static_cast<int>(value);
    refuse(*node, std::string(key) + " is not a whole number of pixels",
           fmt::format("write 1 to {}", most));
    return 1;
  }

  /// A number in low .. high; otherwise, if an optional key is missing.
  double number(const char* key, bool needed, double low, double high, double otherwise) {
    const toml::node* node = find(key, needed);
    if (node == nullptr) return otherwise;
    const std::optional<double> value = node->value<double>();
    if (value && *value >= low && *value <= high) return *value;
    refuse(*node, std::string(key) + " is not a number in its range",
           fmt::format("write one from {} to {}", low, high));
    return otherwise;
  }

  double seconds(const char* key) {
    const toml::node* node = find(key, false);
    if (node == nullptr) return 0.0;
    const std::optional<double> value = node->value<double>();
    if (value && std::abs(*value) <= kMostOffset_s) return *value;
    refuse(*node, std::string(key) + " is not a number of seconds",
           "write seconds from -10 to 10, as in -0.02");
    return 0.0;
  }

  /// A list with one of the given counts; numbers that are not given stay 0.
  template <std::size_t N>
  std::array<double, N> numbers(const char* key, bool needed, std::span<const std::size_t> counts,
                                const char* remedy) {
    std::array<double, N> values{};
    const toml::node* node = find(key, needed);
    if (node == nullptr) return values;
    const toml::array* list = node->as_array();
    const std::size_t count = list == nullptr ? 0 : list->size();
    bool right = list != nullptr && std::find(counts.begin(), counts.end(), count) != counts.end();
    for (std::size_t i = 0; right && i < count; ++i) {
      const std::optional<double> value = (*list)[i].value<double>();
      right = value && std::isfinite(*value);
      if (right) values[i] = *value;
    }
    if (!right)
      refuse(*node, std::string(key) + " is not a list of numbers of the right length", remedy);
    return values;
  }

  void refuse(const toml::node& node, std::string_view what, std::string_view remedy) {
    if (!failure_) failure_ = text_failure({path_, node.source().begin.line}, what, remedy);
  }
  void refuse(const char* key, std::string_view what, std::string_view remedy) {
    const toml::node* node = table_.get(key);
    refuse(node == nullptr ? static_cast<const toml::node&>(table_) : *node, what, remedy);
  }

 private:
  const toml::node* find(const char* key, bool needed) {
    const toml::node* node = table_.get(key);
    if (node == nullptr && needed) {
      refuse(table_, std::string("this camera has no '") + key + "'", kind_.needs);
    }
    return node;
  }

  const toml::table& table_;
  const std::string& path_;
  EntryKind kind_;
  std::optional<Failure> failure_;
};

CameraIntrinsics read_intrinsics(Entry& entry) {
  constexpr std::array<std::size_t, 1> kTwo{2};
  CameraIntrinsics c;
  const std::string model = entry.text("model", true);
  c.kind = model == "fisheye" ? CameraKind::kFisheye : CameraKind::kPinhole;
  if (model != "fisheye" && model != "pinhole")
    entry.refuse("model", "unknown model '" + one_line(model) + "'",
                 "write \"pinhole\" or \"fisheye\"");
  c.width_px = entry.pixels("width");
  c.height_px = entry.pixels("height");
  constexpr const char* kRemedy = "write two numbers of pixels, [x, y]";
  const auto focal = entry.numbers<2>("focal", true, kTwo, kRemedy);
  const auto centre = entry.numbers<2>("centre", true, kTwo, kRemedy);
  c.focal_x_px = focal[0];
  c.focal_y_px = focal[1];
  c.centre_x_px = centre[0];
  c.centre_y_px = centre[1];
  constexpr std::array<std::size_t, 3> kPinholeCounts{2, 4, 5};
  constexpr std::array<std::size_t, 1> kFisheyeCounts{4};
  c.distortion =
      c.kind == CameraKind::kPinhole
          ? entry.numbers<5>("distortion", false, kPinholeCounts,
                             "write [k1, k2], [k1, k2, p1, p2] or [k1, k2, p1, p2, k3]")
          : entry.numbers<5>("distortion", false, kFisheyeCounts, "write [k1, k2, k3, k4]");
  return c;
}

void make_model(Entry& entry, CameraModel& into) {
  const Result<CameraModel> model = CameraModel::make(read_intrinsics(entry));
  if (model.ok()) {
    into = *model;
  } else if (model.status() == Status::kMismatch) {
    entry.refuse("distortion", "this distortion folds the image onto itself",
                 "check the numbers, their order and the focal lengths; a lens has one pixel for "
                 "each direction");
  } else {
    entry.refuse("focal", "focal lengths, centre and distortion are not those of a camera",
                 "write focal lengths above 0, and no number over a million");
  }
}

Outcome<CameraDescription> read_camera(const toml::table& table, const std::string& path) {
  constexpr std::array<std::size_t, 1> kTwelve{12};
  Entry entry(table, path, kCameraEntry);
  CameraDescription camera;
  camera.name = entry.text("name", true);
  camera.folder = entry.text("folder", false);
  camera.mask = entry.text("mask", false);
  make_model(entry, camera.model);
  const auto T = entry.numbers<12>("T_camera_lidar", true, kTwelve,
                                   "write the 3x4 matrix [R | t] by rows, 12 numbers");
  std::copy(T.begin(), T.end(), camera.T_camera_lidar.data());
  if (check_rigid(camera.T_camera_lidar) != Status::kOk)
    entry.refuse("T_camera_lidar", "it is not a rigid transform",
                 "write [R | t] by rows, R a rotation with at least four digits");
  camera.offset_us = std::llround(entry.seconds("stamp_offset") * 1e6);
  if (entry.failure()) return *entry.failure();
  return camera;
}

Outcome<DepthCameraDescription> read_depth_entry(const toml::table& root, const std::string& path) {
  Entry entry(root, path, kDepthEntry);
  DepthCameraDescription camera;
  make_model(entry, camera.model);
  camera.depth_scale_m = entry.number("depth_scale", true, 1e-6, 1.0, 0.001);
  const std::string along =
      root.contains("depth_along") ? entry.text("depth_along", false) : "axis";
  if (along != "axis" && along != "ray")
    entry.refuse("depth_along", "depth_along is '" + one_line(along) + "'",
                 "write \"axis\" or \"ray\"");
  camera.depth.along = along == "ray" ? DepthAlong::kRay : DepthAlong::kAxis;
  camera.depth.step_px = entry.pixels("step", false, 64);
  camera.depth.min_depth_m = static_cast<float>(entry.number("min_depth", false, 0.0, 1000.0, 0.2));
  camera.depth.max_depth_m =
      static_cast<float>(entry.number("max_depth", false, 0.0, 1000.0, 10.0));
  if (camera.depth.min_depth_m > camera.depth.max_depth_m)
    entry.refuse("max_depth", "max_depth is less than min_depth", "give a larger max_depth");
  if (entry.failure()) return *entry.failure();
  return camera;
}

Outcome<std::vector<CameraDescription>> read_entries(const toml::table& root,
                                                     const std::string& path) {
  const toml::array* entries = root["camera"].as_array();
  if (entries == nullptr || entries->empty())
    return Failure{path + " has no [[camera]] entry; add one for each camera"};
  if (entries->size() > kMostCameras)
    return Failure{
        fmt::format("{} has {} cameras; keep {} of them", path, entries->size(), kMostCameras)};
  std::vector<CameraDescription> cameras;
  for (const toml::node& node : *entries) {
    const TextPlace place{path, node.source().begin.line};
    const toml::table* table = node.as_table();
    if (table == nullptr) return text_failure(place, "camera is not a table", "write [[camera]]");
    TESSERA_TRY_ASSIGN(CameraDescription camera, read_camera(*table, path));
    for (const CameraDescription& other : cameras) {
      if (other.name == camera.name)
        return text_failure(place, "duplicate name '" + camera.name + "'",
                            "give each camera its own name");
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

Failure not_toml(const toml::parse_error& error, const std::string& path) {
  return text_failure({path, error.source().begin.line},
                      "not valid TOML (" + std::string(error.description()) + ")",
                      "fix the syntax");
}

}  // namespace

Outcome<std::vector<CameraDescription>> parse_cameras(std::string_view text,
                                                      const std::string& path) {
  TESSERA_TRY(check_nesting(text, path));
  try {
    return read_entries(toml::parse(text), path);
  } catch (const toml::parse_error& error) {
    return not_toml(error, path);
  }
}

Outcome<DepthCameraDescription> parse_depth_camera(std::string_view text, const std::string& path) {
  TESSERA_TRY(check_nesting(text, path));
  try {
    return read_depth_entry(toml::parse(text), path);
  } catch (const toml::parse_error& error) {
    return not_toml(error, path);
  }
}

Outcome<DepthCameraDescription> read_depth_camera(const std::string& path) {
  TESSERA_TRY_ASSIGN(const std::string text, read_text_file(path, kMostDescriptionBytes));
  return parse_depth_camera(text, path);
}

Outcome<std::vector<CameraDescription>> read_cameras(const std::string& path) {
  TESSERA_TRY_ASSIGN(const std::string text, read_text_file(path, kMostDescriptionBytes));
  return parse_cameras(text, path);
}

}  // namespace tessera
