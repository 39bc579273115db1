// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/view_thread.hpp"

#include <fmt/core.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/allocation_counter.hpp"
#include "base/number_text.hpp"
#include "maps/judged_robot.hpp"
#include "maps/session_file.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

/// Where the robot's map is in the frame of the global map, which links may find and move.
Matrix34d frame_of(const ViewedNode& node) noexcept {
  if (node.frames != nullptr) {
    if (const auto T = T_team_world(node.frames->view(), node.robot))
      return product(*T, node.T_global_map);
  }
  return node.T_global_map;
}

/// The contributors of the global map as far as a node knows them without fusing again: the content
/// of its own map at a voxel. For the view's thread.
class OwnMarks {
 public:
  explicit OwnMarks(const ViewedNode& node)
      : node_(node), local_(node.local->map()), reader_(*node.local) {}
  /// 0: this robot has no label there; else it has, and whether that differs from the fused one.
  void mark(const BlockSnapshot& block, BlockMarks& marks) {
    const Lattice lattice = local_.lattice();
    const Matrix34d T_map_global = inverse(frame_of(node_));
    const double prior = local_.config().prior;
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      for (unsigned left = block.observed_labels(octet); left != 0; left &= left - 1) {
        const int voxel = std::countr_zero(left);
        VoxelMark& mark = marks[static_cast<std::size_t>(row_order(octet, voxel))];
        mark = {.contributor = 0, .disagreement = false};
        const Point3d p_map =
            T_map_global.leftCols<3>() * lattice.center_of(voxel_at(block.coord(), octet, voxel)) +
            T_map_global.col(3);
        const Result<VoxelCoord> own = lattice.voxel_of(p_map);
        if (!own.ok()) continue;
        const Result<Estimate> e = reader_.query(*own);
        if (!e.ok() || e->label == 0) continue;
        const int fused = estimate(block.evidence(octet, voxel), prior).label;
        mark = {.contributor = VoxelMark::kTwo, .disagreement = fused != e->label};
      }
    }
  }

 private:
  const ViewedNode node_;
  const LocalMap& local_;  ///< For what never changes.
  MapReader reader_;
};

std::vector<std::unique_ptr<ViewMap>> maps_of(const ViewedNode& node) {
  const std::string robot = fmt::format("robot {}", node.robot);
  ViewMapInfo local;
  local.name = "local map of " + robot;
  local.robot = node.robot;
  local.T_global_map = node.T_global_map;
  local.live = true;
  local.contributors = {robot};
  ViewMapInfo global;
  global.name = "global map";
  global.global = true;
  global.robot = node.robot;
  global.live = true;
  global.contributors = {"only other robots or earlier days", robot + ", alone or with others"};
  global.marks = [own = std::make_shared<OwnMarks>(node)](
                     const BlockSnapshot& block, BlockMarks& marks) { own->mark(block, marks); };
  std::vector<std::unique_ptr<ViewMap>> maps;
  // In submaps two maps take turns.
  const std::uint32_t current = node.local->number();
  if (node.local->in_submaps()) {
    ViewMapInfo other = local;
    other.name = "submap before or after it";
    maps.push_back(std::make_unique<ViewMap>(node.local->of(current), std::move(local)));
    maps.push_back(std::make_unique<ViewMap>(node.local->of(current + 1), std::move(other)));
  } else {
    maps.push_back(std::make_unique<ViewMap>(node.local->map(), std::move(local)));
  }
  maps.push_back(std::make_unique<ViewMap>(*node.global, std::move(global)));
  return maps;
}

double ms_of(std::int64_t us) { return 1e-3 * static_cast<double>(us); }

Json network_json(const SharingThreadState& sharing, const NetworkPort& port) {
  const ExchangeReport& r = sharing.exchange;
  const LinkReport link = port.link().report();
  const std::uint64_t refused = link.refused_format + link.refused_mission + link.refused_tag +
                                link.refused_excluded + r.refused_size + r.refused_format +
                                r.refused_mission + r.refused_tag + r.refused_signature +
                                r.refused_configuration + r.refused_replay + r.refused_robot +
                                r.refused_excluded + r.refused_peers + r.refused_body;
  return {{"in_reach", sharing.in_reach},
          {"peers", r.peers},
          {"contributions", r.contributions},
          {"complete", r.complete},
          {"sent", link.sent},
          {"sent_bytes", link.sent_bytes},
          {"received", link.received},
          {"received_bytes", link.received_bytes},
          {"missing", link.missing},
          {"lost_here", link.queue_full + link.kernel_dropped + link.failed},
          {"refused", refused}};
}

}  // namespace

