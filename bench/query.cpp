// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How long does it take to ask the map about a voxel: points in the order of a scan, voxels at
// random inside and outside of what was seen, and along rays? Against the latency of a load.
#include <array>
#include <cmath>

#include "scenes.hpp"
#include "tessera/grid/internal/segment.hpp"
#include "yardsticks.hpp"

namespace tessera::bench {

namespace {

constexpr std::size_t kRandomQueries = 1'000'000;
constexpr std::size_t kLoads = std::size_t{1} << 20U;
constexpr std::size_t kBytesInMemory = std::size_t{256} << 20U;
constexpr std::size_t kBytesInL2 = std::size_t{256} << 10U;

/// splitmix64.
struct Random {
  std::uint64_t state = 1;
  std::uint64_t next() { return mix64(state += 0x9e3779b97f4a7c15U); }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(next() % n); }
};

/// What was asked, so that the work is done and can be compared.
struct Answers {
  std::uint64_t sum = 0;
  void add(const Estimate& estimate) {
    sum +=
        static_cast<std::uint64_t>(estimate.state) + 4 * static_cast<std::uint64_t>(estimate.label);
  }
};

std::vector<Point3f> points_in_map(const Scan& scan) {
  std::vector<Point3f> points;
  for (std::size_t i = 0; i < scan.components.size(); ++i)
    points.push_back(transform(scan.T_map_sensor, &scan.points_xyzi[4 * i]));
  return points;
}

std::vector<VoxelCoord> shuffled(std::vector<VoxelCoord> voxels) {
  Random random;
  for (std::size_t i = voxels.size(); i > 1; --i) std::swap(voxels[i - 1], voxels[random.below(i)]);
  if (voxels.size() > kRandomQueries) voxels.resize(kRandomQueries);
  return voxels;
}

/// Voxels anywhere in the box of what was observed: most of them were never seen.
std::vector<VoxelCoord> anywhere(const std::vector<VoxelCoord>& observed) {
  VoxelCoord low = observed.front();
  VoxelCoord high = observed.front();
  for (const VoxelCoord& v : observed) {
    low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
    high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
  }
  Random random{2};
  const auto between = [&](std::int32_t a, std::int32_t b) {
    return a + static_cast<std::int32_t>(random.below(static_cast<std::size_t>(b - a + 1)));
  };
  std::vector<VoxelCoord> voxels(std::min(kRandomQueries, observed.size()));
  for (VoxelCoord& v : voxels)
    v = {between(low.x, high.x), between(low.y, high.y), between(low.z, high.z)};
  return voxels;
}

struct Question {
  const char* name;
  const char* title;
  std::size_t voxels;  ///< Asked about in one go.
  Times times{};
  std::uint64_t answers = 0;
};

template <class Ask>
void time(Question& question, Ask&& ask) {
  Answers answers;
  question.times.measure([&] { ask(answers); });
  question.answers = answers.sum;
}

std::vector<double> ns_each(const std::vector<double>& ms, std::size_t count) {
  std::vector<double> ns;
  for (const double value : ms) ns.push_back(1e6 * value / static_cast<double>(count));
  return ns;
}

/// Asks for as many at once as a caller might have room for on its stack.
template <class Item>
void ask_at_once(const LocalMap& map, std::span<const Item> items, Answers& answers) {
  std::array<Estimate, 256> room;
  while (!items.empty()) {
    const std::size_t n = std::min(items.size(), room.size());
    static_cast<void>(map.query(items.first(n), std::span<Estimate>(room).first(n)));
    for (std::size_t i = 0; i < n; ++i) answers.add(room[i]);
    items = items.subspan(n);
  }
}

/// Rays from the last scan's sensor towards each of its points and a metre on.
struct Rays {
  Point3f origin_map;
  std::vector<Point3f> directions;
  std::vector<double> ranges_m;

