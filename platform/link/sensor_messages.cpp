// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/sensor_messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <tessera_cloud.hpp>
#include <tessera_correction.hpp>
#include <tessera_depth_image.hpp>
#include <tessera_label_image.hpp>
#include <tessera_pose.hpp>
#include <tessera_semantic_cloud.hpp>

#include "link/big_endian_reader.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {
namespace {

constexpr std::size_t kHashBytes = 8;
constexpr std::size_t kTransform = 12;  ///< Numbers of one, [R | t].

/// Fingerprint of the type by lcm-gen, so that a reader of an old version refuses a new one.
template <class Message>
MessageFault check_type(BigEndianReader& reader, std::size_t fixed_bytes) {
  if (reader.left() < kHashBytes) return MessageFault::kTooShort;
  if (reader.i64() != Message::getHash()) return MessageFault::kOtherType;
  return reader.left() < fixed_bytes ? MessageFault::kTooShort : MessageFault::kNone;
}

/// Counts of a cloud as in the message, unchecked.
struct CloudCounts {
  std::int64_t count = 0;
  std::int64_t coordinates = 0;
  std::int64_t components = 0;
  std::int64_t label_weights = 0;
  std::int64_t weights = 0;
  std::int64_t times = 0;
  std::int64_t no_returns = 0;
};

/// As many labels for each point; without weights one. A cloud without points has none.
bool has_whole_labels(const CloudCounts& c) {
  if (c.label_weights == 0) return c.components == 0 || c.components == c.count;
  const bool whole = c.count > 0 && c.components % c.count == 0;
  return whole && c.label_weights == c.components && c.components > 0 &&
         c.components / c.count <= static_cast<std::int64_t>(kMostLabels);
}

MessageFault check_counts(const CloudCounts& c, std::size_t bytes_left, const CloudMemory& memory) {
  const auto is_optional = [&](std::int64_t n) { return n == 0 || n == c.count; };
  const bool agree = c.count >= 0 && c.coordinates == 3 * c.count && has_whole_labels(c) &&
                     is_optional(c.weights) && is_optional(c.times) && is_optional(c.no_returns);
  if (!agree) return MessageFault::kCounts;
  const std::int64_t bytes =
      4 * (c.coordinates + c.weights + c.times) + c.components + c.label_weights + c.no_returns;
  if (bytes != static_cast<std::int64_t>(bytes_left)) return MessageFault::kCounts;
  const auto fits = [](std::int64_t n, std::size_t room) {
    return n <= static_cast<std::int64_t>(room);
  };
  const bool all_fit =
      fits(c.coordinates, memory.xyz.size()) && fits(c.components, memory.components.size()) &&
      fits(c.weights, memory.weights.size()) && fits(c.times, memory.times_s.size()) &&
      fits(c.label_weights, memory.label_weights.size()) &&
      fits(c.no_returns, memory.no_return.size());
  return all_fit ? MessageFault::kNone : MessageFault::kTooLarge;
}

bool read_times(BigEndianReader& reader, std::span<float> times_s, CloudHeader& header) {
  if (times_s.empty()) return true;
  std::int32_t first = kMostSweep_us;
  std::int32_t last = -kMostSweep_us;
  bool within = true;
  for (float& time_s : times_s) {
    const std::int32_t time_us = reader.i32();
    within = within && time_us >= -kMostSweep_us && time_us <= kMostSweep_us;
    first = std::min(first, time_us);
    last = std::max(last, time_us);
    time_s = static_cast<float>(1e-6 * time_us);
  }
  header.first_us = first;
  header.last_us = last;
  return within;
}

template <class Message>
MessageFault decode_any_cloud(std::span<const std::byte> message, const CloudMemory& memory,
                              CloudHeader& header) {
  constexpr bool kLabelled = std::is_same_v<Message, tessera_semantic_cloud>;
  BigEndianReader reader(message);
  const MessageFault type = check_type<Message>(reader, 8 + 4 * (kLabelled ? 8 : 5));
  if (type != MessageFault::kNone) return type;
  CloudHeader read;
  read.stamp_us = reader.i64();
  read.sensor = reader.i32();
  CloudCounts counts;
  counts.count = reader.i32();
  counts.coordinates = reader.i32();
  if (kLabelled) {
    counts.components = reader.i32();
    counts.label_weights = reader.i32();
    counts.weights = reader.i32();
    if (counts.components == 0 && counts.count != 0) return MessageFault::kCounts;
  }
  counts.times = reader.i32();
  counts.no_returns = reader.i32();
  const MessageFault fault = check_counts(counts, reader.left(), memory);
  if (fault != MessageFault::kNone) return fault;
  const auto first = [](auto span, std::int64_t n) {
    return span.first(static_cast<std::size_t>(n));
  };
  reader.floats(first(memory.xyz, counts.coordinates));
  reader.bytes(first(memory.components, counts.components));
  reader.bytes(first(memory.label_weights, counts.label_weights));
  reader.floats(first(memory.weights, counts.weights));
  if (!read_times(reader, first(memory.times_s, counts.times), read)) return MessageFault::kValue;
  reader.bytes(first(memory.no_return, counts.no_returns));
  read.count = static_cast<std::uint32_t>(counts.count);
  read.has_components = kLabelled;
  read.has_label_weights = counts.label_weights > 0;
  if (read.has_label_weights)
    read.labels_per_point = static_cast<std::uint32_t>(counts.components / counts.count);
  read.has_weights = counts.weights > 0;
  read.has_times = counts.times > 0;
  read.has_no_return = counts.no_returns > 0;
  header = read;
  return MessageFault::kNone;
}

/// Reads camera and size; sets pixels to their product.
MessageFault read_size(BigEndianReader& reader, ImageHeader& header, std::int64_t& pixels) {
  header.camera = reader.i32();
  header.width_px = reader.i32();
  header.height_px = reader.i32();
  constexpr std::int32_t kMostEdge_px = 1 << 15;
  if (header.width_px < 0 || header.height_px < 0) return MessageFault::kCounts;
  if (header.width_px == 0 || header.height_px == 0) return MessageFault::kValue;
  if (header.width_px > kMostEdge_px || header.height_px > kMostEdge_px)
    return MessageFault::kTooLarge;
  pixels = std::int64_t{header.width_px} * header.height_px;
  return MessageFault::kNone;
}

/// True iff the numbers are a rigid transform, which is then in T. Written so that NaN fails.
bool make_transform(std::span<const double, 3> position_m, std::span<const double, 4> q,
                    Matrix34d& T) {
  const double squares = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(std::abs(std::sqrt(squares) - 1.0) <= 1e-3)) return false;
  // Its length is 1 except for the last bits.
  const double scale = 1.0 / std::sqrt(squares);
  const double w = q[0] * scale, x = q[1] * scale, y = q[2] * scale, z = q[3] * scale;
  T << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), position_m[0],
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), position_m[1],
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), position_m[2];
  return check_rigid(T) == Status::kOk;
}

