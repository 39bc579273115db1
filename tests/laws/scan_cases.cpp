// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "laws/scan_cases.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iomanip>
#include <limits>
#include <set>
#include <sstream>

namespace tessera::oracle {

namespace {

using Limits = std::numeric_limits<float>;

/// In units of the resolution, so that scans cover as many voxels whatever it is.
constexpr double kRange_voxels = 24.0;

/// The pairs of levels that no row has yet.
class OpenPairs {
 public:
  OpenPairs() {
    for (std::size_t f = 0; f < kLevels.size(); ++f) {
      for (std::size_t g = f + 1; g < kLevels.size(); ++g) add_all(f, g);
    }
  }
  [[nodiscard]] bool empty() const { return open_.empty(); }
  [[nodiscard]] const std::array<int, 4>& first() const { return *open_.begin(); }
  [[nodiscard]] bool has(std::size_t f, int a, std::size_t g, int b) const {
    return open_.count(pair_of(f, a, g, b)) != 0;
  }
  void close(const Row& row) {
    for (std::size_t f = 0; f < row.size(); ++f) {
      for (std::size_t g = f + 1; g < row.size(); ++g) open_.erase(pair_of(f, row[f], g, row[g]));
    }
  }

 private:
  static std::array<int, 4> pair_of(std::size_t f, int a, std::size_t g, int b) {
    if (f > g) return pair_of(g, b, f, a);
    return {static_cast<int>(f), static_cast<int>(g), a, b};
  }
  void add_all(std::size_t f, std::size_t g) {
    for (int a = 0; a < kLevels[f]; ++a) {
      for (int b = 0; b < kLevels[g]; ++b) open_.insert(pair_of(f, a, g, b));
    }
  }
  std::set<std::array<int, 4>> open_;
};

/// The level of factor f that closes the most pairs with the factors chosen so far; ties at random.
int best_level(const OpenPairs& open, const Row& row, std::size_t f, Random& random) {
  const int first = random.below(kLevels[f]);
  int best = first;
  int most = -1;
  for (int k = 0; k < kLevels[f]; ++k) {
    const int level = (first + k) % kLevels[f];
    int closes = 0;
    for (std::size_t g = 0; g < row.size(); ++g) {
      if (g != f && row[g] >= 0 && open.has(f, level, g, row[g])) ++closes;
    }
    if (closes > most) {
      most = closes;
      best = level;
    }
  }
  return best;
}

float raw_value(Special special) {
  switch (special) {
    case Special::kPlusZero:
      return 0.0F;
    case Special::kMinusZero:
      return -0.0F;
    case Special::kLeastSubnormal:
      return Limits::denorm_min();
    case Special::kMinusLeastSubnormal:
      return -Limits::denorm_min();
    case Special::kMostSubnormal:
      return std::nextafter(Limits::min(), 0.0F);
    case Special::kLeastNormal:
      return Limits::min();
    case Special::kLargest:
      return Limits::max();
    case Special::kMinusLargest:
      return -Limits::max();
    case Special::kHuge:
      return 1e20F;
    case Special::kInfinity:
      return Limits::infinity();
    case Special::kMinusInfinity:
      return -Limits::infinity();
    case Special::kMinusNan:
      return std::bit_cast<float>(0xffc00001U);
    default:
      return std::bit_cast<float>(0x7fc00000U);
  }
}

bool is_raw(Special special) {
  return special >= Special::kPlusZero && special <= Special::kMinusNan;
}

/// Where a special puts a coordinate of the map frame, metres; at: where it is now.
double map_value(const ScanCase& scan_case, Special special, double at) {
  const double voxel_m = scan_case.map.resolution_m;
  const auto border = [&](double edge_voxels) {
    const double edge_m = edge_voxels * voxel_m;
    return std::round(at / edge_m) * edge_m;
  };
  const auto face = static_cast<float>(scan_case.grid_limit() * voxel_m);
  const auto next = [](float from, float to) {
    return static_cast<double>(std::nextafter(from, to));
  };
  switch (special) {
    case Special::kLastInGrid:
      return next(face, 0.0F);
    case Special::kFirstBeyondGrid:
      return static_cast<double>(face);
    case Special::kFirstInGrid:
      return -static_cast<double>(face);
    case Special::kLastBelowGrid:
      return next(-face, -Limits::max());
    case Special::kVoxelBorder:
      return border(1.0);
    case Special::kOctetBorder:
      return border(2.0);
    case Special::kBlockBorder:
      return border(8.0);
    default:
      return next(static_cast<float>(border(8.0)), -Limits::max());
  }
}

/// Applies f(coordinate) to the coordinates that a part names.
template <class P, class F>
void for_part(Part part, P& p, F&& f) {
  for (int i = 0; i < 3; ++i) {
    if (part == Part::kAll || static_cast<int>(part) == i) f(p[static_cast<std::size_t>(i)]);
  }
}

float special_weight(Special special, Random& random) {
  if (is_raw(special)) return raw_value(special);
  const std::array<float, 3> weights{kMaxWeight, std::nextafter(kMaxWeight, 2e6F), 0.0F};
  return weights[static_cast<std::size_t>(random.below(3))];
}

/// Puts coordinates of the map frame where a special wants them.
void move_in_map(const ScanCase& scan_case, Special special, Part part, Return& given) {
  const Eigen::Matrix3d R = scan_case.T_map_sensor.leftCols<3>();
  const Eigen::Vector3d t = scan_case.T_map_sensor.col(3);
  const Eigen::Vector3d p(static_cast<double>(given.p_sensor[0]),
                          static_cast<double>(given.p_sensor[1]),
                          static_cast<double>(given.p_sensor[2]));
  const Eigen::Vector3d p_map = R * p + t;
  std::array<double, 3> moved{p_map.x(), p_map.y(), p_map.z()};
  for_part(part, moved, [&](double& v) { v = map_value(scan_case, special, v); });
  const Eigen::Vector3d back = R.transpose() * (Eigen::Vector3d(moved[0], moved[1], moved[2]) - t);
  given.p_sensor = {static_cast<float>(back.x()), static_cast<float>(back.y()),
                    static_cast<float>(back.z())};
}

void make_special(const ScanCase& scan_case, Part part, Return& given, Random& random) {
  const Special special = scan_case.special();
  if (special == Special::kNone) return;
  if (part == Part::kWeight) {
    given.weight = special_weight(special, random);
    return;
  }
  if (is_raw(special)) {
    for_part(part, given.p_sensor, [&](float& v) { v = raw_value(special); });
    return;
  }
  if (special == Special::kAtMinRange || special == Special::kAtMaxRange) {
    const float range_m = special == Special::kAtMinRange ? scan_case.inference.min_range_m
                                                          : scan_case.inference.max_range_m;
    given.p_sensor = {};
    for_part(part, given.p_sensor,
             [&](float& v) { v = part == Part::kAll ? range_m / std::sqrt(3.0F) : range_m; });
    return;
  }
  move_in_map(scan_case, special, part, given);
}

Return plain_return(const ScanCase& scan_case, Random& random, const Return* beside) {
  const double voxel_m = scan_case.map.resolution_m;
  Return given;
  given.component =
      static_cast<std::uint8_t>(random.below(8) == 0 ? random.below(256) : 1 + random.below(3));
  const int kind = random.below(20);
  given.weight = kind == 0 ? 0.0F : static_cast<float>(kind < 12 ? 1.0 : random.uniform(0.05, 2.0));
  // One in three lies beside another, so that cells are shared.
  const bool shared = beside != nullptr && random.below(3) == 0;
  const double reach_m = kRange_voxels * voxel_m * (random.below(5) == 0 ? 1.3 : 0.55);
  for (std::size_t i = 0; i < 3; ++i) {
    const double near_m = random.uniform(-voxel_m, voxel_m);
    const double v = shared ? static_cast<double>(beside->p_sensor[i]) + near_m
                            : random.uniform(-reach_m, reach_m);
    given.p_sensor[i] = static_cast<float>(v);
  }
  return given;
}

std::vector<Return> plain_returns(const ScanCase& scan_case, int count, Random& random) {
  std::vector<Return> returns;
  for (int i = 0; i < count; ++i) {
    const Return* const beside = returns.empty() ? nullptr : &returns.back();
    returns.push_back(plain_return(scan_case, random, beside));
  }
  // Simulators give coordinates on borders.
  if (random.below(4) != 0) return returns;
  const auto border =
      static_cast<Special>(static_cast<int>(Special::kVoxelBorder) + random.below(3));
  for (Return& given : returns) {
    const auto part = static_cast<Part>(random.below(4));
    move_in_map(scan_case, border, part, given);
  }
  return returns;
}

int count_of(Size size, Random& random) {
  switch (size) {
    case Size::kOne:
      return 1;
    case Size::kTwo:
      return 2;
    case Size::kFew:
      return 3 + random.below(10);
    default:
      return 13 + random.below(52);
  }
}

void draw_config(ScanCase& scan_case, Random& random) {
  const Row& row = scan_case.row;
  const double voxel_m = std::array{0.125, 0.1, 0.5}[static_cast<std::size_t>(row[7])];
  MapConfig& map = scan_case.map;
  map.resolution_m = voxel_m;
  map.tuple = static_cast<TuplePolicy>(row[6]);
  map.storage_bytes = std::size_t{3} << 20U;
  // With a cap, labels and free space of a block change each other; the law of deadlines is for
  // each alone.
  const bool capped = scan_case.scarce() != Scarce::kTime && random.below(2) == 0;
  map.max_evidence = capped ? 3.0F : 0.0F;
  InferenceConfig& config = scan_case.inference;
  config.mode = static_cast<InferenceMode>(row[3]);
  config.free_space.enabled = row[4] != 0;
  config.free_space.neighbour_angle_rad = random.below(2) == 0 ? 0.0F : 0.015F;
  config.free_space.margin_voxels = random.below(2) == 0 ? 0.0F : 2.0F;
  config.entropy.block_edge = config.mode == InferenceMode::kLattice ? 2 : 1 << random.below(3);
  config.entropy.fill_one_label = random.below(2) == 0;
  config.kernel_length_m = static_cast<float>(2.7 * voxel_m);
  config.min_range_m = static_cast<float>(
      std::array{0.0, 0.5, 4.0}[static_cast<std::size_t>(random.below(3))] * voxel_m);
  const bool unlimited = !config.free_space.enabled && random.below(2) == 0;
  config.max_range_m = unlimited ? 0.0F : static_cast<float>(kRange_voxels * voxel_m);
  // What is sampled of a scan with too many returns is told by its points: not thinned.
  const int thinning = scan_case.scarce() == Scarce::kPoints ? 0 : random.below(3);
  config.thinning_m = std::array{0.0, 1.0, 2.5}[static_cast<std::size_t>(thinning)] * voxel_m;
  config.thinning_weight = static_cast<ThinningWeight>(random.below(2));
}

void draw_pose(ScanCase& scan_case, Random& random) {
  const auto place = static_cast<Place>(scan_case.row[8]);
  if (place == Place::kOrigin) return;
  const double voxel_m = scan_case.map.resolution_m;
  Matrix34d& T = scan_case.T_map_sensor;
  const auto offset = [&](double low, double high) {
    // Few digits: sums with coordinates on borders are exact.
    const double v = std::round(random.uniform(low, high) * 8.0) / 8.0;
    return random.below(2) == 0 ? v : -v;
  };
  if (place == Place::kAnyTurn || (place != Place::kQuarterTurn && random.below(2) == 0)) {
    Eigen::Vector3d axis;  // one draw a statement: compilers order arguments as they like
    for (int i = 0; i < 3; ++i) axis[i] = random.uniform(i == 2 ? 1.0 : -1.0, i == 2 ? 2.0 : 1.0);
    T.leftCols<3>() =
        Eigen::AngleAxisd(random.uniform(-3.0, 3.0), axis.normalized()).toRotationMatrix();
  } else if (random.below(2) == 0) {
    T.leftCols<3>() << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  }
  const double face_m = scan_case.grid_limit() * voxel_m;
  for (int i = 0; i < 3; ++i) {
    double& t = T(i, 3);
    const double to_face_m = random.uniform(0.5, 12.0) * voxel_m;
    const bool at_edge = random.below(2) == 0;
    t = offset(0.0, 100.0);
    if (place == Place::kAnyTurn) t = random.uniform(-50.0, 50.0);
    if (place == Place::kFar) t = offset(0.1 * face_m, 0.9 * face_m);
    if (place == Place::kUpperEdge && at_edge) t = face_m - to_face_m;
    if (place == Place::kLowerEdge && at_edge) t = -face_m + to_face_m;
  }
}

void draw_scarcity(ScanCase& scan_case, Random& random) {
  scan_case.capacity = {.points = 64, .tiles = 2048, .ray_blocks = 2048};
  const auto draw = [&](double low, double high) {
    return std::exp(random.uniform(std::log(low), std::log(high)));
  };
  switch (scan_case.scarce()) {
    case Scarce::kPoints:
      scan_case.capacity.points = static_cast<std::uint32_t>(draw(1, 65));
      break;
    case Scarce::kStorage:
      scan_case.map.storage_bytes = static_cast<std::size_t>(draw(4, 40)) * SlabPool::kPageBytes;
      break;
    case Scarce::kTiles:
      scan_case.capacity.tiles = static_cast<std::uint32_t>(draw(1, 120));
      break;
    case Scarce::kRayBlocks:
      scan_case.capacity.ray_blocks = static_cast<std::uint32_t>(draw(1, 200));
      break;
    case Scarce::kIndex:
      scan_case.map.storage_bytes = std::size_t{64 + 32U * static_cast<unsigned>(random.below(4))}
                                    << 10U;
      scan_case.fill_index = true;
      break;
    case Scarce::kWork:
      scan_case.inference.work_budget = static_cast<std::uint64_t>(draw(1, 20000));
      break;
    case Scarce::kTime:
      scan_case.due_us = static_cast<std::int64_t>(draw(1, 60));
      scan_case.rate =
          std::array{1e12, 24000.0, 2000.0, 200.0}[static_cast<std::size_t>(random.below(4))];
      break;
    default:
      break;
  }
}

}  // namespace

std::vector<Row> covering_rows() {
  Random random(1900);
  OpenPairs open;
  std::vector<Row> rows;
  while (!open.empty()) {
    Row row;
    row.fill(-1);
    const auto [f, g, a, b] = open.first();
    row[static_cast<std::size_t>(f)] = a;
    row[static_cast<std::size_t>(g)] = b;
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (row[i] < 0) row[i] = best_level(open, row, i, random);
    }
    open.close(row);
    rows.push_back(row);
  }
  return rows;
}

