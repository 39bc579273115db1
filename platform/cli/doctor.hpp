// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The checks of `tessera doctor`: each reports what it found, what a node needs, and how to fix the
// difference.
#pragma once

#include <string>
#include <vector>

#include "link/udpm_url.hpp"
#include "node/node_config.hpp"

namespace tessera {

enum class CheckState {
  kGood,
  kAdvice,  ///< A node starts, but with a disadvantage.
  kStops,   ///< A node would not start, or would receive nothing.
};

struct Check {
  const char* name;
  CheckState state;
  std::string found;
  std::string needed;
  std::string mend;  ///< Empty iff state is kGood.
};

struct DoctorOptions {
  std::string url = kDefaultUrl;
  std::string interface;  ///< Empty: as the routes choose.
  std::string key;        ///< Empty: none.
  std::string config;     ///< Of the node on that network; empty: none.
  std::string report;
};

/// Checks URL, interface, route, MTU, receive buffer, and datagrams that this machine sends to
/// itself. Sends a few with ttl 0, so none leaves the machine; takes a second at most.
std::vector<Check> check_network(const DoctorOptions& options);
/// Checks clocks, key file and rights of a real-time process.
std::vector<Check> check_machine(const DoctorOptions& options);
/// Compares the statuses of the robots on the network of that configuration with its exclude list,
/// and finds robot numbers that two processes use. Listens for two seconds; sends nothing.
std::vector<Check> check_fleet(const NodeConfig& config);

}  // namespace tessera
