// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A mapper and its memory, made from the settings of a map.
#pragma once

#include <utility>

#include "base/arena_memory.hpp"
#include "settings/map_options.hpp"
#include "tessera/robot/mapper.hpp"

namespace tessera {

class HeldMapper {
 public:
  HeldMapper(ArenaMemory memory, Mapper& mapper) : memory_(std::move(memory)), mapper_(&mapper) {}
  [[nodiscard]] Mapper& operator*() const { return *mapper_; }
  [[nodiscard]] Mapper* operator->() const { return mapper_; }

 private:
  ArenaMemory memory_;
  Mapper* mapper_;
};

/// With the deadline, the window, the submaps and the kernels of setup. capacity: as split_budget
/// gave it. Fails with kUsage iff a setting is out of its range or no kernel is of a class;
/// kFailure iff the system does not give the memory.
Outcome<HeldMapper> make_mapper(const MapSetup& setup, const ScanCapacity& capacity,
                                const ClassTable& classes);

}  // namespace tessera