double ScanCase::grid_limit() const {
  // A tile of units of one voxel is half a block, and there are as many tiles as blocks.
  const bool half =
      inference.mode == InferenceMode::kMultiEntropy && inference.entropy.block_edge == 1;
  return static_cast<double>(kVoxelLimit) * (half ? 0.5 : 1.0);
}

ScanCase make_case(const Row& row, std::uint64_t seed) {
  Random random(seed);
  ScanCase scan_case;
  scan_case.seed = seed;
  scan_case.row = row;
  draw_config(scan_case, random);
  draw_pose(scan_case, random);
  draw_scarcity(scan_case, random);
  if (random.below(2) == 0)
    scan_case.before = plain_returns(scan_case, 1 + random.below(16), random);
  scan_case.returns = plain_returns(scan_case, count_of(static_cast<Size>(row[9]), random), random);
  std::vector<Return>& returns = scan_case.returns;
  const auto part = static_cast<Part>(row[1]);
  const auto position = static_cast<Position>(row[2]);
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const bool chosen = position == Position::kEvery || (position == Position::kFirst && i == 0) ||
                        (position == Position::kMiddle && i == returns.size() / 2) ||
                        (position == Position::kLast && i + 1 == returns.size());
    if (chosen) make_special(scan_case, part, returns[i], random);
  }
  return scan_case;
}

