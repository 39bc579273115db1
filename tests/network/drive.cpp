// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "network/drive.hpp"

#include <stdexcept>

namespace tessera::network {

namespace {

MapConfig map_config() {
  MapConfig config;
  config.tuple = TuplePolicy::kCompact;
  config.storage_bytes = std::size_t{512} << 20U;
  return config;
}

RobotConfig config_of(const Dataset& dataset) {
  RobotConfig config;
  config.map = map_config();
  config.scan = {.points = static_cast<std::uint32_t>(dataset.max_points()),
                 .tiles = 131072,
                 .ray_blocks = 131072};
  return config;
}

template <class T>
T made(Result<T> result) {
  if (!result.ok()) throw std::runtime_error(to_string(result.status()));
  return std::move(*result);
}

ScanReader reader_of(const Dataset& dataset) {
  Outcome<ScanReader> reader = ScanReader::make(dataset);
  if (!reader.ok()) throw std::runtime_error(reader.failure().text());
  return std::move(*reader);
}

}  // namespace

Drive::Drive(const Dataset& dataset, std::size_t first, std::size_t count)
    : next_(first),
      end_(first + count),
      reader_(reader_of(dataset)),
      memory_(Mapper::required_bytes(config_of(dataset)) +
              Publisher::required_bytes({}, dataset.classes().table().num_components())) {
  Arena arena(memory_.span());
  const ClassTable& classes = dataset.classes().table();
  mapper_ = made(Mapper::make(arena, config_of(dataset), classes, {}));
  publisher_ = made(Publisher::make(arena, {}, map_config(), classes.num_components()));
}

void Drive::integrate_next() {
  const Outcome<ScanView> scan = reader_.read(next_++);
  if (!scan.ok()) throw std::runtime_error(scan.failure().text());
  const Point3f at = scan->T_map_sensor.col(3).cast<float>();
  publisher_.set_focus(block_of(*mapper_->map().lattice().voxel_of(at)));
  if (mapper_->integrate(*scan, 0).left_out() > 0) throw std::runtime_error("a scan did not fit");
}

void Drive::tick(std::int64_t now_us, Exchange& exchange) {
  static_cast<void>(publisher_.tick(mapper_->map(), now_us, {}, publication_of(exchange)));
}

}  // namespace tessera::network
