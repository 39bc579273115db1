// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the units of the C interface share: the robot behind the handle, and how structs of callers
// that were compiled with another header are read and filled.
#pragma once

#include <cstring>
#include <limits>

#include "tessera/base/rigid.hpp"
#include "tessera/map/map_file.hpp"
#include "tessera/map/whole_map.hpp"
#include "tessera/robot/robot.hpp"
#include "tessera/tessera.h"

struct tessera_robot {
  static constexpr std::uint64_t kMagic = 0x74657373'6572'6101U;
  std::uint64_t magic = 0;
  tessera::Robot* robot = nullptr;
  tessera_callbacks callbacks{};
  /// Of the file that is read or written: too much for the stack.
  tessera::MapFileHeader header{};
  tessera::MapFileBuffer buffer{};
  std::span<std::uint64_t> workspace{};       ///< Of searches: a block as it is read.
  tessera::StoredArchive* archive = nullptr;  ///< Of a window, with what a whole map is read by.
  tessera::LocalMap* cache = nullptr;
  struct tessera_loaded_session* session = nullptr;  ///< That is being published.
};

namespace tessera::c_interface {

/// Words of a robot's workspace.
constexpr std::size_t workspace_words(int num_components) noexcept {
  return MapReader::most_snapshot_bytes(num_components) / sizeof(std::uint64_t) + 1;
}

inline tessera_status status_of(Status status) noexcept {
  return static_cast<tessera_status>(status);
}

inline bool is_robot(const tessera_robot* robot) noexcept {
  return robot != nullptr &&
         reinterpret_cast<std::uintptr_t>(robot) % alignof(tessera_robot) == 0 &&
         robot->magic == tessera_robot::kMagic;
}

inline bool is_map(std::uint32_t map) noexcept { return map <= TESSERA_GLOBAL_MAP; }
inline const LocalMap& map_of(const tessera_robot& robot, std::uint32_t map) noexcept {
  const Robot& both = *robot.robot;
  return map == TESSERA_LOCAL_MAP ? both.map() : both.global().map();
}
/// Where the local map is in the global frame.
inline Matrix34d frame_of_local(const tessera_robot& robot) noexcept {
  const Sharer& sharer = robot.robot->sharer();
  const std::uint32_t submap = robot.robot->maps().number();
  const bool is_open = submap == sharer.submap().submap || !sharer.frames().has(submap);
  const Matrix34d T_world_map = is_open ? sharer.frame() : sharer.frame_of(submap);
  return sharer.shared_frames() == nullptr ? T_world_map
                                           : product(sharer.world_frame(), T_world_map);
}
/// Whether all of the map can be read as one.
inline bool is_settled(const tessera_robot& robot, std::uint32_t map) noexcept {
  return map == TESSERA_LOCAL_MAP || robot.robot->global().settled();
}

/// Sums and differences of a few such times are far from an overflow.
constexpr bool is_time(std::int64_t time_us) noexcept {
  return time_us >= -TESSERA_MOST_TIME_US && time_us <= TESSERA_MOST_TIME_US;
}

/// Structs have and grow by whole multiples of that: pointers may be all that they have.
constexpr bool is_whole(std::uint32_t struct_bytes) noexcept {
  return struct_bytes % sizeof(void*) == 0;
}

/// Copies as much of a struct as the caller has over into, which has the defaults. least_bytes:
/// what programs of version 1 have, so not what the struct has now. Fails with
/// kInvalidArgument iff there is none, or it is shorter or not whole; kUnsupported iff it is of a
/// newer version.
template <class Struct>
Status read_struct(const Struct* from, std::size_t least_bytes, Struct& into) noexcept {
  if (from == nullptr) return Status::kInvalidArgument;
  std::uint32_t bytes = 0;
  std::memcpy(&bytes, from, sizeof(bytes));
  if (bytes < least_bytes || !is_whole(bytes)) return Status::kInvalidArgument;
  if (bytes > sizeof(Struct)) return Status::kUnsupported;
  std::memcpy(&into, from, bytes);
  return Status::kOk;
}

template <class Struct>
bool can_fill(const Struct* report) noexcept {
  return report != nullptr && report->struct_bytes >= 8 && is_whole(report->struct_bytes);
}
/// Gives the caller as much of a report as there is room for.
template <class Struct>
void fill(Struct& filled, Struct* into) noexcept {
  static_assert(sizeof(Struct) % 8 == 0);
  if (into->struct_bytes < sizeof(Struct)) {
    filled.struct_bytes = into->struct_bytes;
  } else {
    filled.struct_bytes = sizeof(Struct);
  }
  std::memcpy(into, &filled, filled.struct_bytes);
}

/// Statements `filled.name = from.name` from a list of counters.
#define TESSERA_FILL(kind, type, name, sentence) TESSERA_FILL_BY_##kind(name)
#define TESSERA_FILL_BY_COUNTER(name) filled.name = from.name;
#define TESSERA_FILL_BY_LEVEL(name) filled.name = from.name;
#define TESSERA_FILL_BY_FIGURE(name) filled.name = from.name;
#define TESSERA_FILL_BY_TOTAL(name) filled.name = from.name();
#define TESSERA_FILL_BY_RESERVED(name)

/// A number of bytes or points that a caller has given, in 64 bits everywhere. No memory holds more
/// than a size_t says.
inline std::size_t size_of(std::uint64_t given) noexcept {
  constexpr std::uint64_t kMost = std::numeric_limits<std::size_t>::max();
  return static_cast<std::size_t>(given < kMost ? given : kMost);
}

inline Point3f point_of(const float* p) noexcept { return {p[0], p[1], p[2]}; }
inline Matrix34d matrix_of(const double* rows) noexcept {
  Matrix34d matrix;
  for (int i = 0; i < 12; ++i) matrix(i / 4, i % 4) = rows[i];
  return matrix;
}
/// Of twelve zeros the identity.
inline Matrix34d matrix_or_identity(const double* rows) noexcept {
  for (int i = 0; i < 12; ++i) {
    if (rows[i] != 0.0) return matrix_of(rows);
  }
  return Matrix34d::Identity();
}

inline tessera_estimate estimate_of(const Estimate& from) noexcept {
  return {.probability = from.probability,
          .variance = from.variance,
          .evidence = from.evidence,
          .occupancy = from.occupancy,
          .label = from.label,
          .state = static_cast<std::uint32_t>(from.state)};
}

/// For blocks of map and archive as they are read: some of a row.
constexpr MapConfig cache_config(MapConfig map, int num_components) noexcept {
  constexpr std::size_t kMostBytes = std::size_t{1} << 18U;
  const std::size_t one = one_block_storage(map.tuple, num_components);
  map.storage_bytes = one < kMostBytes ? kMostBytes : one;
  return map;
}
/// Bytes of arena for archive and cache.
constexpr std::size_t archive_bytes(const RobotConfig& config, int num_components) noexcept {
  if (!config.window) return 0;
  return arena_bytes<LocalMap>(1) +
         StoredArchive::required_bytes(config.map, num_components, config.archived_blocks) +
         required_bytes(cache_config(config.map, num_components));
}

/// Fails as tessera_required_bytes.
Status read_config(const tessera_config* from, RobotConfig& into) noexcept;
/// The kernels that a config names, of one that read_config() took. Fails with kInvalidArgument iff
/// one is not valid, or has a height alone.
Status read_kernels(const tessera_config* from, ClassTable& into) noexcept;

/// The caller's functions as the core wants them; callbacks must stay where they are.
Clock clock_of(tessera_callbacks& callbacks) noexcept;
RobotKeys keys_of(tessera_callbacks& callbacks) noexcept;
BlockStore store_of(tessera_callbacks& callbacks) noexcept;

}  // namespace tessera::c_interface
