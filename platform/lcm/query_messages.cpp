// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "lcm/query_messages.hpp"

#include <algorithm>
#include <tessera_query.hpp>
#include <tessera_reply.hpp>

#include "lcm/short_message.hpp"
#include "tessera/base/assert.hpp"

namespace tessera {

static_assert(static_cast<int>(QueryKind::kNearest) == tessera_query::NEAREST);
static_assert(static_cast<int>(QueryMap::kGlobal) == tessera_query::GLOBAL);
static_assert(static_cast<int>(QueryError::kBusy) == tessera_reply::BUSY);
static_assert(sizeof(tessera_query::point) / sizeof(tessera_query::point[0]) ==
              MapQuery::kMostPoints);
static_assert(sizeof(tessera_reply::cell) == MapReply::kMostCells);
static_assert(std::string_view(kReplyChannel).size() + 1 + kReplyBytes <= kMaxMessageBytes);

bool decode_query(std::span<const std::byte> message, MapQuery& query) noexcept {
  // Of fixed arrays alone, so what LCM generates stays within its bounds.
  tessera_query read{};
  if (message.size() != static_cast<std::size_t>(read.getEncodedSize()) ||
      read.decode(message.data(), 0, static_cast<int>(message.size())) < 0)
    return false;
  query.version = read.version;
  query.request = read.request;
  query.client = read.client;
  query.kind = read.kind;
  query.map = read.map;
  query.stop_at_unknown = (read.flags & tessera_query::STOP_AT_UNKNOWN) != 0;
  query.count = read.count;
  query.cell_voxels = read.cell_voxels;
  query.cursor = read.cursor;
  query.class_mask = static_cast<std::uint64_t>(read.class_mask);
  query.length_m = read.length_m;
  for (std::size_t i = 0; i < query.points.size(); ++i)
    query.points[i] = {read.point[i][0], read.point[i][1], read.point[i][2]};
  return true;
}

std::array<std::byte, kReplyBytes> encode_reply(const MapReply& reply) noexcept {
  tessera_reply message{};
  message.version = kQueryVersion;
  message.request = reply.request;
  message.client = reply.client;
  message.kind = reply.kind;
  message.map = reply.map;
  message.error = static_cast<std::int32_t>(reply.error);
  message.flags = (reply.incomplete ? tessera_reply::INCOMPLETE : 0) |
                  (reply.found ? tessera_reply::FOUND : 0) |
                  (reply.at_unknown ? tessera_reply::AT_UNKNOWN : 0);
  message.generation = static_cast<std::int64_t>(reply.generation);
  message.resolution_m = reply.resolution_m;
  message.work = reply.work;
  message.count = reply.count;
  message.next_cursor = reply.next_cursor;
  std::copy(reply.size_cells.begin(), reply.size_cells.end(), message.size_cells);
  message.voxel[0] = reply.voxel.x;
  message.voxel[1] = reply.voxel.y;
  message.voxel[2] = reply.voxel.z;
  message.distance_m = reply.distance_m;
  message.searched_m = reply.searched_m;
  std::copy(reply.probability.begin(), reply.probability.end(), message.probability);
  std::copy(reply.variance.begin(), reply.variance.end(), message.variance);
  std::copy(reply.cells.begin(), reply.cells.end(), message.cell);
  std::array<std::byte, kReplyBytes> bytes{};
  const int written = message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  TESSERA_ASSERT(written == static_cast<int>(kReplyBytes));
  static_cast<void>(written);
  return bytes;
}

}  // namespace tessera
