// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "soak/drive.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace tessera::soak {

namespace {

constexpr double kHeight_m = 1.6;
constexpr double kQuarter_rad = 0.5 * std::numbers::pi;
constexpr double kWrongLabels = 0.05;
// Drift of odometry.
constexpr double kScaleSigma = 0.005;
constexpr double kBiasSigma_radpm = 1e-4;
constexpr double kStepSigma_m = 0.004;
constexpr double kStepSigma_rad = 5e-4;
constexpr double kHeightSigma_m = 0.002;

constexpr std::array<std::pair<int, int>, 4> kWays{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};

}  // namespace

Matrix34d matrix_of(const FlatPose& pose) {
  Matrix34d T = Matrix34d::Identity();
  T(0, 0) = T(1, 1) = std::cos(pose.yaw);
  T(1, 0) = std::sin(pose.yaw);
  T(0, 1) = -T(1, 0);
  T.col(3) << pose.x, pose.y, pose.z;
  return T;
}

FlatPose product(const FlatPose& T_a_b, const FlatPose& T_b_c) {
  const double c = std::cos(T_a_b.yaw);
  const double s = std::sin(T_a_b.yaw);
  return {T_a_b.x + c * T_b_c.x - s * T_b_c.y, T_a_b.y + s * T_b_c.x + c * T_b_c.y,
          T_a_b.z + T_b_c.z, T_a_b.yaw + T_b_c.yaw};
}

FlatPose inverse(const FlatPose& T_a_b) {
  const double c = std::cos(T_a_b.yaw);
  const double s = std::sin(T_a_b.yaw);
  return {-c * T_a_b.x - s * T_a_b.y, s * T_a_b.x - c * T_a_b.y, -T_a_b.z, -T_a_b.yaw};
}

Json json_of(const FlatPose& pose) { return Json::array({pose.x, pose.y, pose.z, pose.yaw}); }

FlatPose pose_in(const Json& json) { return {json.at(0), json.at(1), json.at(2), json.at(3)}; }

Drive::Drive(const street::StreetGrid& grid, std::uint64_t seed, int robot)
    : grid_(grid), seed_(street::hash_of(seed, street::Stream::kDrive, robot)) {
  // They begin on streets that meet, so that their maps overlap.
  x_ = grid.config().blocks / 2 + robot % 2;
  y_ = grid.config().blocks / 2 + robot / 2;
  heading_ = robot % 4;
  const Eigen::Vector2d place = grid.crossing(x_, y_);
  truth_ = {place.x(), place.y(), kHeight_m, heading_ * kQuarter_rad};
  choose_turn();
  begin_map();
}

street::Random Drive::random(std::uint64_t purpose) {
  return street::Random(street::hash_of(seed_, street::Stream::kPoseError, purpose, steps_));
}

void Drive::begin_map() {
  ++maps_;
  street::Random draw = random(maps_);
  scale_ = 1.0 + kScaleSigma * draw.gaussian();
  bias_radpm_ = kBiasSigma_radpm * draw.gaussian();
  odometry_ = truth_;
  met_.clear();
}

/// Right four times out of five, else ahead or left, as far as there is a street.
void Drive::choose_turn() {
  street::Random draw = random(0);
  const double what = draw.uniform();
  const int first = what < 0.8 ? 3 : what < 0.9 ? 0 : 1;
  for (const int turn : {first, 0, 3, 1, 2}) {
    const int heading = (heading_ + turn) % 4;
    const auto [dx, dy] = kWays[static_cast<std::size_t>(heading)];
    const int most = grid_.config().blocks;
    if (x_ + dx < 0 || y_ + dy < 0 || x_ + dx > most || y_ + dy > most) continue;
    heading_ = heading;
    turn_rad_ = (turn == 3 ? -1 : turn) * kQuarter_rad;
    return;
  }
}

void Drive::note_motion(const FlatPose& before, double driven_m) {
  street::Random draw = random(1);
  FlatPose moved = soak::product(soak::inverse(before), truth_);
  const double share = driven_m / (kSpeed_mps * 0.5);
  moved.x = moved.x * scale_ + kStepSigma_m * share * draw.gaussian();
  moved.y += kStepSigma_m * share * draw.gaussian();
  moved.z += kHeightSigma_m * share * draw.gaussian();
  moved.yaw += bias_radpm_ * driven_m + kStepSigma_rad * draw.gaussian();
  odometry_ = soak::product(odometry_, moved);
}

