// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C program's functions as the core wants them. Named, so that the gate of the stack knows who
// calls them.
#include <algorithm>

#include "tessera_c.hpp"

namespace {

const tessera_callbacks& callbacks_at(void* context) noexcept {
  return *static_cast<const tessera_callbacks*>(context);
}
const std::uint8_t* bytes_of(std::span<const std::byte> bytes) noexcept {
  return reinterpret_cast<const std::uint8_t*>(bytes.data());
}
std::uint8_t* room_of(std::span<std::byte> bytes) noexcept {
  return reinterpret_cast<std::uint8_t*>(bytes.data());
}

}  // namespace

/// Outside of the library's namespace, and so of what may call through pointers by its name.
struct CallbacksOfC {
  static std::int64_t now_us(void* context) noexcept {
    const tessera_callbacks& by = callbacks_at(context);
    return std::clamp(by.now_us(by.clock_context), -TESSERA_MOST_TIME_US, TESSERA_MOST_TIME_US);
  }
  static void tag(void* context, std::span<const std::byte> message,
                  std::span<std::byte, tessera::kTagBytes> tag) noexcept {
    const tessera_callbacks& by = callbacks_at(context);
    by.tag_message(by.tag_context, bytes_of(message), message.size(), room_of(tag));
  }
  static bool check_tag(void* context, std::span<const std::byte> message,
                        std::span<const std::byte, tessera::kTagBytes> tag) noexcept {
    const tessera_callbacks& by = callbacks_at(context);
    return by.check_tag(by.tag_context, bytes_of(message), message.size(), bytes_of(tag)) == 1;
  }
  static void sign(void* context, std::span<const std::byte> message,
                   std::span<std::byte, tessera::kSignatureBytes> signature) noexcept {
    const tessera_callbacks& by = callbacks_at(context);
    by.sign(by.signature_context, bytes_of(message), message.size(), room_of(signature));
  }
  static bool check_signature(
      void* context, std::uint32_t robot, std::span<const std::byte> message,
      std::span<const std::byte, tessera::kSignatureBytes> signature) noexcept {
    const tessera_callbacks& by = callbacks_at(context);
    return by.check_signature(by.signature_context, robot, bytes_of(message), message.size(),
                              bytes_of(signature)) == 1;
  }
  static void hash(void* context, std::span<const std::byte> message,
                   std::span<std::byte, tessera::kHashBytes> hash) noexcept {
    const tessera_callbacks& by = callbacks_at(context);
    by.hash(by.signature_context, bytes_of(message), message.size(), room_of(hash));
  }
  static bool put_block(void* context, tessera::BlockKey key, std::span<const std::byte> bytes,
                        std::uint32_t& /*place*/) noexcept {
    const tessera_callbacks& by = callbacks_at(context);
    return by.put_block(by.archive_context, key.bits, bytes_of(bytes), bytes.size()) == 1;
  }
  static std::size_t get_block(void* context, tessera::BlockKey key, std::uint32_t /*place*/,
                               std::span<std::byte> into) noexcept {
    const tessera_callbacks& by = callbacks_at(context);
    return by.get_block(by.archive_context, key.bits, room_of(into), into.size());
  }
  static void drop_block(void* context, tessera::BlockKey key, std::uint32_t /*place*/) noexcept {
    const tessera_callbacks& by = callbacks_at(context);
    by.drop_block(by.archive_context, key.bits);
  }
  static void clear_blocks(void* context) noexcept {
    const tessera_callbacks& by = callbacks_at(context);
    by.clear_blocks(by.archive_context);
  }
};

namespace tessera::c_interface {

Clock clock_of(tessera_callbacks& callbacks) noexcept {
  if (callbacks.now_us == nullptr) return {};
  return {&callbacks, &CallbacksOfC::now_us};
}

RobotKeys keys_of(tessera_callbacks& callbacks) noexcept {
  RobotKeys keys;
  if (callbacks.tag_message != nullptr)
    keys.authenticator = {&callbacks, &CallbacksOfC::tag, &CallbacksOfC::check_tag};
  if (callbacks.sign != nullptr)
    keys.signatures = {&callbacks, &CallbacksOfC::sign, &CallbacksOfC::check_signature,
                       &CallbacksOfC::hash};
  return keys;
}

BlockStore store_of(tessera_callbacks& callbacks) noexcept {
  return {&callbacks, &CallbacksOfC::put_block, &CallbacksOfC::get_block, &CallbacksOfC::drop_block,
          &CallbacksOfC::clear_blocks};
}

}  // namespace tessera::c_interface