/// A comparison with NaN is false, so a search for the largest would ignore it.
bool has_deviations(const tessera_pose& message) {
  return std::isfinite(message.rotation_sigma_rad) &&
         std::all_of(std::begin(message.position_sigma_m), std::end(message.position_sigma_m),
                     [](double sigma_m) { return std::isfinite(sigma_m); });
}

}  // namespace

MessageFault decode_semantic_cloud(std::span<const std::byte> message, const CloudMemory& memory,
                                   CloudHeader& header) noexcept {
  return decode_any_cloud<tessera_semantic_cloud>(message, memory, header);
}

MessageFault decode_cloud(std::span<const std::byte> message, const CloudMemory& memory,
                          CloudHeader& header) noexcept {
  return decode_any_cloud<tessera_cloud>(message, memory, header);
}

MessageFault decode_label_image(std::span<const std::byte> message,
                                std::span<std::uint8_t> components, ImageHeader& header) noexcept {
  BigEndianReader reader(message);
  const MessageFault type = check_type<tessera_label_image>(reader, 8 + 4 * 4);
  if (type != MessageFault::kNone) return type;
  ImageHeader read;
  read.stamp_us = reader.i64();
  std::int64_t pixels = 0;
  const MessageFault size = read_size(reader, read, pixels);
  if (size != MessageFault::kNone) return size;
  if (reader.i32() != pixels || static_cast<std::int64_t>(reader.left()) != pixels)
    return MessageFault::kCounts;
  if (static_cast<std::size_t>(pixels) > components.size()) return MessageFault::kTooLarge;
  reader.bytes(components.first(static_cast<std::size_t>(pixels)));
  header = read;
  return MessageFault::kNone;
}

