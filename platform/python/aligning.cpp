// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "aligning.hpp"

#include <fmt/core.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <tuple>
#include <utility>
#include <variant>

#include "arrays.hpp"
#include "fusing.hpp"
#include "held_map.hpp"
#include "maps/frame_run.hpp"

namespace tessera::python {

namespace {

/// What align() found, and its report.
class Alignment {
 public:
  explicit Alignment(const FrameAnswer& answer) : answer_(answer), report_(to_json(answer)) {}
  [[nodiscard]] bool accepted() const { return answer_.verdict == FrameVerdict::kFound; }
  [[nodiscard]] py::array_t<double> transform() const { return array_of(answer_.T_a_b); }
  [[nodiscard]] py::array_t<double> covariance() const {
    py::array_t<double> array({6, 6});
    std::copy(answer_.covariance.begin(), answer_.covariance.end(), array.mutable_data());
    return array;
  }
  [[nodiscard]] py::array_t<double> middle() const {
    py::array_t<double> array = new_array<double>(3);
    for (int axis = 0; axis < 3; ++axis) array.mutable_at(axis) = answer_.middle_a[axis];
    return array;
  }
  [[nodiscard]] py::object reason() const {
    return accepted() ? py::object(py::none()) : py::str(to_string(answer_.verdict));
  }
  [[nodiscard]] py::object part(const char* key) const { return dict_of(report_[key]); }
  [[nodiscard]] py::object report() const { return dict_of(report_); }
  [[nodiscard]] std::string text() const {
    return fmt::format("<tessera.Alignment, {}: {}>", to_string(answer_.verdict),
                       motion_text(answer_.T_a_b));
  }

 private:
  FrameAnswer answer_;
  Json report_;
};

using MapOrFile = std::variant<std::shared_ptr<HeldMap>, std::filesystem::path>;

std::shared_ptr<HeldMap> whole_map(const MapOrFile& given, const char* name) {
  if (const auto* const path = std::get_if<std::filesystem::path>(&given)) return load_held(*path);
  const auto& held = std::get<std::shared_ptr<HeldMap>>(given);
  if (!held->is_whole())
    throw InputError(std::string(name) +
                     " has a window or is in submaps; save it, and give the file");
  return held;
}

/// Keeps both maps as they are, until it is released or goes.
class BothGates {
 public:
  BothGates(Gate& a, Gate& b) {
    // Sharers lock the gate of their global map, which settles, before that of their local map.
    const auto order = [](const Gate* gate) { return std::tuple(!gate->settle, gate); };
    lock(order(&a) < order(&b) ? a : b);
    if (&a != &b) lock(order(&a) < order(&b) ? b : a);
  }
  void release() {
    together_.clear();
    alone_.clear();
  }

 private:
  void lock(Gate& gate) {
    if (!gate.settle) {
      together_.emplace_back(gate.mutex);
      return;
    }
    alone_.emplace_back(gate.mutex);
    gate.settle();
  }

  std::vector<std::shared_lock<std::shared_mutex>> together_;
  std::vector<std::unique_lock<std::shared_mutex>> alone_;
};

/// Maps may be written to again as soon as the search has taken them in.
Outcome<FrameAnswer> find_frame(const HeldMap& a, const HeldMap& b, const FrameQuestion& question) {
  TESSERA_TRY_ASSIGN(const std::unique_ptr<FrameRun> run, FrameRun::prepare());
  BothGates gates(a.gate(), b.gate());
  return run->find(a.current(), b.current(), question, [&](std::uint32_t) {
    if (run->finder().taken_in()) gates.release();
  });
}

Alignment align(const MapOrFile& a, const MapOrFile& b, const std::optional<PoseArray>& guess) {
  std::optional<Matrix34d> T_a_b;
  if (guess) T_a_b = pose_of(guess, "guess");
  const std::shared_ptr<HeldMap> map_a = whole_map(a, "a");
  const std::shared_ptr<HeldMap> map_b = whole_map(b, "b");
  const FrameQuestion question = question_of(T_a_b, map_a->identity(), map_b->identity());
  Outcome<FrameAnswer> answer = [&] {
    const py::gil_scoped_release released;
    return find_frame(*map_a, *map_b, question);
  }();
  return Alignment(value_of(std::move(answer)));
}

constexpr const char* kAlign =
    R"(Finds the transform between two maps of one place, as `tessera align`.

a, b: maps of any kind, or files of them. guess: about T_a_b, (4, 4) or (3, 4), metres; the search is
within 10 m in x and y, 3 m in z and 20 degrees of it. None: any heading, and within 72 m in x and y
and 12 m in z of where the T_global_map of both maps puts b, or of the identity if one has none.

Returns an Alignment. If no transform is sure enough, this is no exception: `accepted` is False, and
`reason` says why. The same maps and guess give the same bits. Raises InputError iff a map has a
window or is in submaps, a file cannot be read, or guess has another shape or is no rigid transform;
TypeError iff an argument is of another type; Error iff the system does not give the memory, 16 MiB.
Takes about a second on one core, near a guess less. Other threads may write to the maps again as
soon as they have been read, early in the search.)";

}  // namespace

void add_aligning(py::module_& module) {
  py::class_<Alignment>(module, "Alignment", "The transform between two maps that align() found.")
      .def_property_readonly("transform", &Alignment::transform,
                             "(4, 4) float64, T_a_b: p_a = T_a_b p_b, metres; the best one, also "
                             "if it is not accepted.")
      .def_property_readonly(
          "covariance", &Alignment::covariance,
          R"((6, 6) float64, of a small motion of b about middle: x y z in m, then a rotation vector in rad.

Along the axes of a. All zero iff it could not be computed; then it is not accepted.)")
      .def_property_readonly("middle", &Alignment::middle,
                             "(3,) float64: the middle of the overlap, metres, frame a.")
      .def_property_readonly("accepted", &Alignment::accepted,
                             "True iff the transform is sure enough to be used.")
      .def_property_readonly("reason", &Alignment::reason,
                             "Why the transform is not accepted, one line; None if it is.")
      .def_property_readonly(
          "agreement", [](const Alignment& a) { return a.part("agreement"); },
          R"(How well the maps agree at the transform, as a dictionary.

share: of samples of surfaces that both maps have seen, those that agree, 0 to 1. The others count
samples (agreed, contradicted, unseen) and surfaces with a label in both (labelled, same_label).)")
      .def_property_readonly(
          "agreement_before", [](const Alignment& a) { return a.part("agreement_before"); },
          "The same at the guess, or without one at the middle of the search.")
      .def_property_readonly("report", &Alignment::report,
                             "The report of `tessera align` without config, as a dictionary.")
      .def("__repr__", &Alignment::text);
  module.def("align", &align, py::arg("a").none(false), py::arg("b").none(false),
             py::arg("guess") = py::none(), kAlign);
}

}  // namespace tessera::python
