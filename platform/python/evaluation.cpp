// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera.Evaluation: compares a map with points of known class.
#include "evaluation.hpp"

#include <pybind11/stl.h>

#include <utility>

#include "arrays.hpp"
#include "fusing.hpp"
#include "held_map.hpp"
#include "label_arrays.hpp"
#include "maps/score_scan.hpp"
#include "scans/scan_losses.hpp"

namespace tessera::python {

namespace {

class Evaluation {
 private:
  template <class Copy>
  auto copied(Copy&& copy) const {
    const py::gil_scoped_release released;
    const std::scoped_lock lock(mutex_);
    return copy();
  }

 public:
  Evaluation(std::shared_ptr<HeldMap> map, const std::optional<Classes>& classes,
             const std::optional<double>& max_range_m)
      : map_(std::move(map)), classes_(classes.value_or(map_->class_table())) {
    if (!(classes_.table == map_->classes()))
      throw InputError("classes differ from the map's; evaluate with the data it was made from");
    const MapFileHeader header{.identity = map_->identity()};
    const Json range_m = recorded_setting(header, "max_range");
    max_range_m_ = max_range_m.value_or(range_m.is_number() ? range_m.get<double>() : 0.0);
    if (!(max_range_m_ >= 0.0))
      throw InputError("max_range_m must be a distance in metres; give 0 for no limit");
  }

  void add(const py::array& points, const py::array& truth,
           const std::optional<PoseArray>& T_map_sensor, const std::optional<py::array>& labels) {
    const PointsView view = points_of(points, "points");
    const LabelsView true_labels = checked(truth, view.count, "truth");
    const LabelsView given = checked(labels, view.count, "labels");
    ScanView scan;
    scan.points = view.points;
    scan.stride_floats = view.stride_floats;
    scan.count = view.count;
    scan.T_map_sensor = pose_of(T_map_sensor, "T_map_sensor");
    UnknownRawIds unknown_truth;
    UnknownRawIds unknown;
    map_->read([&](const LocalMap& map) {
      const std::scoped_lock lock(mutex_);
      has_input_ = has_input_ || given.data != nullptr;
      scan.components = components_of(given, classes_.raw_ids.get(), nullptr, given_, unknown);
      const std::uint8_t* const of_truth =
          components_of(true_labels, classes_.raw_ids.get(), nullptr, true_, unknown_truth);
      unknown_ids_ += unknown.points + unknown_truth.points;
      const auto everywhere = [](const Point3f&) { return true; };
      non_finite_ += score_scan(map, scan, of_truth, max_range_m_, everywhere, scores_);
    });
    is_doubted_ = false;
    warn_of_unknown("truth", unknown_truth, truth_was_unknown_);
    warn_of_unknown("labels", unknown, label_was_unknown_);
  }

  [[nodiscard]] py::object report() {
    warn_of_doubts(2);
    const Json json = copied([this] {
      Json scores = scores_.json(map_->classes(), has_input_);
      scores["max_range"] = max_range_m_;
      scores["non_finite"] = non_finite_;
      scores["unknown_ids"] = unknown_ids_;
      return scores;
    });
    return dict_of(json);
  }
  /// Returns get(scores), while nothing is added.
  template <class Get>
  [[nodiscard]] double value(Get&& get) {
    warn_of_doubts(1);
    return copied([&] { return get(scores_, map_->classes().num_classes()); });
  }

 private:
  /// Once for truth and once for labels.
  static void warn_of_unknown(const char* name, const UnknownRawIds& ids, bool& was_unknown) {
    if (ids.points == 0 || std::exchange(was_unknown, true)) return;
    warn_of({text_of(ids, name) + "; taken as unlabelled"});
  }
  /// Once after scans were added.
  void warn_of_doubts(int frames) {
    if (std::exchange(is_doubted_, true)) return;
    std::vector<Message> doubts;
    map_->read([&](const LocalMap& map) {
      const std::scoped_lock lock(mutex_);
      doubts = doubts_of(scores_, map, non_finite_);
    });
    warn_of(doubts, frames);
  }

