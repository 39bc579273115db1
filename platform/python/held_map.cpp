// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "held_map.hpp"

#include <algorithm>
#include <bit>

#include "arrays.hpp"
#include "base/monotonic_clock.hpp"
#include "fusing.hpp"
#include "maps/fixed_settings.hpp"
#include "maps/whole_map_file.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/map/queries.hpp"

namespace tessera::python {

namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20U;

/// The memory of the archive's index is a part of the budget.
void set_up_archive(const MapOptions& options, int num_components, MapSetup& setup) {
  if (options.archive.empty()) return;
  const std::optional<ArchiveContent> earlier = value_of(find_archive(options.archive));
  if (earlier) {
    throw InputError(archive_path(options.archive) +
                     " holds the blocks of an earlier map; remove it, or choose another archive");
  }
  setup.archive_bytes = ArchiveFile::required_bytes(setup.map, num_components,
                                                    tessera::archive_blocks(setup, nullptr));
}

}  // namespace

std::uint64_t HeldMap::content_digest() const {
  return read([](const LocalMap& map) {
    std::vector<KeyedIndex> workspace = workspace_for(map);
    return digest(map, workspace);
  });
}

void HeldMap::save(const std::string& path) const {
  static_cast<void>(value_of(read([&](const LocalMap& map) {
    std::vector<KeyedIndex> workspace = workspace_for(map);
    return save_map(map, identity_, workspace, path);
  })));
}

HeldLocalMap::Parts HeldLocalMap::make_parts(const MapOptions& options, MapSetup setup,
                                             const Classes& classes, const MapIdentity& identity,
                                             std::size_t max_points) {
  const bool in_submaps = options.in_submaps();
  if (in_submaps && options.window_m)
    throw InputError("submap_m and window_m do not go together; leave out one");
  setup.submap_length_m = options.submap_length_m.value_or(0.0);
  // Of submaps the archive is the folder of their files.
  if (in_submaps) {
    setup.window.reset();
  } else {
    set_up_archive(options, classes.table.num_components(), setup);
  }
  const ScanCapacity capacity = value_of(split_budget(setup, max_points));
  MapFileHeader header{.config = setup.map, .classes = classes.table, .identity = identity};
  check(record_settings(settings_of(to_json(options, setup)), header.identity));
  HeldMapper mapper = value_of(make_mapper(setup, capacity, classes.table));
  std::optional<HeldArchive> archive;
  std::unique_ptr<HeldSubmaps> submaps;
  if (in_submaps) {
    submaps = std::make_unique<HeldSubmaps>(*mapper, header.identity, options.archive);
  } else if (!options.archive.empty()) {
    archive.emplace(
        value_of(HeldArchive::make(options.archive, setup, header.identity, nullptr, *mapper)));
  }
  auto stored = std::make_shared<StoredMap>(mapper->map());
  stored->header = header;
  return {.mapper = std::move(mapper),
          .stored = std::move(stored),
          .archive = std::move(archive),
          .submaps = std::move(submaps),
          .setup = setup,
          .classes = classes,
          .max_points = max_points};
}

HeldLocalMap::~HeldLocalMap() {
  if (parts_.archive) (*parts_.archive)->remove();
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
  adopt_fixed_settings(header, options);
  MapSetup setup = value_of(set_up(options));
  const bool votes = setup.map.label_votes;  // of the inference, not of the file
  setup.map = header.config;
  setup.map.label_votes = votes;
  auto parts = make_parts(options, setup, classes.value_or(Classes{header.classes, nullptr}),
                          header.identity, max_points);
  const bool whole = [&] {
    const py::gil_scoped_release released;
    return value_of(load_into(path, parts.stored->map));
  }();
  if (!whole) {
    const std::size_t enough =
        budget_for_storage(setup, max_points, storage_to_continue(header, options));
    raise({Message(kMapSettings["--memory"]) + " " + bytes_text(options.memory_bytes) +
           " is too small for the map " + path + "; give at least " + bytes_text(enough)});
  }
  if (const auto warning = change_of_mode(path, header, options, setup)) warn_of({*warning});
  return std::shared_ptr<HeldLocalMap>(new HeldLocalMap(std::move(parts)));
}

namespace {

/// Points with a label that is no component, unless it has no weight.
std::size_t count_above(const ScanView& scan, int highest) noexcept {
  std::size_t above = 0;
  for (std::size_t i = 0; i < scan.count; ++i) {
    bool any = false;
    for (std::size_t k = i * scan.labels_per_point; k < (i + 1) * scan.labels_per_point; ++k)
      any = any || (scan.components[k] > highest &&
                    (scan.label_weights == nullptr || scan.label_weights[k] != 0));
    above += any ? 1U : 0U;
  }
  return above;
}

}  // namespace

