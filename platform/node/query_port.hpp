// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Receives queries from the LCM network of this machine and sends the replies.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "base/latest_value.hpp"
#include "base/outcome.hpp"
#include "base/shared_report.hpp"
#include "link/datagram_link.hpp"
#include "node/query_service.hpp"
#include "tessera/base/counters.hpp"

namespace tessera {

inline constexpr const char* kDefaultQueryUrl =
    "udpm://239.255.76.69:7669?ttl=0&recv_buf_size=1048576";

struct QueryPortConfig {
  std::string url = kDefaultQueryUrl;
  std::string interface = "lo";  ///< A name or an IPv4 address; empty: as the routes choose.
  QueryLimits limits{};
  ThreadRole thread{.name = "tessera-ask"};  ///< Of the receiving thread.
};

#define TESSERA_QUERY_PORT_COUNTERS(ROW)                                                 \
  ROW(COUNTER, uint64_t, malformed, "Messages that are no tessera_query: not answered.") \
  ROW(COUNTER, uint64_t, queue_full, "Requests lost: more than 256 waited.")             \
  ROW(COUNTER, uint64_t, not_sent, "Replies that the system refused to send.")

struct QueryPortReport {
  TESSERA_QUERY_PORT_COUNTERS(TESSERA_COUNTER_MEMBER)
  QueryReport queries{};
};
TESSERA_COUNTER_TABLE(QueryPortReport, TESSERA_QUERY_PORT_COUNTERS(TESSERA_COUNTER_ROW))

class QueryPort {
 public:
  /// Fails as DatagramLink::open. The only use of the heap; the link starts a thread.
  static Outcome<std::unique_ptr<QueryPort>> open(const QueryPortConfig& config,
                                                  const ServedMaps& maps);

  /// Waits for a query, at most timeout_us, then answers up to max_queries. Returns the number
  /// answered. For one thread.
  int serve(std::int64_t timeout_us, int max_queries = 32) noexcept;

  /// For any thread.
  [[nodiscard]] QueryPortReport report() const noexcept { return shared_report_.load(); }
  [[nodiscard]] const LatestValue<AskedPlaces>& asked() const noexcept { return asked_; }

 private:
  QueryPort(std::unique_ptr<DatagramLink> link, const ServedMaps& maps, const QueryLimits& limits)
      : link_(std::move(link)), service_(maps, limits) {}

  std::unique_ptr<DatagramLink> link_;
  QueryService service_;
  std::array<std::byte, kMaxMessageBytes> buffer_{};
  QueryPortReport report_{};
  SharedReport<QueryPortReport> shared_report_;
  LatestValue<AskedPlaces> asked_;
};

}  // namespace tessera