  [[nodiscard]] LabelsView checked(const std::optional<py::array>& array, std::size_t count,
                                   const char* name) const {
    const LabelsView labels = labels_of(array, count, name);
    if (!labels.are_components() && classes_.raw_ids == nullptr) {
      throw InputError(std::string(name) +
                       " are raw ids, which a map file does not know; give components (uint8), or "
                       "the data set's classes");
    }
    return labels;
  }

  std::shared_ptr<HeldMap> map_;
  Classes classes_;
  double max_range_m_ = 0.0;
  mutable std::mutex mutex_;
  Scores scores_;
  std::vector<std::uint8_t> given_;
  std::vector<std::uint8_t> true_;
  std::uint64_t non_finite_ = 0;
  std::uint64_t unknown_ids_ = 0;
  bool has_input_ = false;
  // These are read and written with the GIL held.
  bool is_doubted_ = false;  ///< What makes the figures worth little was warned of.
  bool truth_was_unknown_ = false;
  bool label_was_unknown_ = false;
};

}  // namespace

void add_evaluation(py::module_& module) {
  py::class_<Evaluation>(
      module, "Evaluation",
      "Compares points of known class with a map, scan by scan, as `tessera eval` does.")
      .def(
          py::init<std::shared_ptr<HeldMap>, const std::optional<Classes>&,
                   const std::optional<double>&>(),
          py::arg("map").none(false), py::arg("classes") = py::none(),
          py::arg("max_range_m") = py::none(),
          R"(classes: the data set's, for raw ids; None: the map's. max_range_m: farther points are ignored; None: as the map was made; 0: no limit.

Raises InputError iff the classes are not the map's, or max_range_m is negative.)")
      .def(
          "add", &Evaluation::add, py::arg("points"), py::arg("truth"),
          py::arg("T_map_sensor") = py::none(), py::arg("labels") = py::none(),
          R"(Adds one scan: points (N, 3) or wider float32, metres, sensor frame; T_map_sensor (4, 4) or None.

truth and labels (those that the map was made from; None: not compared): (N,) uint8 components, or
uint16 or uint32 raw ids. Points whose truth is unlabelled are ignored. Raises as LocalMap.integrate.
Raw ids that are in no class get a UserWarning, once; they are taken as unlabelled.)")
      .def("report", &Evaluation::report,
           R"(The keys of the report of `tessera eval`, as a dictionary.

What `tessera eval` warns of gets a UserWarning, here or where a figure is read first: no point in
range, a map without labels, points of which most are not in the map.)")
      .def_property_readonly(
          "mean_iou",
          [](Evaluation& e) {
            return e.value([](const Scores& s, int classes) { return s.map().mean_iou(classes); });
          },
          "Mean intersection over union of the classes that are in the truth.")
      .def_property_readonly(
          "coverage",
          [](Evaluation& e) { return e.value([](const Scores& s, int) { return s.coverage(); }); },
          "Share of points in occupied voxels with a label.")
      .def_property_readonly(
          "accuracy",
          [](Evaluation& e) { return e.value([](const Scores& s, int) { return s.accuracy(); }); },
          "Share of points whose voxel has their class.")
      .def_property_readonly(
          "calibration_error",
          [](Evaluation& e) {
            return e.value(
                [](const Scores& s, int) { return s.reliability().calibration_error(); });
          },
          "Expected calibration error of the label's probability, over 15 equal bins.")
      .def_property_readonly(
          "brier_score",
          [](Evaluation& e) {
            return e.value([](const Scores& s, int) { return s.reliability().brier_score(); });
          },
          "Mean over the points of the squares of what the probabilities are off, 0 to 2.")
      .def_property_readonly(
          "risk_coverage_area",
          [](Evaluation& e) {
            return e.value(
                [](const Scores& s, int) { return s.reliability().risk_coverage_area(); });
          },
          "Share of wrong labels among the n points with the most probable ones, its mean over n.");
}

}  // namespace tessera::python