Outcome<std::unique_ptr<ViewThread>> ViewThread::open(const ViewerConfig& config,
                                                      const ViewedNode& node) {
  const double step_m = 2.0 * node.local->map().config().resolution_m;
  std::unique_ptr<ViewThread> thread(new ViewThread(node, step_m));
  TESSERA_TRY_ASSIGN(
      std::unique_ptr<Viewer> viewer,
      Viewer::open(config, maps_of(node), [self = thread.get()] { return self->status(); }));
  thread->viewer_ = std::move(viewer);
  return thread;
}

Outcome<void> ViewThread::start(const ThreadRole& role) {
  return thread_.start(
      role, [](void* self) { static_cast<ViewThread*>(self)->run(); }, this);
}

void ViewThread::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  thread_.join();
}

void ViewThread::run() noexcept {
  // After all threads without a real-time priority. A refusal does no harm.
  constexpr int kNice = 10;
  static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice));
  while (!stopping_.load(std::memory_order_acquire)) {
    if (!begun_.load(std::memory_order_acquire)) {
      ::usleep(1000 * kTurn_ms);
      continue;
    }
    viewer_->serve(kTurn_ms);
    look();
    heap_allocations_.store(thread_heap_allocations().value_or(0), std::memory_order_relaxed);
  }
}

/// Far more often than cycles end, so that nearly all of them are seen; the others are counted.
void ViewThread::look() noexcept {
  const std::uint64_t before = mapping_.cycles;
  if (!node_.mapping->state().get(mapping_) || mapping_.cycles == before) return;
  cycles_.add(mapping_.last_cycle_us);
  unseen_ += mapping_.cycles - before - 1;
  note_place(mapping_.T_map_sensor);
}

void ViewThread::note_place(const std::array<double, 12>& T_map_sensor) noexcept {
  const std::array<float, 3> place{static_cast<float>(T_map_sensor[3]),
                                   static_cast<float>(T_map_sensor[7]),
                                   static_cast<float>(T_map_sensor[11])};
  if (places_ > 0) {
    const std::array<float, 3>& last = track_[places_ - 1];
    const double moved_m = std::hypot(static_cast<double>(place[0]) - static_cast<double>(last[0]),
                                      static_cast<double>(place[1]) - static_cast<double>(last[1]),
                                      static_cast<double>(place[2]) - static_cast<double>(last[2]));
    if (moved_m < step_m_ * static_cast<double>(std::size_t{1} << thinned_)) return;
  }
  if (places_ == kTrack) {
    for (std::size_t i = 0; 2 * i < kTrack; ++i) track_[i] = track_[2 * i];
    places_ = kTrack / 2;
    thinned_ += thinned_ < 40 ? 1 : 0;
  }
  track_[places_++] = place;
}

Json ViewThread::doubted_json() const {
  const ClassTable& classes = node_.global->map().classes();
  Json json = Json::array();
  for (const DoubtedRobots::Robot& one : node_.doubts->view().all()) {
    json.push_back({{"robot", one.robot},
                    {"reliability", decimal_of(one.reliability)},
                    {"classes", names_of(one.classes, classes)}});
  }
  return json;
}

Json ViewThread::status() const {
  Json robot = {{"robot", node_.robot}, {"track", Json::array()}, {"T_map_sensor", Json()}};
  const Matrix34d T_global_map = frame_of(node_);
  robot["T_global_map"] = std::vector<double>(T_global_map.data(), T_global_map.data() + 12);
  for (std::size_t i = 0; i < places_; ++i) robot["track"].push_back(track_[i]);
  if (mapping_.cycles > 0) robot["T_map_sensor"] = mapping_.T_map_sensor;
  Json buckets = Json::array();
  cycles_.for_each([&buckets](std::int64_t most_us, std::uint64_t count) {
    buckets.push_back({ms_of(most_us), count});
  });
  SharingThreadState sharing;
  static_cast<void>(node_.sharing->state().get(sharing));
  Json json = {{"live", true}, {"robots", Json::array({robot})}};
  json["timing"] = {{"period_ms", ms_of(node_.period_us)},
                    {"cycles", mapping_.cycles},
                    {"missed", mapping_.missed},
                    {"p50_ms", ms_of(cycles_.quantile_us(0.5))},
                    {"p99_ms", ms_of(cycles_.quantile_us(0.99))},
                    {"max_ms", ms_of(mapping_.worst_cycle_us)},
                    {"unseen", unseen_},
                    {"ticks", sharing.ticks},
                    {"buckets", std::move(buckets)}};
  json["network"] = network_json(sharing, *node_.port);
  Json& sessions = json["network"]["sessions"] = Json::array();
  for (std::uint32_t i = 0; i < sharing.session_count; ++i)
    sessions.push_back(to_json(sharing.sessions[i]));
  json["network"]["exclude_differs"] = node_.fleet->view().differ();
  json["network"]["doubted"] = doubted_json();
  if (const FramesState frames = node_.frames->view(); frames.mode != FrameMode::kGiven)
    json["frames"] = to_json(frames);
  return json;
}

}  // namespace tessera
