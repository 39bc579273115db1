// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "view/viewer.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include "base/monotonic_clock.hpp"
#include "view/page_files.hpp"

namespace tessera {

namespace {

constexpr const char* kJson = "application/json";
constexpr const char* kBytes = "application/octet-stream";
/// Size of a message with room for any block.
constexpr std::size_t kFewestViewBytes = kViewHeaderBytes + kMostViewBlockBytes;
static_assert(kFewestViewBytes <= WebServer::kOwnRoomBytes);
static_assert(sizeof(std::uint64_t) * (1 + MapReader::kPageBlocks) <= WebServer::kOwnRoomBytes);

template <class Number>
bool take(const WebRequest& request, const char* name, Number& into) {
  const std::optional<std::string_view> text = request.argument(name);
  if (!text) return false;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), into);
  return error == std::errc{} && end == text->data() + text->size() && !text->empty();
}

WebReply refusal(unsigned status, const char* why) {
  WebReply reply;
  reply.status = status;
  reply.text = std::string(why) + "\n";
  return reply;
}

WebReply json_reply(const Json& json) {
  WebReply reply;
  reply.type = kJson;
  // Names may come from files: invalid UTF-8 in them is replaced.
  reply.text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return reply;
}

Json to_json(const ViewMap& map) {
  const ViewMapInfo& info = map.info();
  const ClassTable& classes = map.map().classes();
  Json json = {{"name", info.name},
               {"kind", info.global ? "global" : "local"},
               {"robot", info.robot},
               {"live", info.live},
               {"resolution_m", map.map().config().resolution_m},
               {"contributors", info.contributors}};
  json["T_global_map"] =
      std::vector<double>(info.T_global_map.data(), info.T_global_map.data() + 12);
  json["classes"] = Json::array();
  for (int label = 1; label <= classes.num_classes(); ++label) {
    const SemanticClass& c = classes[label];
    json["classes"].push_back(
        {{"name", std::string(c.name_view())}, {"color", {c.color.r, c.color.g, c.color.b}}});
  }
  return json;
}

}  // namespace

Viewer::Viewer(const ViewerConfig& config, std::vector<std::unique_ptr<ViewMap>> maps,
               Status status)
    : address_(config.address),
      maps_(std::move(maps)),
      status_(std::move(status)),
      budget_(config.voxels_per_s),
      session_(static_cast<std::uint64_t>(MonotonicClock::now_us())) {}

Outcome<std::unique_ptr<Viewer>> Viewer::open(const ViewerConfig& config,
                                              std::vector<std::unique_ptr<ViewMap>> maps,
                                              Status status) {
  std::unique_ptr<Viewer> viewer(new Viewer(config, std::move(maps), std::move(status)));
  TESSERA_TRY_ASSIGN(std::unique_ptr<WebServer> server,
                     WebServer::open(config.address, [self = viewer.get()](WebRequest& request) {
                       return self->answer(request);
                     }));
  viewer->server_ = std::move(server);
  return viewer;
}

void Viewer::serve(int timeout_ms) noexcept {
  server_->serve(timeout_ms);
  report_.web = server_->report();
  shared_report_.store(report_);
}

WebReply Viewer::answer(WebRequest& request) {
  const std::string_view path = request.path();
  if (path == "/maps") return maps_reply();
  if (path == "/status") return status_reply();
  if (path == "/blocks") return blocks_reply(request);
  if (path == "/keys") return keys_reply(request);
  if (path == "/voxel") return voxel_reply(request);
  const std::string_view name =
      path == "/" ? "index.html" : path.substr(std::min<std::size_t>(1, path.size()));
  for (const PageFile& file : page_files()) {
    if (file.name != name) continue;
    WebReply reply;
    reply.type = file.type;
    reply.lasting = file.content;
    return reply;
  }
  return refusal(404, "unknown name");
}

WebReply Viewer::maps_reply() const {
  Json json = {{"session", session_}, {"maps", Json::array()}};
  for (const auto& map : maps_) json["maps"].push_back(to_json(*map));
  return json_reply(json);
}

WebReply Viewer::status_reply() const {
  Json json = status_ ? status_() : Json::object();
  json["session"] = session_;
  json["view"] = {{"connections", report_.web.connections},
                  {"requests", report_.web.requests},
                  {"dropped", report_.web.dropped},
                  {"stalled", report_.web.stalled},
                  {"messages", report_.messages},
                  {"blocks", report_.blocks},
                  {"bytes", report_.bytes},
                  {"deferred", report_.deferred}};
  return json_reply(json);
}

ViewMap* Viewer::map_of(const WebRequest& request) const {
  std::uint32_t number = 0;
  if (!take(request, "map", number) || number >= maps_.size()) return nullptr;
  return maps_[number].get();
}

WebReply Viewer::blocks_reply(WebRequest& request) {
  ViewMap* const map = map_of(request);
  ViewCursor cursor;
  // All or none of them: the state of a page, or nothing yet.
  const bool known = take(request, "since", cursor.since) && take(request, "round", cursor.round) &&
                     take(request, "key", cursor.key) && take(request, "page", cursor.page) &&
                     take(request, "met", cursor.blocks);
  if (map == nullptr || !known)
    return refusal(400, "map, since, round, key, page and met must be numbers");
  std::span<std::byte> room = request.room();
  if (room.empty()) return refusal(503, "too many ask at once; try again");
  // Over a slow link a page requests less at once.
  std::size_t most = room.size();
  static_cast<void>(take(request, "most", most));
  room = room.first(std::clamp(most, kFewestViewBytes, room.size()));
  budget_.renew(MonotonicClock::now_us());
  ViewHeader header;
  header.session = session_;
  static_cast<void>(take(request, "map", header.map));
  WebReply reply;
  reply.type = kBytes;
  reply.room_bytes = map->put_changes(cursor, header, budget_, room);
  ++report_.messages;
  report_.bytes += reply.room_bytes;
  report_.blocks += header.blocks;
  report_.deferred += header.deferred ? 1 : 0;
  return reply;
}

WebReply Viewer::keys_reply(WebRequest& request) {
  ViewMap* const map = map_of(request);
  std::uint64_t page = 0;
  if (map == nullptr || !take(request, "page", page))
    return refusal(400, "map and page must be numbers");
  const std::span<std::byte> room = request.room();
  budget_.renew(MonotonicClock::now_us());
  if (room.empty() || budget_.is_used_up()) return refusal(503, "too many ask at once; try again");
  WebReply reply;
  reply.type = kBytes;
  reply.room_bytes = map->put_keys(page, budget_, room);
  return reply;
}

WebReply Viewer::voxel_reply(WebRequest& request) {
  ViewMap* const map = map_of(request);
  Point3d p_map;
  if (map == nullptr || !take(request, "x", p_map.x()) || !take(request, "y", p_map.y()) ||
      !take(request, "z", p_map.z()))
    return refusal(400, "map, x, y and z must be numbers, the last three in metres");
  const Json json = map->voxel(p_map);
  if (json.is_null()) return refusal(503, "the voxel is being changed; try again");
  return json_reply(json);
}

}  // namespace tessera
