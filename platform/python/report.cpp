// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"

#include <functional>
#include <string>

#include "held_map.hpp"

namespace tessera::python {

namespace {

struct Counter {
  const char* name;
  const char* text;
  std::int64_t (*value)(const ScanReport& report);
};
/// member: a counter, or a function that adds several up.
template <auto member>
constexpr Counter counter(const char* name, const char* text) {
  return {name, text, [](const ScanReport& report) {
            return static_cast<std::int64_t>(std::invoke(member, report));
          }};
}

constexpr Counter kCounters[] = {
    counter<&ScanReport::points>("points", "Returns given."),
    counter<&ScanReport::non_finite>(
        "non_finite", "Refused: NaN or infinite coordinates, or a weight that is not in 0 .. 1e6."),
    counter<&ScanReport::too_near>("too_near", "Refused: nearer than min_range_m."),
    counter<&ScanReport::beyond_range>("beyond_range",
                                       "Farther than max_range_m: they only free space."),
    counter<&ScanReport::out_of_grid>(
        "out_of_grid", "Refused: outside the grid, or too far from the sensor for it."),
    counter<&ScanReport::in_range>("in_range", "Returns that were registered as hits."),
    counter<&ScanReport::unlabelled>("unlabelled", "Returns in range of unknown class."),
    counter<&ScanReport::over_capacity>(
        "over_capacity", "Left out: more than max_points; the scan was sampled evenly."),
    counter<&ScanReport::thinned>("thinned", "Points after thinning."),
    counter<&ScanReport::admitted>("admitted", "Thinned points that were integrated."),
    counter<&ScanReport::refused_storage>("refused_storage",
                                          "Thinned points left out: no room in the map."),
    counter<&ScanReport::refused_tiles>("refused_tiles",
                                        "The same: no room in the scratch for labels."),
    counter<&ScanReport::refused_ray_blocks>("refused_ray_blocks",
                                             "The same: no room in the scratch for rays."),
    counter<&ScanReport::refused_work>("refused_work", "The same: work_budget."),
    counter<&ScanReport::refused_deadline>("refused_deadline",
                                           "The same: deadline_ms, as it was foreseen."),
    counter<&ScanReport::rays>("rays", "Rays traced."),
    counter<&ScanReport::rays_refused_memory>("rays_refused_memory",
                                              "Rays beyond the range left out: memory."),
    counter<&ScanReport::rays_refused_work>("rays_refused_work", "The same: work_budget."),
    counter<&ScanReport::rays_refused_deadline>("rays_refused_deadline", "The same: deadline_ms."),
    counter<&ScanReport::returns_cut>(
        "returns_cut", "Returns of a scan that was not registered in time: all of them."),
    counter<&ScanReport::rays_cut>("rays_cut", "Rays not traced in time."),
    counter<&ScanReport::tiles_cut>("tiles_cut", "Tiles not written in time."),
    counter<&ScanReport::points_cut>("points_cut", "Admitted points in these."),
    counter<&ScanReport::ray_blocks_cut>("ray_blocks_cut", "Blocks traced and not carved in time."),
    counter<&ScanReport::overshoot_us>(
        "overshoot_us", "Microseconds by which the scan ended late; 0: in time, or no deadline."),
    counter<&ScanReport::work_limit>("work_limit", "The limit of work that applied; 0: none."),
    counter<&ScanReport::work_predicted>(
        "work_predicted", "Bound of the work of what was admitted; 0 without a limit."),
    counter<&ScanReport::tiles>("tiles", "Tiles of scratch used."),
    counter<&ScanReport::ray_blocks>("ray_blocks", "Ray blocks of scratch used."),
    counter<&ScanReport::voxel_updates>("voxel_updates",
                                        "Contributions added: pairs of a point and a voxel."),
    counter<&ScanReport::evaluations>("evaluations", "Voxels for which kernels were evaluated."),
    counter<&ScanReport::ray_steps>("ray_steps", "Voxels stepped through by rays."),
    counter<&ScanReport::strips>("strips", "Kernel mode: runs of tiles that were summed together."),
    counter<&ScanReport::label_octets>("label_octets", "Octets of labels written."),
    counter<&ScanReport::free_blocks>("free_blocks", "Blocks carved."),
    counter<&ScanReport::write_faults>(
        "write_faults", "Writes of what was admitted that failed: 0, or the library is at fault."),
    counter<&ScanReport::refused_memory>(
        "refused_memory", "Thinned points left out because map or scratch was full."),
    counter<&ScanReport::work_spent>("work_spent", "Kernel evaluations and ray steps done."),
    counter<&ScanReport::left_out_deadline>(
        "left_out_deadline", "Returns, thinned points and rays left out by the deadline."),
    counter<&ScanReport::points_kept>("points_kept",
                                      "Thinned points whose evidence is in the map."),
    counter<&ScanReport::rays_wanted>("rays_wanted",
                                      "Rays of all thinned points; 0 without free space."),
    counter<&ScanReport::left_out>(
        "left_out",
        "Returns, thinned points and rays that could have been integrated but were not."),
};

py::dict counters_of(const IntegrationReport& report) {
  py::dict counters;
  for (const Counter& c : kCounters) counters[c.name] = c.value(report.scan);
  counters["unknown_ids"] = report.unknown.points;
  return counters;
}

}  // namespace

void add_scan_report(py::module_& module) {
  py::class_<IntegrationReport> type(
      module, "ScanReport",
      "What integrating a scan did, and what it left out: a counter for each reason.");
  for (const Counter& c : kCounters) {
    type.def_property_readonly(
        c.name, [value = c.value](const IntegrationReport& r) { return value(r.scan); }, c.text);
  }
  type.def_property_readonly(
          "unknown_ids", [](const IntegrationReport& r) { return r.unknown.points; },
          "Points whose raw id is in no class; taken as unlabelled.")
      .def_property_readonly(
          "unknown_id_examples",
          [](const IntegrationReport& r) {
            py::list ids;
            for (std::size_t i = 0; i < r.unknown.num_examples; ++i)
              ids.append(r.unknown.examples[i]);
            return ids;
          },
          "Up to 8 of these ids.")
      .def("as_dict", &counters_of, "All counters by name.")
      .def("__repr__", [](const IntegrationReport& r) {
        return "<tessera.ScanReport: " + std::to_string(r.scan.points) + " points, " +
               std::to_string(r.scan.admitted) + " admitted, " + std::to_string(r.scan.left_out()) +
               " left out>";
      });
}

}  // namespace tessera::python
