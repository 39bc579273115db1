// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <string_view>
#include <tessera_query.hpp>

#include "fuzz/sensor_seeds.hpp"
#include "link/long_message.hpp"
#include "link/sensor_sender.hpp"

namespace tessera::fuzz {
namespace {

using Seed = std::vector<std::byte>;

Seed with_kind(unsigned kind, const Seed& message) {
  Seed seed{static_cast<std::byte>(kind)};
  seed.insert(seed.end(), message.begin(), message.end());
  return seed;
}

/// A message in three fragments, the last one first.
Seed fragments() {
  constexpr std::string_view kText = "a message of thirty characters";
  Seed seed{std::byte{0}};
  for (const std::size_t number : {2U, 0U, 1U}) {
    const Fragment fragment{.sequence = 7,
                            .message_bytes = kText.size(),
                            .offset = static_cast<std::uint32_t>(10 * number),
                            .number = static_cast<std::uint16_t>(number),
                            .fragments = 3,
                            .channel = "BIG"};
    FragmentHeader header;
    const std::size_t bytes = write_fragment_header(header, fragment);
    // Sender, time, length.
    seed.insert(seed.end(), {std::byte{1}, std::byte{5}, static_cast<std::byte>(bytes + 10)});
    seed.insert(seed.end(), header.begin(), header.begin() + static_cast<std::ptrdiff_t>(bytes));
    for (const char letter : kText.substr(10 * number, 10))
      seed.push_back(static_cast<std::byte>(letter));
  }
  return seed;
}

Seed query() {
  tessera_query message{};
  message.version = 1;
  message.kind = tessera_query::RAY;
  message.length_m = 3.0;
  Seed bytes(static_cast<std::size_t>(message.getEncodedSize()));
  static_cast<void>(message.encode(bytes.data(), 0, static_cast<int>(bytes.size())));
  return bytes;
}

}  // namespace

std::vector<std::vector<std::byte>> sensor_seeds() {
  const std::vector<float> xyz{1.0F, 2.0F, -3.0F, 0.5F, 0.0F, 40.0F};
  const std::vector<std::uint8_t> components{3, 20};
  const std::vector<float> weights{1.0F, 0.5F};
  const std::vector<std::int32_t> times_us{-50'000, 50'000};
  const std::vector<float> depth_m{1.5F, 0.0F};
  const std::vector<std::uint16_t> depth_mm{2'500, 0};
  const ImageHeader header{.stamp_us = 5, .camera = 1, .width_px = 2, .height_px = 1};
  const PoseMessage pose{.stamp_us = 5, .sequence = 1, .quality = PoseQuality::kGood};
  return {fragments(),
          with_kind(1, encode(CloudToSend{
                           .stamp_us = 5, .sensor = 1, .xyz = xyz, .components = components})),
          with_kind(1, encode(CloudToSend{.stamp_us = 5,
                                          .sensor = 1,
                                          .xyz = xyz,
                                          .components = components,
                                          .weights = weights,
                                          .times_us = times_us})),
          with_kind(
              2, encode(CloudToSend{.stamp_us = 5, .sensor = 1, .xyz = xyz, .times_us = times_us})),
          with_kind(3, encode(ImageToSend{.header = header, .components = components})),
          with_kind(3, encode(DepthToSend{.header = header, .depth_m = depth_m})),
          with_kind(3, encode(DepthToSend{.header = header, .depth_mm = depth_mm})),
          with_kind(4, encode(pose)),
          with_kind(5, query())};
}

}  // namespace tessera::fuzz
