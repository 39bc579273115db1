// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C interface: maps as files, through functions of the program.
#include "file_of_c.hpp"
#include "tessera/map/queries.hpp"
#include "tessera_c.hpp"

using namespace tessera;
using namespace tessera::c_interface;

namespace {

/// A map, or map and archive, as save and digest take it.
class Content {
 public:
  Content(const tessera_robot& robot, std::uint32_t map) noexcept : map_(map_of(robot, map)) {
    if (map != TESSERA_LOCAL_MAP || robot.archive == nullptr) return;
    both_.emplace(map_, *robot.archive);
    cache_ = robot.cache;
  }
  [[nodiscard]] std::size_t entries() const noexcept {
    return both_ ? both_->workspace_entries() : 2 * map_.block_count();
  }
  /// Calls use(map, blocks, lookup) with the blocks in order, in the caller's memory.
  template <class Use>
  Status with(void* memory, std::uint64_t bytes, Use&& use) noexcept {
    if (memory == nullptr || reinterpret_cast<std::uintptr_t>(memory) % alignof(KeyedIndex) != 0)
      return Status::kInvalidArgument;
    if (size_of(bytes) / sizeof(KeyedIndex) < entries()) return Status::kResourceExhausted;
    const std::span<KeyedIndex> workspace(static_cast<KeyedIndex*>(memory), entries());
    if (both_) {
      WholeMap whole(*cache_, map_.revision(), both_->map(), both_->archive());
      return use(*cache_, both_->blocks_in_order(workspace), whole.lookup());
    }
    BlocksInMemory blocks(map_);
    return use(map_, map_.blocks_in_order(workspace), blocks.lookup());
  }

 private:
  const LocalMap& map_;
  std::optional<MapAndArchive> both_;
  LocalMap* cache_ = nullptr;
};

}  // namespace

extern "C" {

tessera_status tessera_workspace_bytes(const tessera_robot* robot, uint32_t map, uint64_t* bytes) {
  if (!is_robot(robot) || !is_map(map) || bytes == nullptr) return TESSERA_INVALID_ARGUMENT;
  *bytes = sizeof(KeyedIndex) * Content(*robot, map).entries();
  return TESSERA_OK;
}

tessera_status tessera_map_digest(const tessera_robot* robot, uint32_t map, void* workspace,
                                  uint64_t workspace_bytes, uint64_t* digest) {
  if (!is_robot(robot) || !is_map(map) || digest == nullptr) return TESSERA_INVALID_ARGUMENT;
  if (!is_settled(*robot, map)) return TESSERA_BUSY;
  return status_of(Content(*robot, map)
                       .with(workspace, workspace_bytes,
                             [digest](const LocalMap& of, std::span<const KeyedIndex> blocks,
                                      const BlockLookup& lookup) {
                               const Result<std::uint64_t> content =
                                   tessera::digest(of, blocks, lookup);
                               if (content.ok()) *digest = *content;
                               return content.status();
                             }));
}

tessera_status tessera_save_map(tessera_robot* robot, uint32_t map, void* workspace,
                                uint64_t workspace_bytes,
                                int32_t (*write)(void* context, const uint8_t* bytes, size_t count),
                                void* context) {
  if (!is_robot(robot) || !is_map(map) || write == nullptr) return TESSERA_INVALID_ARGUMENT;
  if (!is_settled(*robot, map)) return TESSERA_BUSY;
  MapIdentity& identity = robot->header.identity;
  identity = {};
  identity.kind = map == TESSERA_LOCAL_MAP ? MapKind::kLocal : MapKind::kGlobal;
  if (map == TESSERA_LOCAL_MAP) {
    identity.robot = robot->robot->config().exchange.robot;
    identity.epoch = robot->robot->config().epoch;
    identity.has_T_global_map = robot->robot->sharer().is_placed();
    identity.T_global_map = frame_of_local(*robot);
  }
  FileOfC file{.write = write, .context = context};
  return status_of(
      Content(*robot, map)
          .with(workspace, workspace_bytes,
                [&](const LocalMap& of, std::span<const KeyedIndex> blocks,
                    const BlockLookup& lookup) {
                  const ByteSink sink{&file, &FileOfC::write_bytes};
                  const Result<MapSummary> summary = summarize(of, blocks, lookup);
                  if (!summary.ok()) return summary.status();
                  return save(of, identity, blocks, lookup, robot->buffer, sink, &*summary).status;
                }));
}

tessera_status tessera_load_map(tessera_robot* robot,
                                size_t (*read)(void* context, uint8_t* into, size_t capacity),
                                void* context) {
  if (!is_robot(robot) || read == nullptr) return TESSERA_INVALID_ARGUMENT;
  if (robot->archive != nullptr && robot->archive->index().size() != 0) return TESSERA_MISMATCH;
  FileOfC file{.read = read, .context = context};
  const ByteSource source{&file, &FileOfC::read_bytes};
  const MapFileStatus header = load_header(source, robot->buffer, robot->header);
  if (!header.ok()) return status_of(header.status);
  return status_of(robot->robot->mapper().load(source, robot->header, robot->buffer).status);
}

}  // extern "C"
