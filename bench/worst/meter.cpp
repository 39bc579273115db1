// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "meter.hpp"

#if __has_include(<valgrind/callgrind.h>)
#include <valgrind/callgrind.h>
#endif

namespace tessera::bench {

void Meter::start_counting() {
#if defined(CALLGRIND_START_INSTRUMENTATION)
  CALLGRIND_START_INSTRUMENTATION;
  CALLGRIND_ZERO_STATS;
#endif
}

void Meter::stop_counting([[maybe_unused]] const char* name) {
#if defined(CALLGRIND_START_INSTRUMENTATION)
  CALLGRIND_DUMP_STATS_AT(name);
  CALLGRIND_STOP_INSTRUMENTATION;
#endif
}

void Meter::add(const WorstCase& worst, int calls, const Operations& operations, double ns) {
  cases_[worst.name] = {{"call", worst.call},
                        {"input", worst.input},
                        {"formula", worst.formula},
                        {"calls", calls},
                        {"operations", operations.counted},
                        {"bound", operations.bound},
                        {"ns", ns}};
  if (!(operations.counted <= operations.bound)) beyond_.emplace_back(worst.name);
}

ClassTable table_of(int count) {
  ClassTable table;
  for (int i = 0; i < count; ++i) {
    const std::string name = "class_" + std::to_string(i + 1);
    if (table.add(name.c_str(), {}) != Status::kOk) break;
  }
  return table;
}

MapConfig config_of(TuplePolicy tuple, std::size_t mebibytes) {
  MapConfig config;
  config.tuple = tuple;
  config.storage_bytes = mebibytes << 20U;
  return config;
}

OwnedMap::OwnedMap(const MapConfig& config, int num_classes)
    : lines(required_bytes(config) / kArenaAlignment + 1) {
  Arena arena(std::as_writable_bytes(std::span(lines)));
  Result<LocalMap> made = LocalMap::make(arena, config, table_of(num_classes));
  if (made.ok()) map = std::move(*made);
}

OctetEvidence everything(const LocalMap& map, float each) {
  OctetEvidence evidence;
  for (int component = 1; component < map.num_components(); ++component)
    evidence.plane(component).fill(each + 0.01F * static_cast<float>(component % 7));
  return evidence;
}

SlabHandle fill_block(LocalMap& map, BlockCoord block, int passes) {
  const Result<SlabHandle> handle = map.open_block(block);
  if (!handle.ok()) return 0;
  VoxelMask all;
  all.fill(~std::uint64_t{0});
  for (int i = 0; i < passes; ++i) static_cast<void>(map.add_free_pass(*handle, all));
  const OctetEvidence evidence = everything(map, 1.0F);
  for (int octet = 0; octet < kBlockOctets; ++octet)
    static_cast<void>(map.add_labels(*handle, octet, evidence));
  return *handle;
}

std::vector<BlockCoord> same_buckets(std::size_t count) {
  return blocks_with_hash(count, [](std::uint32_t hash, std::uint64_t) {
    return hash >> 24U == 0 && hash % 64 == 5 && hash / 64 % 64 == 9;
  });
}

}  // namespace tessera::bench
