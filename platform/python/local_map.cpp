// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera.LocalMap.
#include <fmt/core.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>

#include "arrays.hpp"
#include "base/number_text.hpp"
#include "fusing.hpp"
#include "held_map.hpp"
#include "label_arrays.hpp"
#include "report.hpp"
#include "scans/scan_losses.hpp"
#include "settings.hpp"
#include "teammates.hpp"

namespace tessera::python {

namespace {

/// Before anything is integrated: if warnings are errors, the map is unchanged.
void warn_of_sampling(std::size_t points, std::size_t most) {
  if (points <= most) return;
  warn_of(
      {fmt::format("{} points are more than max_points {}: the scan is sampled evenly; make the "
                   "map with a larger max_points",
                   points, most)});
}

/// Warns of labels that are in no class, and if nothing was mapped: once of each.
void warn_of_losses(HeldLocalMap& map, const IntegrationReport& report) {
  std::vector<Message> warnings;
  if (report.unknown.points > 0 && map.is_first(LabelWarning::kUnknownIds))
    warnings.emplace_back(text_of(report.unknown) + "; taken as unlabelled");
  if (report.too_high > 0 && map.is_first(LabelWarning::kHighLabels)) {
    const ClassTable& classes = map.classes();
    warnings.emplace_back(fmt::format(
        "{} with uint8 labels above {}; taken as unlabelled: give 1 to {}, or {} for unlabelled; "
        "raw ids as uint16 or uint32",
        counted(report.too_high, "point"), classes.unlabelled(), classes.num_classes(),
        classes.unlabelled()));
  }
  ScanTotals totals;
  totals.add(report.scan);
  const auto why = why_nothing_mapped(totals);
  if (why && map.is_first(*why)) warnings.push_back(text_of(*why, totals));
  warn_of(warnings);
}

IntegrationReport integrate(
    HeldLocalMap& map, const py::array& points, const std::optional<py::array>& labels,
    const std::optional<PoseArray>& T_map_sensor, const std::optional<py::array>& weights,
    const std::optional<std::int64_t>& stamp_us, const std::optional<PoseArray>& T_body_sensor,
    const std::optional<py::array>& no_return, const std::optional<py::list>& teammates,
    const std::optional<py::array>& label_weights) {
  const PointsView view = points_of(points, "points");
  ScanView scan;
  scan.points = view.points;
  scan.stride_floats = view.stride_floats;
  scan.count = view.count;
  const LabelsView given = labels_of(labels, view.count, "labels", label_weights.has_value());
  scan.labels_per_point = given.per_point;
  if (!given.are_components() && map.class_table().raw_ids == nullptr) {
    throw InputError(
        "labels are raw ids, which a map file does not know; give components (uint8), or load the "
        "map with the data set's classes");
  }
  if (weights) scan.weights = weights_of(*weights, view.count);
  std::vector<std::uint8_t> quantised;
  if (label_weights) scan.label_weights = label_weights_of(*label_weights, given, quantised);
  if (no_return) scan.no_return = flags_of(*no_return, "no_return", view.count);
  scan.T_map_sensor = pose_of(T_map_sensor, "T_map_sensor");
  scan.T_body_sensor = pose_of(T_body_sensor, "T_body_sensor");
  check(check_body(map.setup().inference.body, scan.T_body_sensor, "the sensor"));
  const std::vector<PlacedBox> boxes = boxes_of(teammates);
  scan.teammates = boxes;
  warn_of_sampling(view.count, map.max_points());
  const IntegrationReport report = map.integrate(scan, given, stamp_us);
  if (report.scan.pose != Status::kOk) {
    throw InputError(
        "T_map_sensor puts the sensor outside of the grid, 2^23 voxels from its middle; "
        "nothing was integrated");
  }
  warn_of_losses(map, report);
  if (!report.kept.ok()) raise(report.kept.failure());
  return report;
}

py::dict correct(HeldLocalMap& map, const StampArray& stamps_us, const PoseArray& T_world_sensor,
                 std::int64_t revision) {
  const StampedPoses poses = stamped_poses_of(stamps_us, T_world_sensor);
  const auto number = in_range<std::uint32_t>(revision, "revision");
  const CorrectionReport report = map.write([&](Mapper&) {
    HeldSubmaps* const submaps = map.submaps();
    return submaps == nullptr ? CorrectionReport{.status = Status::kUnsupported}
                              : submaps->frames().correct(
                                    CorrectedTrajectory{poses.stamps_us, poses.transforms}, number);
  });
  return correction_of(report);
}

py::list submaps_of(HeldLocalMap& map) {
  struct One {
    std::uint32_t number = 0;
    std::uint32_t revision = 1;
    Matrix34d T_world_map = Matrix34d::Identity();
  };
  const std::vector<One> all = map.write([&](Mapper&) {
    std::vector<One> found;
    HeldSubmaps* const submaps = map.submaps();
    if (submaps == nullptr) return std::vector<One>(1);
    const SubmapFrames& frames = submaps->frames();
    for (std::uint32_t i = frames.first(); i <= frames.last(); ++i)
      found.push_back({i, frames.revision_of(i), frames.frame(i)});
    return found;
  });
  py::list list;
  for (const One& one : all) {
    py::dict d;
    d["number"] = one.number;
    d["revision"] = one.revision;
    d["T_world_map"] = array_of(one.T_world_map);
    list.append(d);
  }
  return list;
}

py::dict usage(const HeldLocalMap& map) {
  struct Figures {
    MapUsage usage;
    std::uint64_t free_voxels;
  };
  const Figures f = map.read([](const LocalMap& m) {
    return Figures{m.usage(), m.count_free_voxels()};
  });
  py::dict d;
  d["budget_bytes"] = map.setup().budget_bytes;
  d["used_bytes"] = f.usage.used_bytes;
  d["peak_bytes"] = f.usage.peak_bytes;
  d["scratch_bytes"] = map.scratch_bytes();
  d["label_voxels"] = f.usage.label_voxels;
  d["free_voxels"] = f.free_voxels;
  d["bytes_per_label_voxel"] =
      f.usage.label_voxels == 0
          ? 0.0
          : static_cast<double>(f.usage.used_bytes) / static_cast<double>(f.usage.label_voxels);
  d["blocks"] = f.usage.blocks;
  d["blocks_refused"] = f.usage.blocks_refused;
  d["storage_refused"] = f.usage.storage_refused;
  d["refused"] = left_out_for_memory(map.totals());
  return d;
}

Classes given_classes(const std::optional<Classes>& classes) {
  return classes ? *classes : classes_of(DatasetClasses::semantic_kitti());
}

constexpr const char* kIntegrate = R"(Adds one scan's evidence and returns a ScanReport.

points: (N, 3) or wider float32, x y z first, metres, sensor frame; not copied. labels: (N,) uint8 components (1 .. C; anything else is
unlabelled), or uint16 or uint32 raw ids (the lower 16 bits); None: all unlabelled. T_map_sensor: (4, 4) or (3, 4), sensor to map, metres;
None: the identity. weights: (N,) float32, 0 .. 1e6; None: all 1. stamp_us: of the scan, for correct(); None: the time now, of a monotonic
clock. T_body_sensor: (4, 4) or (3, 4), for the boxes of body; None: the identity. no_return: (N,) bool, true where nothing came back from
the direction of a point; None: all did. teammates: of Sharer.teammates(); returns on these robots are left out. label_weights: of the shape
of labels, which may be (N, 1 .. 3) then: float32 or float64 probabilities, or uint8 in 255ths; what they leave of one is unlabelled; None:
a point has one label, with all of its weight.

Refused points are counted in the report; a scan of more than max_points is sampled, with a UserWarning. The first scan that has no points,
or whose points are all beyond max_range_m or left out, or with labels in no class, gets a UserWarning too; it is integrated even where
warnings are errors. Raises TypeError iff an array is of another type; InputError iff of another shape, the layout of points or weights is
unusable, the pose is not rigid or outside of the grid, a box of body holds the sensor, raw ids are given and not known, or probabilities of a
point are negative, not finite or sum to over 1.002. The map is then unchanged. Raises Error iff a submap that has ended cannot be written; the scan is in the map, and the next one tries again. The GIL is
released; the arrays must not be written to meanwhile.)";

constexpr const char* kCorrect = R"(Moves the submaps to where a corrected trajectory has them.

stamps_us: (N,) int64, ascending, of the clock of integrate()'s. T_world_sensor: (N, 4, 4) or (N, 3, 4). revision: above that of the last
correction, from 1. Returns a dict: moved (submaps), most_m, residual_m and revision. A map that is shared is corrected by Sharer.correct,
which moves both. Raises InputError iff the map is not in submaps, shapes are others, a pose is not rigid or over 524 km away, stamps do not
ascend, or the revision is not above; nothing is changed then.)";