std::string text_of(const ScanCase& scan_case) {
  std::ostringstream out;
  const InferenceConfig& c = scan_case.inference;
  out << "case seed " << scan_case.seed << ", levels";
  for (const int level : scan_case.row) out << ' ' << level;
  out << "\nmap: resolution_m " << scan_case.map.resolution_m << " tuple "
      << static_cast<int>(scan_case.map.tuple) << " max_evidence " << scan_case.map.max_evidence
      << " storage_bytes " << scan_case.map.storage_bytes
      << (scan_case.fill_index ? " index full" : "") << "\nintegrator: " << to_string(c.mode)
      << " free " << c.free_space.enabled << " angle " << c.free_space.neighbour_angle_rad
      << " margin " << c.free_space.margin_voxels << " block_edge " << c.entropy.block_edge
      << " fill_one_label " << c.entropy.fill_one_label << " kernel_length_m " << c.kernel_length_m
      << " range_m " << c.min_range_m << " to " << c.max_range_m << " thinning_m " << c.thinning_m
      << " thinning_weight " << static_cast<int>(c.thinning_weight) << " work_budget "
      << c.work_budget << "\ncapacity: points " << scan_case.capacity.points << " tiles "
      << scan_case.capacity.tiles << " ray_blocks " << scan_case.capacity.ray_blocks << "\ndue_us "
      << scan_case.due_us << " rate " << scan_case.rate << std::hexfloat << "\nT_map_sensor\n"
      << scan_case.T_map_sensor << '\n';
  const auto list = [&](const char* name, const std::vector<Return>& returns) {
    out << name << ": x y z component weight\n";
    for (const Return& r : returns) {
      for (const float v : r.p_sensor)
        out << "  " << v << " (" << std::bit_cast<std::uint32_t>(v) << ")";
      out << "  " << std::dec << static_cast<int>(r.component) << "  " << r.weight << '\n';
    }
  };
  list("before", scan_case.before);
  list("returns", scan_case.returns);
  return out.str();
}

Cloud cloud_of(const std::vector<Return>& returns) {
  Cloud cloud;
  for (const Return& r : returns) {
    // Not by way of double: a NaN must keep its sign and payload.
    cloud.xyz.insert(cloud.xyz.end(), r.p_sensor.begin(), r.p_sensor.end());
    cloud.components.push_back(r.component);
    cloud.weights.push_back(r.weight);
  }
  return cloud;
}

}  // namespace tessera::oracle
