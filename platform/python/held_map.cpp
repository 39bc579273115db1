// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "held_map.hpp"

#include <bit>

#include "arrays.hpp"
#include "base/monotonic_clock.hpp"

namespace tessera::python {

namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20U;

}  // namespace

HeldLocalMap::HeldLocalMap(Parts parts)
    : HeldMap(std::move(parts.stored)),
      integrator_(std::move(parts.integrator)),
      setup_(parts.setup),
      classes_(std::move(parts.classes)),
      scratch_bytes_(parts.scratch_bytes),
      max_points_(parts.max_points),
      deadline_(Clock{nullptr, [](void*) { return MonotonicClock::now_us(); }}) {}

HeldLocalMap::Parts HeldLocalMap::make_parts(const MapOptions& options, MapSetup setup,
                                             const Classes& classes, const MapIdentity& identity,
                                             std::size_t max_points) {
  if (max_points == 0 || max_points > ScanCapacity::kMaxPoints) {
    throw InputError("max_points " + std::to_string(max_points) + " is not allowed; give 1 to " +
                     std::to_string(ScanCapacity::kMaxPoints));
  }
  const ScanCapacity capacity = value_of(split_budget(setup, max_points));
  Parts parts{.stored = std::make_shared<StoredMap>(),
              .integrator = {},
              .setup = setup,
              .classes = classes,
              .scratch_bytes = Integrator::required_bytes(capacity, setup.inference),
              .max_points = max_points};
  StoredMap& stored = *parts.stored;
  stored.header = {.config = setup.map, .classes = classes.table, .identity = identity};
  Json settings = to_json(options, setup);
  settings["robot"] = identity.robot;
  check(record_settings(settings_of(std::move(settings)), stored.header.identity));
  stored.memory = value_of(ArenaMemory::allocate(required_bytes(setup.map) + parts.scratch_bytes));
  Arena arena(stored.memory.span());
  Result<LocalMap> map = LocalMap::make(arena, setup.map, classes.table);
  Result<Integrator> integrator = Integrator::make(arena, setup.inference, capacity);
  if (!map.ok() || !integrator.ok()) {
    const Status status = map.ok() ? integrator.status() : map.status();
    throw InputError(std::string("the map cannot be made: ") + to_string(status));
  }
  stored.map = std::move(*map);
  parts.integrator = std::move(*integrator);
  return parts;
}

std::shared_ptr<HeldLocalMap> HeldLocalMap::make(const MapOptions& options, const Classes& classes,
                                                 const std::optional<Matrix34d>& T_global_map,
                                                 std::size_t max_points) {
  MapIdentity identity{.robot = options.robot.value_or(0)};
  identity.has_T_global_map = T_global_map.has_value();
  if (T_global_map) identity.T_global_map = *T_global_map;
  return std::shared_ptr<HeldLocalMap>(new HeldLocalMap(
      make_parts(options, value_of(set_up(options)), classes, identity, max_points)));
}

std::shared_ptr<HeldLocalMap> HeldLocalMap::load(const std::string& path, MapOptions options,
                                                 const std::optional<Classes>& classes,
                                                 std::size_t max_points) {
  const MapFileHeader header = value_of(load_map_header(path));
  if (header.identity.kind != MapKind::kLocal)
    throw InputError(path + " is a global map; give a robot's local map, or use tessera.load");
  if (classes && !(classes->table == header.classes))
    throw InputError(path + " has other classes than those given; leave classes out");
  options.resolution_m = header.config.resolution_m;
  MapSetup setup = value_of(set_up(options));
  setup.map = header.config;
  setup.max_evidence = static_cast<double>(header.config.max_evidence);
  setup.free_weight = static_cast<double>(header.config.free_weight);
  auto parts = make_parts(options, setup, classes.value_or(Classes{header.classes, nullptr}),
                          header.identity, max_points);
  const bool whole = [&] {
    const py::gil_scoped_release released;
    return value_of(load_into(path, parts.stored->map));
  }();
  if (!whole) {
    const std::size_t enough =
        budget_for_storage(setup, max_points, header.config.storage_bytes) / kMiB;
    throw InputError("memory_bytes " + options.memory + " is too small for the map " + path +
                     "; give at least " + std::to_string(enough) + " << 20");
  }
  return std::shared_ptr<HeldLocalMap>(new HeldLocalMap(std::move(parts)));
}

IntegrationReport HeldLocalMap::integrate(ScanView scan, const LabelsView& labels) {
  IntegrationReport report;
  const py::gil_scoped_release released;
  {
    const std::unique_lock alone(gate().mutex);
    scan.components = components_of(labels, classes_.raw_ids.get(), components_, report.unknown);
    LocalMap& map = stored()->map;
    report.scan = setup_.deadline_us == 0
                      ? integrator_.integrate(map, scan)
                      : integrator_.integrate(map, scan, deadline_,
                                              MonotonicClock::now_us() + setup_.deadline_us);
  }
  if (report.scan.pose != Status::kOk) return report;
  const std::scoped_lock lock(last_mutex_);
  ++last_.number;
  last_.p_map = scan.T_map_sensor.col(3);
  return report;
}

void HeldLocalMap::clear() {
  write([](LocalMap& map) { map.clear(); });
}

LastScan HeldLocalMap::last_scan() const {
  const std::scoped_lock lock(last_mutex_);
  return last_;
}

void measure_content(StoredMap& stored) {
  const LocalMap& map = stored.map;
  MapFileContent content;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    const Block& block = map.block_at(item.index);
    ++content.blocks;
    content.label_pages += block.has_labels() ? 1U : 0U;
    content.free_pages += block.has_free_passes() ? 1U : 0U;
    content.octets += static_cast<std::uint64_t>(std::popcount(map.octets_of(block)));
  }
  stored.header.content = content;
  stored.header.config.storage_bytes = map.config().storage_bytes;
}

}  // namespace tessera::python