bool Drive::step(double seconds) {
  const FlatPose before = truth_;
  ++steps_;
  if (turn_rad_ != 0.0) {
    const double most = kTurn_radps * seconds;
    const double turn = std::clamp(turn_rad_, -most, most);
    truth_.yaw += turn;
    turn_rad_ = std::abs(turn_rad_ - turn) < 1e-9 ? 0.0 : turn_rad_ - turn;
    note_motion(before, 0.0);
    return false;
  }
  const double pitch_m = grid_.config().pitch_m;
  const double driven_m = std::min(kSpeed_mps * seconds, pitch_m - along_m_);
  const auto [dx, dy] = kWays[static_cast<std::size_t>(heading_)];
  along_m_ += driven_m;
  way_m_ += driven_m;
  const Eigen::Vector2d behind = grid_.crossing(x_, y_);
  truth_.x = behind.x() + along_m_ * dx;
  truth_.y = behind.y() + along_m_ * dy;
  note_motion(before, driven_m);
  if (along_m_ < pitch_m) return false;
  x_ += dx;
  y_ += dy;
  along_m_ = 0.0;
  choose_turn();
  const int crossing = y_ * (grid_.config().blocks + 1) + x_;
  const auto met = met_.find(crossing);
  const bool closes = met != met_.end() && way_m_ - met->second >= kLoop_m;
  met_[crossing] = way_m_;
  return closes;
}

Json Drive::state() const {
  Json met = Json::array();
  for (const auto& [crossing, way_m] : met_) met.push_back({crossing, way_m});
  return {{"x", x_},
          {"y", y_},
          {"heading", heading_},
          {"along_m", along_m_},
          {"turn_rad", turn_rad_},
          {"truth", json_of(truth_)},
          {"odometry", json_of(odometry_)},
          {"way_m", way_m_},
          {"steps", steps_},
          {"maps", maps_},
          {"scale", scale_},
          {"bias_radpm", bias_radpm_},
          {"met", met}};
}

void Drive::restore(const Json& state) {
  x_ = state.at("x");
  y_ = state.at("y");
  heading_ = state.at("heading");
  along_m_ = state.at("along_m");
  turn_rad_ = state.at("turn_rad");
  truth_ = pose_in(state.at("truth"));
  odometry_ = pose_in(state.at("odometry"));
  way_m_ = state.at("way_m");
  steps_ = state.at("steps");
  maps_ = state.at("maps");
  scale_ = state.at("scale");
  bias_radpm_ = state.at("bias_radpm");
  met_.clear();
  for (const Json& met : state.at("met")) met_[met.at(0)] = met.at(1);
}

Scanner::Scanner(const street::StreetGrid& grid, std::uint64_t seed)
    : grid_(grid), seed_(seed), classes_(DatasetClasses::semantic_kitti()) {
  for (int beam = 0; beam < kBeams; ++beam)
    model_.elevations_rad.push_back((15.0 - 2.0 * beam) * kQuarter_rad / 90.0);
  model_.azimuth_steps = kDirections;
  model_.max_range_m = kRange_m + 10.0;
  model_.range_sigma_m = 0.02;
  model_.height_m = kHeight_m;
}

ScanView Scanner::scan(const FlatPose& T_world_sensor, std::uint64_t noise) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.matrix().topRows<3>() = matrix_of(T_world_sensor);
  const street::EchoImage image = street::sweep(
      model_, pose, [this](const street::Ray& ray, street::Hit& hit) { grid_.meet(ray, hit); },
      street::hash_of(seed_, street::Stream::kBeam, noise));
  points_.clear();
  components_.clear();
  street::Random draw(street::hash_of(seed_, street::Stream::kMistake, noise));
  const int classes = classes_.table().num_components() - 2;
  for (const street::Echo& echo : image.echoes) {
    if (!echo.returned()) continue;
    const Eigen::Vector3f p = round_to_float(Eigen::Vector3d(echo.p_sensor));
    points_.insert(points_.end(), {p.x(), p.y(), p.z()});
    const bool is_wrong = draw.chance(kWrongLabels);
    const int other = 1 + draw.below(classes);
    components_.push_back(is_wrong ? static_cast<std::uint8_t>(other)
                                   : classes_.component(static_cast<std::uint16_t>(echo.id)));
  }
  ScanView view;
  view.points = points_.data();
  view.stride_floats = 3;
  view.count = components_.size();
  view.components = components_.data();
  return view;
}

}  // namespace tessera::soak
