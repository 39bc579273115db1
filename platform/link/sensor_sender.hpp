// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Sends sensor messages on the LCM network of this machine, for players and simulators. Does not
// use liblcm, because that sends all fragments of a message at once: 2 MB then overflow a
// receiver's buffer of the default size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/file_descriptor.hpp"
#include "base/network_interface.hpp"
#include "base/outcome.hpp"
#include "link/long_message.hpp"
#include "link/sensor_messages.hpp"
#include "link/udpm_url.hpp"

namespace tessera {

struct CloudToSend {
  std::int64_t stamp_us = 0;
  std::int32_t sensor = 0;
  std::span<const float> xyz;  ///< Three per point.
  /// A byte per label for a tessera_semantic_cloud; empty for a tessera_cloud.
  std::span<const std::uint8_t> components{};
  /// As many as components, of as many labels for each point; or none, of one.
  std::span<const std::uint8_t> label_weights{};
  std::span<const float> weights{};           ///< One per point or none; only with components.
  std::span<const std::int32_t> times_us{};   ///< One per point or none, from the stamp.
  std::span<const std::uint8_t> no_return{};  ///< One per point or none.
};
struct ImageToSend {
  ImageHeader header{};
  std::span<const std::uint8_t> components;  ///< Of each pixel.
};
struct DepthToSend {
  ImageHeader header{};
  std::span<const float> depth_m{};           ///< Of each pixel, or empty.
  std::span<const std::uint16_t> depth_mm{};  ///< Of each pixel if depth_m is empty.
};

/// Encode as LCM's generated code does. Spans of other lengths are a caller bug. They use the heap.
[[nodiscard]] std::vector<std::byte> encode(const CloudToSend& cloud);
[[nodiscard]] std::vector<std::byte> encode(const ImageToSend& image);
[[nodiscard]] std::vector<std::byte> encode(const DepthToSend& image);
/// T_map_body is written as a unit quaternion with w >= 0.
[[nodiscard]] std::vector<std::byte> encode(const PoseMessage& pose);
/// poses: as many as keys; without deviations.
struct CorrectionToSend {
  std::uint32_t robot = 0;
  std::uint32_t revision = 0;
  bool of_submaps = false;  ///< Else of the body.
  std::span<const std::int64_t> keys{};
  std::span<const Matrix34d> poses{};
};
[[nodiscard]] std::vector<std::byte> encode(const CorrectionToSend& correction);

class SensorSender {
 public:
  /// Fails as SensorLink::open.
  static Outcome<std::unique_ptr<SensorSender>> open(const std::string& url,
                                                     const std::string& interface);

  /// Sends a message, in fragments if it is long, with a pause of kPause_us after every
  /// kBurstFragments of them. False iff the channel does not have 1 to 63 bytes, the message is
  /// empty or over 65,535 fragments, or the system refuses a datagram; its rest is not sent then.
  /// Uses no heap. For one thread.
  bool send(std::string_view channel, std::span<const std::byte> message) noexcept;

  [[nodiscard]] std::uint64_t sent_messages() const noexcept { return messages_; }
  [[nodiscard]] std::uint64_t sent_bytes() const noexcept { return bytes_; }

 private:
  /// 128 kB: fits into the smallest buffer of a receiver while it does something else.
  static constexpr std::uint32_t kBurstFragments = 2;
  static constexpr std::int64_t kPause_us = 200;

  explicit SensorSender(FileDescriptor socket) : socket_(std::move(socket)) {}
  bool send_fragments(std::string_view channel, std::span<const std::byte> message) noexcept;
  bool send_datagram(std::span<const std::byte> header,
                     std::span<const std::byte> payload) noexcept;

  FileDescriptor socket_;
  std::uint32_t sequence_ = 0;
  std::uint64_t messages_ = 0;
  std::uint64_t bytes_ = 0;
};

}  // namespace tessera
