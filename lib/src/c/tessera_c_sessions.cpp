// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C interface: maps of earlier days, read through functions of the program.
#include <algorithm>

#include "file_of_c.hpp"
#include "tessera/map/queries.hpp"
#include "tessera_c.hpp"

using namespace tessera;
using namespace tessera::c_interface;

/// In the caller's memory, until all of it is published.
struct tessera_loaded_session {
  LocalMap map{};
  std::span<KeyedIndex> workspace{};
  std::span<const KeyedIndex> blocks{};
  std::size_t next = 0;
  std::uint32_t number = 0;
};

namespace {

std::size_t workspace_entries(const MapFileHeader& header) noexcept {
  return 2 * size_of(header.content.blocks) + 1;
}

std::size_t bytes_of(const MapFileHeader& header) noexcept {
  return arena_bytes<tessera_loaded_session>(1) + required_bytes(header.config) +
         arena_bytes<KeyedIndex>(workspace_entries(header));
}

/// Reads the blocks that follow the header.
Status load(tessera_robot& robot, const ByteSource& source, Arena& arena,
            tessera_loaded_session& loaded) noexcept {
  const Status made =
      LocalMap::make_at(loaded.map, arena, robot.header.config, robot.header.classes);
  if (made != Status::kOk) return made;
  loaded.workspace = arena.take<KeyedIndex>(workspace_entries(robot.header));
  if (loaded.workspace.empty()) return Status::kResourceExhausted;
  return load_blocks(source, robot.header, robot.buffer, loaded.map).status;
}

}  // namespace

extern "C" {

tessera_status tessera_session_bytes(tessera_robot* robot,
                                     size_t (*read)(void* context, uint8_t* into, size_t capacity),
                                     void* context, uint64_t* bytes) {
  if (!is_robot(robot) || read == nullptr || bytes == nullptr) return TESSERA_INVALID_ARGUMENT;
  FileOfC file{.read = read, .context = context};
  const MapFileStatus status =
      load_header({&file, &FileOfC::read_bytes}, robot->buffer, robot->header);
  if (!status.ok()) return status_of(status.status);
  *bytes = bytes_of(robot->header);
  return TESSERA_OK;
}

tessera_status tessera_open_session(tessera_robot* robot,
                                    size_t (*read)(void* context, uint8_t* into, size_t capacity),
                                    void* context, void* memory, uint64_t bytes, double weight,
                                    int64_t date_s, const double* T_global_map, uint32_t* number) {
  if (!is_robot(robot) || read == nullptr || memory == nullptr || number == nullptr ||
      reinterpret_cast<std::uintptr_t>(memory) % TESSERA_ALIGNMENT != 0 ||
      !(weight > 0.0 && weight <= 1.0))
    return TESSERA_INVALID_ARGUMENT;
  if (robot->session != nullptr) return TESSERA_BUSY;
  if (!knows_own_frame(robot->robot->config().frames)) return TESSERA_UNSUPPORTED;
  FileOfC file{.read = read, .context = context};
  const ByteSource source{&file, &FileOfC::read_bytes};
  const MapFileStatus header = load_header(source, robot->buffer, robot->header);
  if (!header.ok()) return status_of(header.status);
  if (size_of(bytes) < bytes_of(robot->header)) return TESSERA_RESOURCE_EXHAUSTED;
  Arena arena({static_cast<std::byte*>(memory), size_of(bytes)});
  tessera_loaded_session& loaded = arena.take<tessera_loaded_session>(1).front();
  if (const Status status = load(*robot, source, arena, loaded); status != Status::kOk)
    return status_of(status);
  const double units = weight * double{MapSession::kFullWeight} + 0.5;
  MapSession session{.digest = digest(loaded.map, loaded.workspace),
                     .date_s = date_s,
                     .weight = static_cast<std::uint16_t>(units < 1.0 ? 1.0 : units)};
  loaded.blocks = loaded.map.blocks_in_order(loaded.workspace);
  const Result<std::uint32_t> opened = robot->robot->sharer().sessions().open(
      loaded.map, session,
      T_global_map != nullptr ? matrix_of(T_global_map) : Matrix34d(Matrix34d::Identity()));
  if (!opened.ok()) return status_of(opened.status());
  loaded.number = *opened;
  robot->session = &loaded;
  *number = *opened - MapSession::kFirst;
  return TESSERA_OK;
}

tessera_status tessera_publish_session(tessera_robot* robot, uint32_t blocks, uint32_t* left) {
  if (!is_robot(robot) || left == nullptr || robot->session == nullptr)
    return TESSERA_INVALID_ARGUMENT;
  tessera_loaded_session& loaded = *robot->session;
  MapSessions& sessions = robot->robot->sharer().sessions();
  const Result<std::size_t> done =
      sessions.publish(loaded.number, loaded.map, loaded.blocks, loaded.next, blocks);
  *left = 0;
  if (done.ok()) {
    loaded.next += *done;
    *left = static_cast<std::uint32_t>(loaded.blocks.size() - loaded.next);
    // One more call says that there are no more.
    if (*left == 0) {
      static_cast<void>(sessions.publish(loaded.number, loaded.map, loaded.blocks, loaded.next, 1));
    }
  }
  if (*left == 0) robot->session = nullptr;
  return status_of(done.status());
}

tessera_status tessera_remove_session(tessera_robot* robot, uint32_t number) {
  if (!is_robot(robot) || MapSession::is(number)) return TESSERA_INVALID_ARGUMENT;
  return status_of(robot->robot->sharer().sessions().remove(MapSession::kFirst + number));
}

tessera_status tessera_session_at(const tessera_robot* robot, uint32_t index,
                                  tessera_session* session) {
  if (!is_robot(robot) || !can_fill(session)) return TESSERA_INVALID_ARGUMENT;
  const std::span<const MapSessions::Session> all = robot->robot->sharer().sessions().all();
  if (index >= all.size()) return TESSERA_OUT_OF_RANGE;
  const MapSessions::Session& from = all[index];
  tessera_session filled{};
  filled.number = from.submap - MapSession::kFirst;
  filled.state = static_cast<std::uint32_t>(from.state);
  filled.blocks = from.blocks;
  filled.digest = from.session.digest;
  filled.date_s = from.session.date_s;
  filled.weight = from.session.weight / double{MapSession::kFullWeight};
  filled.refused_blocks = from.refused_blocks;
  fill(filled, session);
  return TESSERA_OK;
}

}  // extern "C"
