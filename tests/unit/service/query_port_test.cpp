// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Queries over a real network: the example planner, a program of its own with liblcm, asks a port.
#include "node/query_port.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <tessera_query.hpp>

#include "base/allocation_counter.hpp"
#include "support/sample_map.hpp"
#include "unit/lcm/child.hpp"
#include "unit/lcm/own_network.hpp"

namespace tessera {
namespace {

std::unique_ptr<QueryPort> open_port(const LocalMap& map) {
  Outcome<std::unique_ptr<QueryPort>> port = QueryPort::open({}, {.local = MapReader(map)});
  INFO(port.failure().text());
  REQUIRE(port.ok());
  return std::move(*port);
}

/// Sends what it is given on the channel of queries.
std::unique_ptr<DatagramLink> open_asker() {
  Outcome<std::unique_ptr<DatagramLink>> link = DatagramLink::open(
      {.url = kDefaultQueryUrl, .channel = kReplyChannel, .interface = "lo", .queue_slots = 64});
  REQUIRE(link.ok());
  return std::move(*link);
}

std::vector<std::byte> query_bytes() {
  tessera_query query{};
  query.version = 1;
  query.kind = tessera_query::NEAREST;
  query.length_m = 1.0;
  std::vector<std::byte> bytes(static_cast<std::size_t>(query.getEncodedSize()));
  query.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

TEST_CASE("QueryPort: the example planner asks everything and gets the map's answers") {
  if (!enter_own_network()) return;
  SmallMap sample(config_of_pages(64), kSampleClasses);
  observe(sample.map, {{{10, 0, 0}, 2, 1.0F}, {{0, 0, 0}, 0}, {{1, 0, 0}, 0}});
  const auto port = open_port(sample.map);
  const std::filesystem::path out =
      std::filesystem::temp_directory_path() / ("tessera-planner-" + std::to_string(::getpid()));
  const std::string command = std::string("exec ") + TESSERA_PLANNER + " '" + kDefaultQueryUrl +
                              "' 0.05 0.05 0.05 >" + out.string() + " 2>&1";
  Child planner({"sh", "-c", command});
  CHECK(eventually([&] {
    static_cast<void>(port->serve(0));
    return !planner.is_running();
  }));
  std::ifstream file(out);
  const std::string said(std::istreambuf_iterator<char>(file), {});
  std::filesystem::remove(out);
  INFO(said);
  CHECK(said.find("here       free, label 0\n") != std::string::npos);
  CHECK(said.find("nearest    label 2, 0.95 m away\n") != std::string::npos);
  CHECK(said.find("ahead      not known beyond 0.15 m\n") != std::string::npos);
  CHECK(said.find("around     11 x 11 cells of 0.40 m\n") != std::string::npos);
  CHECK(said.find('#') != std::string::npos);
  CHECK(port->report().queries.errors[0] >= 4);
  CHECK(port->report().malformed == 0);
}

TEST_CASE("QueryPort: what is no query is counted and not answered") {
  if (!enter_own_network()) return;
  const SmallMap sample = sample_map(1);
  const auto port = open_port(sample.map);
  const auto asker = open_asker();
  const std::vector<std::byte> good = query_bytes();
  std::vector<std::byte> other_type = good;
  other_type[0] ^= std::byte{1};
  for (const std::span<const std::byte> bytes :
       {std::span(good).first(100), std::span<const std::byte>(other_type),
        std::span(good).first(1)})
    REQUIRE(asker->send_on(kQueryChannel, bytes));
  REQUIRE(asker->send_on(kQueryChannel, good));
  REQUIRE(eventually([&] {
    static_cast<void>(port->serve(0));
    return asker->report().received == 1;
  }));
  CHECK(port->report().malformed == 3);
  CHECK(port->report().queries.errors[0] == 1);
  CHECK(asker->report().received_bytes == kReplyBytes);
}

TEST_CASE("QueryPort: answers without the heap") {
  if (!enter_own_network()) return;
  const SmallMap sample = sample_map(1);
  const auto port = open_port(sample.map);
  const auto asker = open_asker();
  const std::vector<std::byte> query = query_bytes();
  const auto before = heap_allocations();
  int served = 0;
  for (int i = 0; i < 30; ++i) {
    asker->send_on(kQueryChannel, query);
    served += port->serve(200'000);
  }
  const auto after = heap_allocations();
  CHECK(served == 30);
  if (!before) {
    WARN("this build cannot count heap allocations");
    return;
  }
  CHECK(*after - *before == 0);
}

}  // namespace
}  // namespace tessera