IntegrationReport HeldLocalMap::integrate(ScanView scan, const LabelsView& labels,
                                          std::optional<std::int64_t> stamp_us) {
  IntegrationReport report;
  Outcome<void> kept;
  std::uint32_t submap = 0;
  const py::gil_scoped_release released;
  {
    const std::unique_lock alone(gate().mutex);
    scan.components = components_of(labels, parts_.classes.raw_ids.get(), scan.label_weights,
                                    components_, report.unknown);
    if (labels.are_components() && scan.components != nullptr)
      report.too_high = count_above(scan, parts_.classes.table.unlabelled());
    const std::int64_t now_us = MonotonicClock::now_us();
    if (!stamp_us) stamp_us = now_us;
    {
      const std::scoped_lock lock(last_mutex_);
      watched_ = to_watch_;
    }
    scan.watched = watched_;
    report.scan = parts_.mapper->integrate(scan, now_us);
    submap = parts_.mapper->maps().number();
    if (parts_.submaps && report.scan.pose == Status::kOk)
      kept = parts_.submaps->note(*stamp_us, scan.T_map_sensor);
  }
  if (report.scan.pose != Status::kOk) return report;
  {
    const std::scoped_lock lock(last_mutex_);
    ++last_.number;
    last_.submap = submap;
    last_.stamp_us = *stamp_us;
    last_.T_map_sensor = scan.T_map_sensor;
    last_.watched.clear();
    if (submap == watched_in_) last_.watched.assign(scan.watched.begin(), scan.watched.end());
    last_.T_map_body = product(scan.T_map_sensor, inverse(scan.T_body_sensor));
    totals_.add(report.scan);
  }
  report.kept = std::move(kept);
  return report;
}

void HeldLocalMap::clear() {
  if (!write([](Mapper& mapper) { return mapper.clear(); }))
    throw WorkError("the sharer is behind; call its tick, then clear again");
  const std::scoped_lock lock(last_mutex_);
  totals_ = {};
}

void HeldLocalMap::share_by(EvictionQueue* queue) {
  const bool is_free = write([&](Mapper& mapper) {
    if (queue != nullptr && is_shared_) return false;
    if (queue != nullptr && parts_.archive) {
      const ArchiveIndex& index = (*parts_.archive)->blocks().index();
      std::vector<KeyedIndex> workspace(2 * index.size());
      for (const KeyedIndex& item : index.blocks_in_order(workspace))
        static_cast<void>(queue->list(BlockKey{item.key}));  // as many as the archive may hold
    }
    is_shared_ = queue != nullptr;
    mapper.set_eviction_queue(queue);
    return true;
  });
  if (!is_free) throw InputError("map has a window and another sharer; one shares it at a time");
}

std::size_t HeldLocalMap::archive_blocks() const {
  return parts_.archive ? (*parts_.archive)->blocks().index().capacity() : 0;
}

std::uint64_t HeldLocalMap::content_digest() const {
  if (parts_.submaps) {
    const py::gil_scoped_release released;
    const std::unique_lock alone(gate().mutex);
    return parts_.submaps->content_digest();
  }
  if (!parts_.archive) return HeldMap::content_digest();
  return value_of([&] {
    const py::gil_scoped_release released;
    const std::unique_lock alone(gate().mutex);
    return digest_of_whole(stored()->map, **parts_.archive);
  }());
}

void HeldLocalMap::save(const std::string& path) const {
  if (parts_.submaps) {
    static_cast<void>(value_of([&] {
      const py::gil_scoped_release released;
      const std::unique_lock alone(gate().mutex);
      return parts_.submaps->save(path);
    }()));
    return;
  }
  if (!parts_.archive) return HeldMap::save(path);
  static_cast<void>(value_of([&] {
    const py::gil_scoped_release released;
    const std::unique_lock alone(gate().mutex);
    return save_whole(stored()->map, **parts_.archive, identity(), path);
  }()));
}

std::optional<WindowTotals> HeldLocalMap::window() const {
  if (!parts_.setup.window) return std::nullopt;
  const py::gil_scoped_release released;
  const std::shared_lock together(gate().mutex);
  return totals_of(parts_.mapper->window(), parts_.setup.window->radius_m,
                   parts_.archive ? &*parts_.archive : nullptr);
}

ScanTotals HeldLocalMap::totals() const {
  const std::scoped_lock lock(last_mutex_);
  return totals_;
}

void HeldLocalMap::watch(std::span<const WatchedPoint> points, std::uint32_t submap) {
  const std::scoped_lock lock(last_mutex_);
  to_watch_.assign(points.begin(), points.end());
  watched_in_ = submap;
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
