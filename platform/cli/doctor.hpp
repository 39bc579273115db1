// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What `tessera doctor` looks at: each check says what it found, what a node needs, and how to mend
// the difference.
#pragma once

#include <string>
#include <vector>

#include "lcm/udpm_url.hpp"
#include "node/node_config.hpp"

namespace tessera {

enum class CheckState {
  kGood,
  kAdvice,  ///< A node starts, and is worse off.
  kStops,   ///< A node would not start, or hear nobody.
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
  std::string interface;  ///< Empty: what the routes choose.
  std::string key;        ///< Empty: none.
  std::string config;     ///< Of the node whose network it is; empty: none.
  std::string report;
};

/// URL, interface, route, MTU, receive buffer, and datagrams that this machine sends to itself.
/// Sends a few with ttl 0, so none leaves the machine; takes a second at most.
std::vector<Check> check_network(const DoctorOptions& options);
/// Clocks, key file, rights of a real-time process.
std::vector<Check> check_machine(const DoctorOptions& options);
/// What the statuses of robots on the network of that configuration say of its exclude list and of
/// numbers that two processes use. Listens for two seconds; sends nothing.
std::vector<Check> check_fleet(const NodeConfig& config);

}  // namespace tessera
