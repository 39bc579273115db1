// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The arguments for making a map: those of "map", with the same defaults.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "held_map.hpp"

namespace tessera::python {

/// Arguments that are fixed for the life of a map.
struct FixedArguments {
  std::optional<double> resolution_m;
  std::optional<double> prior;
  std::optional<double> max_evidence;
  std::optional<double> free_weight;
  std::optional<std::string> counts;
  std::uint32_t robot = 0;
};

/// Arguments of inference and memory.
struct InferenceArguments {
  std::size_t memory_bytes;
  std::string inference;
  std::optional<double> kernel_length_m;
  double max_range_m;
  double min_range_m;
  std::optional<double> downsample_m;
  std::optional<std::string> thinning_weight;
  bool free_space;
  double min_weight;
  std::uint64_t work_budget;
  double deadline_ms;
  std::optional<double> window_m;
  std::optional<std::filesystem::path> archive;
};

[[nodiscard]] MapOptions options_of(const FixedArguments& fixed, const InferenceArguments& how);

}  // namespace tessera::python