/// Settings of Python alone: the command knows its scans before it makes the map.
struct ScanOptions {
  std::uint32_t max_points = ScanCapacity{}.points;
};
constexpr Setting kScanRows[] = {
    row<&ScanOptions::max_points>({.argument = "max_points"},
                                  "Most points of a scan; a larger scan is sampled evenly",
                                  {.allowed = from_to(1.0, ScanCapacity::kMaxPoints)}),
};
constexpr SettingTable<ScanOptions> kScanSettings{kScanRows};

std::shared_ptr<HeldLocalMap> make(const std::optional<Classes>& classes,
                                   const std::optional<PoseArray>& T_global_map,
                                   py::dict settings) {
  MapOptions options;
  ScanOptions scans;
  take_settings(settings, kMapSettings, options);
  take_settings(settings, kScanSettings, scans);
  refuse_others(settings, "LocalMap");
  std::optional<Matrix34d> T;
  if (T_global_map) T = pose_of(T_global_map, "T_global_map");
  return HeldLocalMap::make(options, given_classes(classes), T, scans.max_points);
}

std::shared_ptr<HeldLocalMap> load(const std::filesystem::path& path,
                                   const std::optional<Classes>& classes, py::dict settings) {
  MapOptions options;
  ScanOptions scans;
  take_settings(settings, kMapSettings, options, false);
  take_settings(settings, kScanSettings, scans);
  refuse_others(settings, "LocalMap.load");
  return HeldLocalMap::load(path.string(), options, classes, scans.max_points);
}