  template <class Visit>
  void cast(const LocalMap& map, Visit&& visit) const {
    for (std::size_t i = 0; i < directions.size(); ++i)
      visit(cast_ray(map, origin_map, directions[i], ranges_m[i]));
  }
};

Rays rays_of(const Scan& scan, const std::vector<Point3f>& points) {
  Rays rays{scan.origin_map(), {}, {}};
  for (const Point3f& point : points) {
    const Point3f direction = point - rays.origin_map;
    const double range_m = norm(direction.cast<double>());
    if (!(range_m > 0.5)) continue;
    rays.directions.push_back(direction);
    rays.ranges_m.push_back(range_m + 1.0);
  }
  return rays;
}

/// Voxels that the rays pass up to where they end, that one included.
std::size_t steps_of(const Rays& rays, const LocalMap& map) {
  std::size_t steps = 0;
  for (std::size_t i = 0; i < rays.directions.size(); ++i) {
    const RayHit hit = cast_ray(map, rays.origin_map, rays.directions[i], rays.ranges_m[i]);
    const Point3d from = rays.origin_map.cast<double>() / map.config().resolution_m;
    const Point3d d = rays.directions[i].cast<double>();
    const Point3d to = from + d * (rays.ranges_m[i] / norm(d) / map.config().resolution_m);
    walk_segment(from, to, [&](int x, int y, int z, double) {
      ++steps;
      return hit.end != RayHit::End::kOccupied || VoxelCoord{x, y, z} != hit.voxel;
    });
  }
  return steps;
}

/// How long a load takes. Measured before and after the questions: between them it would leave
/// them caches that are cold.
struct Latency {
  explicit Latency(std::size_t bytes) : loads(bytes) {}

  void measure(int repetitions) {
    for (int i = 0; i < repetitions; ++i) times.measure([&] { loads.load(kLoads); });
  }

  DependentLoads loads;
  Times times;
};

Json to_json(const std::vector<double>& memory_ms, const std::vector<double>& l2_ms) {
  return {{"memory", statistics(ns_each(memory_ms, kLoads))},
          {"l2", statistics(ns_each(l2_ms, kLoads))}};
}

Outcome<Json> measure(const Options& options, Records& records) {
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(options));
  TESSERA_TRY_ASSIGN(Mapper mapper, Mapper::make(kFreeSpaceMode, scene, options.resolution_m));
  TESSERA_TRY(mapper.integrate_all(scene));
  const LocalMap& map = mapper.map();
  const std::vector<Point3f> points = points_in_map(scene.scans.back());
  const Rays rays = rays_of(scene.scans.back(), points);
  const std::vector<VoxelCoord> observed = observed_voxels(mapper);
  const std::vector<VoxelCoord> inside = shuffled(observed);
  const std::vector<VoxelCoord> outside = anywhere(observed);
  std::vector<Question> questions{
      {"scan_order", "points of a scan, in its order, cursor", points.size()},
      {"scan_order_alone", "the same, each on its own", points.size()},
      {"scan_order_batch", "the same, at once", points.size()},
      {"random_observed", "observed voxels at random", inside.size()},
      {"random_observed_batch", "the same, at once", inside.size()},
      {"random_anywhere", "voxels at random in the map's box", outside.size()},
      {"along_rays", "voxels along rays", steps_of(rays, map)}};
  const auto ask_voxels = [&](const std::vector<VoxelCoord>& voxels) {
    return [&](Answers& answers) {
      for (const VoxelCoord& voxel : voxels) answers.add(map.query(voxel));
    };
  };
  Latency memory(kBytesInMemory);
  Latency l2(kBytesInL2);
  const auto measure_latencies = [&] {
    memory.measure(1 + options.repetitions);
    l2.measure(1 + options.repetitions);
  };
  measure_latencies();
  for (int i = 0; i < 3 * options.repetitions; ++i) {
    time(questions[0], [&](Answers& answers) {
      BlockCursor cursor(map);
      for (const Point3f& point : points) answers.add(cursor.query(point));
    });
    time(questions[1], [&](Answers& answers) {
      for (const Point3f& point : points) answers.add(map.query(point));
    });
    time(questions[2], [&](Answers& answers) { ask_at_once<Point3f>(map, points, answers); });
    time(questions[3], ask_voxels(inside));
    time(questions[4], [&](Answers& answers) { ask_at_once<VoxelCoord>(map, inside, answers); });
    time(questions[5], ask_voxels(outside));
    time(questions[6], [&](Answers& answers) {
      rays.cast(map, [&](const RayHit& hit) { answers.add(hit.estimate); });
    });
  }
  measure_latencies();
  Json json = Json::object();
  for (const Question& question : questions) {
    records.check(std::string("query_") + question.name, question.answers);
    json[question.name] = {
        {"title", question.title},
        {"voxels", question.voxels},
        {"ns_per_voxel", statistics(ns_each(question.times.ms, question.voxels))},
        {"cpu_ns_per_voxel", median(ns_each(question.times.cpu_ms, question.voxels))}};
  }
  return Json{{"observed_voxels", observed.size()},
              {"rays", rays.directions.size()},
              {"load_latency_ns", to_json(memory.times.ms, l2.times.ms)},
              {"cpu_load_latency_ns", to_json(memory.times.cpu_ms, l2.times.cpu_ms)},
              {"questions", json}};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  return tessera::bench::run(argc, argv, "query", tessera::bench::measure);
}
