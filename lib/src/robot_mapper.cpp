// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "put_in_place.hpp"
#include "tessera/robot/mapper.hpp"

namespace tessera {

Result<Mapper*> Mapper::make(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                             const Clock& clock) noexcept {
  if (!arena.aligned()) return Status::kResourceExhausted;
  const std::span<Mapper> place = arena.take<Mapper>(1);
  if (place.empty()) return Status::kResourceExhausted;
  Mapper& mapper = place.front();
  Status status =
      put_in_place(mapper.map_, [&] { return LocalMap::make(arena, config.map, classes); });
  if (status == Status::kOk) {
    status = put_in_place(mapper.integrator_,
                          [&] { return Integrator::make(arena, config.inference, config.scan); });
  }
  if (status != Status::kOk) return status;
  mapper.deadline_ = Deadline(clock);
  mapper.deadline_us_ = config.deadline_us;
  mapper.scratch_bytes_ = Integrator::required_bytes(config.scan, config.inference);
  return &mapper;
}

ScanReport Mapper::integrate(const ScanView& scan, std::int64_t now_us) noexcept {
  if (deadline_us_ == 0) return integrator_.integrate(map_, scan);
  return integrator_.integrate(map_, scan, deadline_, now_us + deadline_us_);
}

}  // namespace tessera