constexpr const char* kMake = R"(An empty map that never uses more than memory_bytes.

classes: None: SemanticKITTI's. max_points: of a scan; larger ones are sampled evenly. window_m: only
the map within this distance of the robot is kept in memory. archive: a folder for blocks that leave
it, until they come back or the map goes; with it alone window_m is max_range_m, and without it these
blocks are lost. Queries see the window; digest() and save() the whole map. submap_m: the map is cut
into submaps of this way, which correct() moves; two of them are in memory, the others in files of the
folder archive, or of a temporary one, until the map goes. Queries see the current submap; digest() and
save() all of them. Raises InputError iff a value is out of its range, the budget is too small for a map
or the archive holds blocks already, Error iff the system does not give the memory.)";

constexpr const char* kLoad =
    R"(The local map of a .tsm file, to continue. What is fixed for the life of a map is the file's: its
resolution, prior, counts, cap and weight of a pass, and robot.

classes: the data set's, for labels as raw ids; None: labels must be components. Issues a UserWarning
if the map was made with another inference. Raises InputError iff the file is missing, damaged or a
global map, classes differ, the budget is too small for all of it, or a value is out of its range;
Error iff the system does not give the memory.)";

}  // namespace

void add_local_map(py::module_& module) {
  const MapOptions by_default;
  const ScanOptions scans;
  const std::string points = ", " + arguments_text(kScanRows, &scans) + ") -> ";
  const std::string make_text = "__init__(self, classes: ClassTable | None = None, *, " +
                                arguments_text(kMapRows, &by_default) +
                                ", T_global_map: numpy.ndarray | None = None" + points +
                                "None\n\n" + kMake;
  const std::string load_text = "load(path: os.PathLike, classes: ClassTable | None = None, *, " +
                                arguments_text(kMapRows, &by_default, false) + points +
                                "LocalMap\n\n" + kLoad;
  py::class_<HeldLocalMap, HeldMap, std::shared_ptr<HeldLocalMap>> local_map(
      module, "LocalMap", R"(The map of one robot, made of its scans.

Arguments are the options of `tessera map`, with the same defaults; docs/reference/python.md
has them all.)");
  {
    py::options docstrings;
    docstrings.disable_function_signatures();
    local_map
        .def(py::init([](const std::optional<Classes>& classes,
                         const std::optional<PoseArray>& T_global_map, const py::kwargs& settings) {
               return make(classes, T_global_map, settings);
             }),
             py::arg("classes") = py::none(), py::kw_only(), py::arg("T_global_map") = py::none(),
             make_text.c_str())
        .def_static(
            "load",
            [](const std::filesystem::path& path, const std::optional<Classes>& classes,
               const py::kwargs& settings) { return load(path, classes, settings); },
            py::arg("path"), py::arg("classes") = py::none(), load_text.c_str());
  }
  local_map
      .def("integrate", &integrate, py::arg("points"), py::arg("labels") = py::none(),
           py::arg("T_map_sensor") = py::none(), py::arg("weights") = py::none(), py::kw_only(),
           py::arg("stamp_us") = py::none(), py::arg("T_body_sensor") = py::none(),
           py::arg("no_return") = py::none(), py::arg("teammates") = py::none(),
           py::arg("label_weights") = py::none(), kIntegrate)
      .def("correct", &correct, py::arg("stamps_us"), py::arg("T_world_sensor"),
           py::arg("revision"), kCorrect)
      .def(
          "submaps", [](HeldLocalMap& map) { return submaps_of(map); },
          "Of each submap a dict: number, revision and T_world_map (3, 4). Without submap_m one.")
      .def("clear", &HeldLocalMap::clear, "Clears the map, and what is archived of it.")
      .def(
          "window",
          [](const HeldLocalMap& map) -> py::object {
            const std::optional<WindowTotals> totals = map.window();
            return totals ? dict_of(to_json(*totals)) : py::object(py::none());
          },
          "What the window did: the keys of `window` in the report of `tessera map`; None: all is "
          "in "
          "memory.")
      .def(
          "usage", &usage,
          "Memory use of the map: the keys of `memory` in the report of `tessera map`. refused: of "
          "scans since it was made, loaded or cleared.");
}

}  // namespace tessera::python