MessageFault decode_depth_image(std::span<const std::byte> message, std::span<float> depth_m,
                                ImageHeader& header) noexcept {
  BigEndianReader reader(message);
  const MessageFault type = check_type<tessera_depth_image>(reader, 8 + 5 * 4);
  if (type != MessageFault::kNone) return type;
  ImageHeader read;
  read.stamp_us = reader.i64();
  std::int64_t pixels = 0;
  const MessageFault size = read_size(reader, read, pixels);
  if (size != MessageFault::kNone) return size;
  const std::int64_t metres = reader.i32();
  const std::int64_t millimetres = reader.i32();
  const bool one_kind =
      (metres == pixels && millimetres == 0) || (millimetres == pixels && metres == 0);
  if (!one_kind || static_cast<std::int64_t>(reader.left()) != 4 * metres + 2 * millimetres)
    return MessageFault::kCounts;
  if (static_cast<std::size_t>(pixels) > depth_m.size()) return MessageFault::kTooLarge;
  const std::span<float> into = depth_m.first(static_cast<std::size_t>(pixels));
  if (metres > 0) {
    reader.floats(into);
  } else {
    for (float& depth : into) depth = static_cast<float>(1e-3 * reader.word<std::uint16_t>());
  }
  header = read;
  return MessageFault::kNone;
}

MessageFault decode_pose(std::span<const std::byte> message, PoseMessage& pose) noexcept {
  BigEndianReader reader(message);
  constexpr std::size_t kFixedBytes = 8 + 2 * 4 + 11 * 8;
  const MessageFault type = check_type<tessera_pose>(reader, kFixedBytes);
  if (type != MessageFault::kNone) return type;
  if (reader.left() != kFixedBytes) return MessageFault::kCounts;
  // Only fixed arrays, so the code generated by LCM stays within its bounds.
  tessera_pose read{};
  if (read.decode(message.data(), 0, static_cast<int>(message.size())) < 0)
    return MessageFault::kTooShort;
  if (read.quality < tessera_pose::INVALID || read.quality > tessera_pose::GOOD)
    return MessageFault::kValue;
  PoseMessage result;
  result.stamp_us = read.stamp_us;
  result.sequence = read.sequence;
  result.quality = static_cast<PoseQuality>(read.quality);
  const bool is_valid = result.quality != PoseQuality::kInvalid;
  if (is_valid &&
      !(make_transform(read.position_m, read.rotation, result.T_map_body) && has_deviations(read)))
    return MessageFault::kValue;
  result.position_sigma_m = {read.position_sigma_m[0], read.position_sigma_m[1],
                             read.position_sigma_m[2]};
  result.rotation_sigma_rad = read.rotation_sigma_rad;
  pose = result;
  return MessageFault::kNone;
}

MessageFault decode_correction(std::span<const std::byte> message, const CorrectionMemory& memory,
                               CorrectionHeader& header) noexcept {
  BigEndianReader reader(message);
  const MessageFault type = check_type<tessera_correction>(reader, 4 * 4);
  if (type != MessageFault::kNone) return type;
  CorrectionHeader read;
  read.robot = reader.word<std::uint32_t>();
  const std::int32_t revision = reader.i32();
  if (revision < 1) return MessageFault::kValue;
  read.revision = static_cast<std::uint32_t>(revision);
  const std::int32_t kind = reader.i32();
  read.of_submaps = kind == tessera_correction::SUBMAPS;
  if (!read.of_submaps && kind != tessera_correction::BODY) return MessageFault::kValue;
  read.count = reader.word<std::uint32_t>();
  constexpr std::size_t kPoseBytes = 8 + (3 + 4 + 2) * 8;
  if (reader.left() != kPoseBytes * read.count) return MessageFault::kCounts;
  if (read.count > memory.keys.size() || read.count > memory.transforms.size() / kTransform)
    return MessageFault::kTooLarge;
  for (std::int64_t& key : memory.keys.first(read.count)) key = reader.i64();
  const std::span<double> transforms = memory.transforms.first(kTransform * read.count);
  for (std::size_t i = 0; i < 3 * std::size_t{read.count}; ++i)
    transforms[kTransform * (i / 3) + 4 * (i % 3) + 3] = reader.f64();
  for (std::size_t i = 0; i < read.count; ++i) {
    double* const numbers = transforms.subspan(kTransform * i, kTransform).data();
    const std::array<double, 3> position_m{numbers[3], numbers[7], numbers[11]};
    std::array<double, 4> rotation{};
    for (double& part : rotation) part = reader.f64();
    Matrix34d T;
    if (!make_transform(position_m, rotation, T)) return MessageFault::kValue;
    for (std::size_t k = 0; k < kTransform; ++k)
      numbers[k] = T(static_cast<int>(k / 4), static_cast<int>(k % 4));
  }
  for (std::size_t i = 0; i < 2 * std::size_t{read.count}; ++i) {
    if (!std::isfinite(reader.f64())) return MessageFault::kValue;
  }
  header = read;
  return MessageFault::kNone;
}

}  // namespace tessera
