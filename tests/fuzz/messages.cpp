// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <string>

#include "fuzz/fuzz.hpp"
#include "link/sender_table.hpp"
#include "link/short_message.hpp"
#include "link/udpm_url.hpp"

namespace tessera::fuzz {

namespace {

void message(Bytes datagram) {
  const ReceivedMessage read = read_message(datagram);
  if (read.kind != MessageKind::kShort) {
    require(read.channel.empty() && read.payload.empty(), "something of no message");
    return;
  }
  require(!read.channel.empty() && read.channel.size() <= kMaxChannelBytes, "a channel's length");
  require(read.channel.find('\0') == std::string_view::npos, "a channel with a zero");
  require(read.channel.size() + 1 + read.payload.size() <= kMaxMessageBytes, "too long");
  ShortHeader header{};
  const std::size_t size = write_header(header, read.sequence, read.channel);
  require(size + read.payload.size() == datagram.size(), "of another length");
  require(std::equal(header.begin(), header.begin() + static_cast<std::ptrdiff_t>(size),
                     datagram.begin()),
          "written otherwise");
  require(read.payload.data() == datagram.data() + size, "another payload");
}

void url(Bytes bytes) {
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const Outcome<UdpmUrl> parsed = UdpmUrl::parse(text);
  if (!parsed.ok()) {
    require(!parsed.failure().text().empty(), "an error without a word");
    require(parsed.failure().text().find('\n') == std::string::npos, "an error of several lines");
    return;
  }
  require(parsed->group >> 28U == 14U && parsed->port != 0, "no group");
  require(parsed->ttl >= 0 && parsed->ttl <= 255, "ttl");
  require(parsed->receive_buffer_bytes >= static_cast<int>(kMaxUdpPayloadBytes), "buffer");
  const std::string full = "udpm://" + address_text(parsed->group) + ":" +
                           std::to_string(parsed->port) + "?ttl=" + std::to_string(parsed->ttl) +
                           "&recv_buf_size=" + std::to_string(parsed->receive_buffer_bytes);
  const Outcome<UdpmUrl> again = UdpmUrl::parse(full);
  require(again.ok(), "written in full it is refused");
  require(again->group == parsed->group && again->port == parsed->port &&
              again->ttl == parsed->ttl &&
              again->receive_buffer_bytes == parsed->receive_buffer_bytes,
          "written in full it says something else");
}

/// Senders beyond those that are remembered are strangers again.
void senders(Input input) {
  SenderTable table;
  std::map<std::uint32_t, std::uint32_t> highest;
  while (!input.empty()) {
    const Endpoint sender{input.u8(), 7667};
    const std::uint32_t sequence = input.u32();
    const std::uint32_t missing = table.missing_before(sender, sequence);
    require(missing < 1U << 20U, "a leap that is counted");
    const auto known = highest.find(sender.address);
    if (known == highest.end()) {
      require(missing == 0, "a stranger has lost something");
      highest[sender.address] = sequence;
      continue;
    }
    const bool remembered = highest.size() <= SenderTable::kSenders;
    require(missing == 0 || !remembered || missing == sequence - known->second - 1,
            "lost what was not sent");
    const auto step = static_cast<std::int32_t>(sequence - known->second);
    if (step > 0 || step <= -(1 << 20)) known->second = sequence;
  }
}

}  // namespace

void messages(Bytes bytes) {
  Input input(bytes);
  switch (input.below(3)) {
    case 0:
      return message(input.rest());
    case 1:
      return url(input.rest());
    default:
      return senders(input);
  }
}

}  // namespace tessera::fuzz
