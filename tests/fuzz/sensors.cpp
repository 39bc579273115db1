// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include "fuzz/fuzz.hpp"
#include "link/fragment_assembler.hpp"
#include "link/query_messages.hpp"
#include "link/sensor_messages.hpp"
#include "link/sensor_sender.hpp"

namespace tessera::fuzz {
namespace {

constexpr std::size_t kRoom = 64;

/// Fragments of three senders, in any order.
void fragments(Input input) {
  constexpr std::size_t kMostBytes = 300;
  FragmentAssembler assembler(
      {.slots = 3, .max_message_bytes = kMostBytes, .max_fragments = 20, .timeout_us = 100});
  std::uint64_t fragments = 0;
  std::uint64_t messages = 0;
  std::int64_t now_us = 0;
  while (!input.empty()) {
    const Endpoint sender{1, static_cast<std::uint16_t>(input.below(3))};
    now_us += input.u8();
    const Bytes datagram = input.bytes(input.u8());
    const FragmentAssembler::Message message = assembler.take(sender, datagram, now_us);
    ++fragments;
    if (message.channel.empty()) continue;
    ++messages;
    require(message.payload.size() <= kMostBytes, "a message over the limit");
    require(message.channel.size() <= kMaxChannelBytes, "a channel's length");
  }
  const AssemblerReport& r = assembler.report();
  require(r.taken + r.malformed + r.too_large + r.inconsistent + r.duplicates == fragments,
          "a fragment that is not counted, or twice");
  require(r.messages == messages, "a message that is not counted");
}

/// A cloud that is taken says the same when it is written again.
void cloud(Bytes bytes, bool semantic) {
  std::vector<float> xyz(3 * kRoom);
  std::vector<float> weights(kRoom);
  std::vector<float> times_s(kRoom);
  std::vector<std::uint8_t> components(3 * kRoom);
  std::vector<std::uint8_t> label_weights(3 * kRoom);
  std::vector<std::uint8_t> no_return(kRoom);
  CloudHeader header;
  const CloudMemory memory{xyz, components, weights, times_s, no_return, label_weights};
  const MessageFault fault =
      semantic ? decode_semantic_cloud(bytes, memory, header) : decode_cloud(bytes, memory, header);
  if (fault != MessageFault::kNone) return;
  require(header.count <= kRoom, "more points than there is room for");
  require(header.first_us >= -kMostSweep_us && header.last_us <= kMostSweep_us, "a point's time");
  require(header.has_components == semantic, "components of what has none");
  require(header.labels_per_point >= 1 && header.labels_per_point <= 3, "labels of a point");
  const std::size_t labels = std::size_t{header.labels_per_point} * header.count;
  if (header.has_times || header.count == 0) return;
  const CloudToSend again{
      .stamp_us = header.stamp_us,
      .sensor = header.sensor,
      .xyz = std::span(xyz).first(3 * std::size_t{header.count}),
      .components = std::span(components).first(semantic ? labels : 0),
      .label_weights = std::span(label_weights).first(header.has_label_weights ? labels : 0),
      .weights = std::span(weights).first(header.has_weights ? header.count : 0),
      .no_return = std::span(no_return).first(header.has_no_return ? header.count : 0)};
  const std::vector<std::byte> written = encode(again);
  require(std::equal(written.begin(), written.end(), bytes.begin(), bytes.end()),
          "written otherwise");
}

void images(Bytes bytes) {
  std::vector<std::uint8_t> components(kRoom);
  std::vector<float> depth_m(kRoom);
  ImageHeader header;
  const auto check = [&] {
    require(header.width_px > 0 && header.height_px > 0, "an image without pixels");
    require(static_cast<std::size_t>(header.width_px * header.height_px) <= kRoom,
            "an image's size");
  };
  if (decode_label_image(bytes, components, header) == MessageFault::kNone) {
    check();
    const std::vector<std::byte> written = encode(ImageToSend{
        header,
        std::span(components).first(static_cast<std::size_t>(header.width_px * header.height_px))});
    require(std::equal(written.begin(), written.end(), bytes.begin(), bytes.end()),
            "written otherwise");
  }
  if (decode_depth_image(bytes, depth_m, header) == MessageFault::kNone) check();
}

void pose(Bytes bytes) {
  PoseMessage read;
  if (decode_pose(bytes, read) != MessageFault::kNone) return;
  require(check_rigid(read.T_map_body) == Status::kOk, "a pose that is not rigid");
  PoseMessage again;
  require(decode_pose(encode(read), again) == MessageFault::kNone, "written it is refused");
}

void correction(Bytes bytes) {
  std::vector<std::int64_t> keys(kRoom);
  std::vector<double> transforms(12 * kRoom);
  CorrectionHeader header;
  if (decode_correction(bytes, {keys, transforms}, header) != MessageFault::kNone) return;
  require(header.count <= kRoom, "more poses than there is room for");
  for (std::size_t i = 0; i < header.count; ++i) {
    Matrix34d T;
    for (int k = 0; k < 12; ++k) T(k / 4, k % 4) = transforms[12 * i + static_cast<std::size_t>(k)];
    require(check_rigid(T) == Status::kOk, "a corrected pose that is not rigid");
  }
}

void query(Bytes bytes) {
  MapQuery read;
  if (!decode_query(bytes, read)) return;
  MapReply reply;
  reply.request = read.request;
  require(encode_reply(reply).size() == kReplyBytes, "a reply's size");
}

}  // namespace

void sensors(Bytes bytes) {
  Input input(bytes);
  switch (input.below(6)) {
    case 0:
      return fragments(input);
    case 1:
      return cloud(input.rest(), true);
    case 2:
      return cloud(input.rest(), false);
    case 3:
      return images(input.rest());
    case 4:
      correction(bytes.subspan(1));
      return pose(input.rest());
    default:
      return query(input.rest());
  }
}

}  // namespace tessera::fuzz
