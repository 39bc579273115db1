// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/query_port.hpp"

#include <utility>

#include "base/monotonic_clock.hpp"

namespace tessera {

Outcome<std::unique_ptr<QueryPort>> QueryPort::open(const QueryPortConfig& config,
                                                    const ServedMaps& maps) {
  constexpr std::size_t kQueue = 256;
  const LinkConfig link_config{.url = config.url,
                               .channel = kQueryChannel,
                               .interface = config.interface,
                               .queue_slots = kQueue,
                               .thread = config.thread};
  TESSERA_TRY_ASSIGN(std::unique_ptr<DatagramLink> link, DatagramLink::open(link_config));
  return std::unique_ptr<QueryPort>(new QueryPort(std::move(link), maps, config.limits));
}

int QueryPort::serve(std::int64_t timeout_us, int max_queries) noexcept {
  int served = 0;
  if (link_->wait(timeout_us)) {
    for (; served < max_queries; ++served) {
      const DatagramLink::Received message = link_->receive(buffer_);
      if (message.bytes.empty()) break;
      MapQuery query;
      if (!decode_query(message.bytes, query)) {
        ++report_.malformed;
        continue;
      }
      const auto reply = encode_reply(service_.answer(query, MonotonicClock::now_us()));
      if (!link_->send_on(kReplyChannel, reply)) ++report_.not_sent;
    }
  }
  report_.queries = service_.report();
  report_.queue_full = link_->report().queue_full;
  shared_report_.store(report_);
  if (served != 0) asked_.set(service_.asked());
  return served;
}

}  // namespace tessera
