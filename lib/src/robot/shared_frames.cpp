// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/shared_frames.hpp"

#include "tessera/base/internal/put_in_place.hpp"

namespace tessera {

Result<SharedFrames*> SharedFrames::make(Arena& arena, const FramesConfig& config,
                                         const Point3d& origin_world, Exchange& exchange,
                                         GlobalMap& global, const ClassTable& classes) noexcept {
  if (!is_valid(config)) return Status::kInvalidArgument;
  if (config.mode == FrameMode::kGiven) return Result<SharedFrames*>(nullptr);
  const std::span<SharedFrames> place = arena.take<SharedFrames>(1);
  if (place.empty()) return Status::kResourceExhausted;
  SharedFrames& shared = place.front();
  shared.config_ = config;
  shared.origin_world_ = origin_world;
  shared.exchange_ = &exchange;
  shared.global_ = &global;
  Status status = shared.links_.set_up(arena, config, global.config(), classes);
  if (status == Status::kOk)
    status = put_in_place(shared.placement_, [&] { return TeamPlacement::make(arena, config); });
  if (status != Status::kOk) return status;
  return &shared;
}

bool SharedFrames::is_joined() const noexcept {
  const std::optional<ContributionId> own = exchange_->publishing();
  for (const PlacedRobot& one : robots()) {
    if (own && one.robot == own->robot)
      return one.follower.in_use() &&
             (config_.mode == FrameMode::kRefined || one.frame.state == FrameState::kLinked ||
              one.frame.state == FrameState::kOnlyByOne);
  }
  return false;
}

/// Once in each epoch: what is known of the frame in which it is published.
void SharedFrames::state_prior(Instant now) noexcept {
  const std::optional<ContributionId> own = exchange_->publishing();
  if (!own || stated_epoch_ == own->epoch || now < prior_due_) return;
  StatedPrior prior{.robot = own->robot, .epoch = own->epoch};
  if (config_.mode == FrameMode::kRefined) {
    prior.kind = config_.sigma_m > 0.0 ? PriorKind::kVague : PriorKind::kExact;
    // The error is about the origin of the robot's map, which is where it was placed.
    prior.covariance =
        FrameCovariance::isotropic(origin_world_, config_.sigma_m, config_.sigma_rad);
  }
  const Result<std::uint32_t> stated = exchange_->state(prior);
  if (stated.ok())
    stated_epoch_ = own->epoch;
  else
    prior_due_ = now + LinkMaker::kRetry;
}

void SharedFrames::tick(const Point3d& p_world, Instant now) noexcept {
  state_prior(now);
  placement_.tick(*exchange_, *global_, p_world, now);
  links_.tick(*exchange_, *global_, placement_, now);
  static_cast<void>(step(now));
}

}  // namespace tessera
