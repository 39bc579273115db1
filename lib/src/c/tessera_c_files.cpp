// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C interface: maps as files, through functions of the program.
#include "tessera/map/queries.hpp"
#include "tessera_c.hpp"

using namespace tessera;
using namespace tessera::c_interface;

/// Outside of the library's namespace, as CallbacksOfC.
struct FileOfC {
  int32_t (*write)(void* context, const uint8_t* bytes, size_t count) = nullptr;
  size_t (*read)(void* context, uint8_t* into, size_t capacity) = nullptr;
  void* context = nullptr;

  static bool write_bytes(void* file, std::span<const std::byte> bytes) {
    const auto& to = *static_cast<const FileOfC*>(file);
    return to.write(to.context, reinterpret_cast<const std::uint8_t*>(bytes.data()),
                    bytes.size()) == 1;
  }
  static std::size_t read_bytes(void* file, std::span<std::byte> into) {
    const auto& from = *static_cast<const FileOfC*>(file);
    const std::size_t count =
        from.read(from.context, reinterpret_cast<std::uint8_t*>(into.data()), into.size());
    // What claims to have given more than there is room for has given nothing of use.
    return count <= into.size() ? count : 0;
  }
};

namespace {

/// The blocks' order, in the caller's memory; empty where it is too small for the map's blocks.
Status workspace_for(const LocalMap& map, void* memory, std::uint64_t bytes,
                     std::span<KeyedIndex>& into) noexcept {
  if (memory == nullptr || reinterpret_cast<std::uintptr_t>(memory) % alignof(KeyedIndex) != 0)
    return Status::kInvalidArgument;
  const std::size_t entries = size_of(bytes) / sizeof(KeyedIndex);
  if (entries < 2 * map.block_count()) return Status::kResourceExhausted;
  into = {static_cast<KeyedIndex*>(memory), 2 * map.block_count()};
  return Status::kOk;
}

}  // namespace

extern "C" {

tessera_status tessera_workspace_bytes(const tessera_robot* robot, uint32_t map, uint64_t* bytes) {
  if (!is_robot(robot) || !is_map(map) || bytes == nullptr) return TESSERA_INVALID_ARGUMENT;
  *bytes = 2 * sizeof(KeyedIndex) * map_of(*robot, map).block_count();
  return TESSERA_OK;
}

tessera_status tessera_map_digest(const tessera_robot* robot, uint32_t map, void* workspace,
                                  uint64_t workspace_bytes, uint64_t* digest) {
  if (!is_robot(robot) || !is_map(map) || digest == nullptr) return TESSERA_INVALID_ARGUMENT;
  if (!is_settled(*robot, map)) return TESSERA_BUSY;
  std::span<KeyedIndex> entries;
  const LocalMap& of = map_of(*robot, map);
  const Status status = workspace_for(of, workspace, workspace_bytes, entries);
  if (status != Status::kOk) return status_of(status);
  *digest = tessera::digest(of, entries);
  return TESSERA_OK;
}

tessera_status tessera_save_map(tessera_robot* robot, uint32_t map, void* workspace,
                                uint64_t workspace_bytes,
                                int32_t (*write)(void* context, const uint8_t* bytes, size_t count),
                                void* context) {
  if (!is_robot(robot) || !is_map(map) || write == nullptr) return TESSERA_INVALID_ARGUMENT;
  if (!is_settled(*robot, map)) return TESSERA_BUSY;
  std::span<KeyedIndex> entries;
  const LocalMap& of = map_of(*robot, map);
  const Status status = workspace_for(of, workspace, workspace_bytes, entries);
  if (status != Status::kOk) return status_of(status);
  MapIdentity& identity = robot->header.identity;
  identity = {};
  identity.kind = map == TESSERA_LOCAL_MAP ? MapKind::kLocal : MapKind::kGlobal;
  if (map == TESSERA_LOCAL_MAP) {
    identity.robot = robot->robot->config().exchange.robot;
    identity.epoch = robot->robot->config().epoch;
    identity.has_T_global_map = true;
    identity.T_global_map = robot->robot->sharer().frame();
  }
  FileOfC file{.write = write, .context = context};
  return status_of(
      save(of, identity, entries, robot->buffer, {&file, &FileOfC::write_bytes}).status);
}

tessera_status tessera_load_map(tessera_robot* robot,
                                size_t (*read)(void* context, uint8_t* into, size_t capacity),
                                void* context) {
  if (!is_robot(robot) || read == nullptr) return TESSERA_INVALID_ARGUMENT;
  FileOfC file{.read = read, .context = context};
  const ByteSource source{&file, &FileOfC::read_bytes};
  const MapFileStatus header = load_header(source, robot->buffer, robot->header);
  if (!header.ok()) return status_of(header.status);
  return status_of(robot->robot->mapper().load(source, robot->header, robot->buffer).status);
}

}  // extern "C"
