// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Long messages: put together whatever the order, refused whatever the lie.
#include "link/fragment_assembler.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace tessera {
namespace {

using Bytes = std::vector<std::byte>;
const Endpoint kSender{0x7f000001, 5000};

Bytes fragment(const Fragment& parts, std::string_view payload) {
  FragmentHeader header;
  const std::size_t n = write_fragment_header(header, parts);
  Bytes bytes(header.begin(), header.begin() + static_cast<std::ptrdiff_t>(n));
  const auto text = std::as_bytes(std::span(payload));
  bytes.insert(bytes.end(), text.begin(), text.end());
  return bytes;
}

/// A message in fragments of so many bytes each.
std::vector<Bytes> cut(std::string_view payload, std::size_t bytes, std::uint32_t sequence = 1,
                       std::string_view channel = "BIG") {
  const std::size_t count = (payload.size() + bytes - 1) / bytes;
  std::vector<Bytes> parts;
  for (std::size_t i = 0; i < count; ++i) {
    const Fragment one{.sequence = sequence,
                       .message_bytes = static_cast<std::uint32_t>(payload.size()),
                       .offset = static_cast<std::uint32_t>(i * bytes),
                       .number = static_cast<std::uint16_t>(i),
                       .fragments = static_cast<std::uint16_t>(count),
                       .channel = channel};
    parts.push_back(fragment(one, payload.substr(i * bytes, bytes)));
  }
  return parts;
}

std::string text_of(const FragmentAssembler::Message& message) {
  return {reinterpret_cast<const char*>(message.payload.data()), message.payload.size()};
}

AssemblerConfig small_config() {
  return {.slots = 4, .max_message_bytes = 1000, .max_fragments = 100, .timeout_us = 1000};
}

std::string sample(std::size_t bytes) {
  std::string text(bytes, ' ');
  for (std::size_t i = 0; i < bytes; ++i) text[i] = static_cast<char>('a' + i % 23);
  return text;
}

/// Whether each fragment is in exactly one counter.
void check_sum(const AssemblerReport& r, std::uint64_t fragments) {
  CHECK(r.taken + r.malformed + r.too_large + r.inconsistent + r.duplicates == fragments);
}

TEST_CASE("FragmentAssembler: fragments in any order make the message, once") {
  const std::string text = sample(97);
  std::vector<Bytes> parts = cut(text, 10);
  std::mt19937 random(3);
  INFO("seed 3");
  for (std::uint32_t trial = 0; trial < 50; ++trial) {
    FragmentAssembler assembler(small_config());
    std::shuffle(parts.begin(), parts.end(), random);
    int whole = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const FragmentAssembler::Message message = assembler.take(kSender, parts[i], 0);
      if (message.channel.empty()) continue;
      ++whole;
      CHECK(i == parts.size() - 1);
      CHECK(message.channel == "BIG");
      CHECK(text_of(message) == text);
    }
    CHECK(whole == 1);
    CHECK(assembler.report().messages == 1);
  }
}

TEST_CASE("FragmentAssembler: a fragment that comes twice counts once, also after the message") {
  FragmentAssembler assembler(small_config());
  const std::vector<Bytes> parts = cut(sample(30), 10);
  CHECK(assembler.take(kSender, parts[0], 0).channel.empty());
  CHECK(assembler.take(kSender, parts[0], 0).channel.empty());
  CHECK(assembler.take(kSender, parts[2], 0).channel.empty());
  CHECK(assembler.take(kSender, parts[1], 0).channel == "BIG");
  CHECK(assembler.take(kSender, parts[1], 0).channel.empty());
  CHECK(assembler.report().duplicates == 2);
  CHECK(assembler.report().messages == 1);
  check_sum(assembler.report(), 5);
}

TEST_CASE("FragmentAssembler: messages of several senders and numbers do not mix") {
  FragmentAssembler assembler(small_config());
  const Endpoint other{0x7f000001, 5001};
  const auto a = cut("first message", 7, 1);
  const auto b = cut("other message", 7, 1);
  const auto c = cut("third message", 7, 2);
  CHECK(assembler.take(kSender, a[0], 0).channel.empty());
  CHECK(assembler.take(other, b[0], 0).channel.empty());
  CHECK(assembler.take(kSender, c[0], 0).channel.empty());
  CHECK(text_of(assembler.take(other, b[1], 0)) == "other message");
  CHECK(text_of(assembler.take(kSender, c[1], 0)) == "third message");
  CHECK(text_of(assembler.take(kSender, a[1], 0)) == "first message");
}

TEST_CASE("FragmentAssembler: at N-1, N and N+1 bytes and fragments of its limits") {
  for (const std::size_t bytes : {999U, 1000U, 1001U}) {
    FragmentAssembler assembler(small_config());
    int whole = 0;
    for (const Bytes& part : cut(sample(bytes), 100))
      whole += !assembler.take(kSender, part, 0).channel.empty();
    CHECK(whole == (bytes <= 1000 ? 1 : 0));
    CHECK(assembler.report().too_large == (bytes <= 1000 ? 0 : 11));
  }
  for (const std::size_t fragments : {99U, 100U, 101U}) {
    FragmentAssembler assembler(small_config());
    int whole = 0;
    for (const Bytes& part : cut(sample(fragments), 1))
      whole += !assembler.take(kSender, part, 0).channel.empty();
    CHECK(whole == (fragments <= 100 ? 1 : 0));
  }
}

TEST_CASE("FragmentAssembler: what is missing keeps its message back, and makes room in time") {
  FragmentAssembler assembler(small_config());
  for (std::uint32_t i = 0; i < 4; ++i) {
    const auto parts = cut(sample(30), 10, i);
    CHECK(assembler.take({1, static_cast<std::uint16_t>(i)}, parts[0], i).channel.empty());
  }
  const auto parts = cut(sample(30), 10, 9);
  CHECK(assembler.take(kSender, parts[0], 1000).channel.empty());
  CHECK(assembler.report().timed_out == 1);
  CHECK(assembler.report().evicted == 0);
  // The next to be silent for longest is not late yet.
  CHECK(assembler.take({1, 77}, cut(sample(30), 10, 3)[0], 1000).channel.empty());
  CHECK(assembler.report().evicted == 1);
  CHECK(assembler.take(kSender, parts[1], 1000).channel.empty());
  CHECK(text_of(assembler.take(kSender, parts[2], 1000)) == sample(30));
}

TEST_CASE("FragmentAssembler: a sender that begins a third message gives up its first") {
  FragmentAssembler assembler(small_config());
  for (std::uint32_t i = 1; i <= 3; ++i)
    CHECK(assembler.take(kSender, cut(sample(30), 10, i)[0], 0).channel.empty());
  CHECK(assembler.report().superseded == 1);
  // So a flood of one sender leaves the others' slots alone.
  const Endpoint other{0x7f000001, 1};
  const auto parts = cut(sample(20), 10, 5);
  CHECK(assembler.take(other, parts[0], 0).channel.empty());
  for (std::uint32_t i = 10; i < 1000; ++i)
    CHECK(assembler.take(kSender, cut(sample(30), 10, i)[0], 0).channel.empty());
  CHECK(assembler.take(other, parts[1], 0).channel == "BIG");
  CHECK(assembler.report().evicted == 0);
}

TEST_CASE("FragmentAssembler: a program that starts again with its predecessor's port is heard") {
  FragmentAssembler assembler(small_config());
  const auto first = cut("the old message", 8, 0);
  CHECK(assembler.take(kSender, first[0], 0).channel.empty());
  CHECK(assembler.take(kSender, first[1], 0).channel == "BIG");
  const auto second = cut("a new one, of another size", 9, 0);
  for (std::size_t i = 0; i + 1 < second.size(); ++i)
    CHECK(assembler.take(kSender, second[i], 2000).channel.empty());
  CHECK(text_of(assembler.take(kSender, second.back(), 2000)) == "a new one, of another size");
}

TEST_CASE("FragmentAssembler: numbers that disagree with the message's first are refused") {
  FragmentAssembler assembler(small_config());
  const auto parts = cut("0123456789abcdef", 8);
  CHECK(assembler.take(kSender, parts[0], 0).channel.empty());
  // Another size, another count, another place for a fragment that is there.
  const Fragment good{.sequence = 1, .message_bytes = 16, .offset = 8, .number = 1, .fragments = 2};
  Fragment size = good;
  size.message_bytes = 17;
  Fragment count = good;
  count.fragments = 3;
  CHECK(assembler.take(kSender, fragment(size, "abcdefgh"), 0).channel.empty());
  CHECK(assembler.take(kSender, fragment(count, "abcdefgh"), 0).channel.empty());
  Fragment shorter = good;
  shorter.number = 0;
  shorter.offset = 0;
  shorter.channel = "BIG";
  CHECK(assembler.take(kSender, fragment(shorter, "0123"), 0).channel.empty());
  CHECK(assembler.report().inconsistent == 3);
  CHECK(text_of(assembler.take(kSender, parts[1], 0)) == "0123456789abcdef");
  check_sum(assembler.report(), 5);
}

TEST_CASE("FragmentAssembler: fragments that overlap or leave gaps make no message") {
  const auto attempt = [](std::uint32_t offset, std::string_view second) {
    FragmentAssembler assembler(small_config());
    const Fragment first{.sequence = 1, .message_bytes = 16, .fragments = 2, .channel = "BIG"};
    CHECK(assembler.take(kSender, fragment(first, "01234567"), 0).channel.empty());
    const Fragment last{
        .sequence = 1, .message_bytes = 16, .offset = offset, .number = 1, .fragments = 2};
    const bool whole = !assembler.take(kSender, fragment(last, second), 0).channel.empty();
    CHECK(assembler.report().torn == (whole ? 0 : 1));
    return whole;
  };
  CHECK(attempt(8, "89abcdef"));
  CHECK_FALSE(attempt(7, "89abcdef"));
  CHECK_FALSE(attempt(9, "9abcdef"));
  CHECK_FALSE(attempt(8, "89abcde"));
  CHECK_FALSE(attempt(0, "01234567"));
}

TEST_CASE("read_fragment: each lie has its fault") {
  const auto fault = [](const Bytes& bytes) {
    Fragment into;
    return read_fragment(bytes, into);
  };
  const Fragment good{.sequence = 1, .message_bytes = 16, .offset = 8, .number = 1, .fragments = 2};
  const auto changed = [&](auto change, std::string_view payload) {
    Fragment other = good;
    change(other);
    return fault(fragment(other, payload));
  };
  CHECK(fault(fragment(good, "abcdefgh")) == FragmentFault::kNone);
  CHECK(fault(Bytes(19, std::byte{'L'})) == FragmentFault::kTooShort);
  CHECK(fault(Bytes(40, std::byte{'L'})) == FragmentFault::kForeign);
  CHECK(fault(fragment(good, "")) == FragmentFault::kEmpty);
  CHECK(fault(fragment(good, "abcdefghi")) == FragmentFault::kOutside);
  CHECK(changed([](Fragment& f) { f.offset = 0xffffffff; }, "abc") == FragmentFault::kOutside);
  CHECK(changed([](Fragment& f) { f.number = 2; }, "abc") == FragmentFault::kNumber);
  CHECK(changed([](Fragment& f) { f.fragments = 0; }, "abc") == FragmentFault::kNumber);
  CHECK(changed([](Fragment& f) { f.message_bytes = 1; }, "a") == FragmentFault::kNumber);
  const auto first = [&](std::string_view payload, std::uint32_t offset = 0) {
    Bytes bytes = fragment(good, payload);
    bytes[17] = std::byte{0};  // Number 0 without what write_fragment_header adds.
    bytes[15] = static_cast<std::byte>(offset);
    return fault(bytes);
  };
  using namespace std::literals;
  CHECK(first("AB\0xyz"sv) == FragmentFault::kNone);
  CHECK(first("AB\0xyz"sv, 1) == FragmentFault::kOutside);
  CHECK(first("AB\0"sv) == FragmentFault::kEmpty);
  CHECK(first("\0xyz"sv) == FragmentFault::kNoChannel);
  CHECK(first("ABxyz"sv) == FragmentFault::kNoChannel);
  CHECK(first(std::string(64, 'c') + "\0x"s) == FragmentFault::kNoChannel);
}

TEST_CASE("FragmentAssembler: 50,000 changed fragments, each counted, none out of bounds") {
  constexpr unsigned kSeed = 8;
  INFO("seed " << kSeed);
  std::mt19937 random(kSeed);
  FragmentAssembler assembler(small_config());
  const std::string text = sample(200);
  std::uint64_t messages = 0;
  for (std::uint32_t i = 0; i < 50'000; ++i) {
    const std::size_t bytes = 20 + random() % 30;
    std::vector<Bytes> parts = cut(text, bytes, random() % 8);
    Bytes part = parts[random() % parts.size()];
    for (int changes = static_cast<int>(random() % 3); changes > 0; --changes) {
      const std::size_t at = random() % std::min<std::size_t>(part.size(), 24);
      part[at] = static_cast<std::byte>(random() % 4 == 0 ? random() : random() % 4);
    }
    if (random() % 16 == 0) part.resize(random() % (part.size() + 1));
    part.shrink_to_fit();
    const Endpoint sender{1, static_cast<std::uint16_t>(random() % 3)};
    const FragmentAssembler::Message message = assembler.take(sender, part, i);
    if (message.channel.empty()) continue;
    ++messages;
    REQUIRE(message.payload.size() <= 1000);
  }
  check_sum(assembler.report(), 50'000);
  CHECK(assembler.report().messages >= messages);
}

TEST_CASE("FragmentAssembler: takes the memory that it says, whatever it is told") {
  const AssemblerConfig config{.slots = 2, .max_message_bytes = 100, .max_fragments = 10};
  CHECK(FragmentAssembler::required_bytes(config) >= 2 * (100 + 10 * 8));
  CHECK(FragmentAssembler::required_bytes(config) < 2 * (100 + 10 * 8) + 2 * 512);
  FragmentAssembler least({.slots = 0, .max_message_bytes = 0, .max_fragments = 0});
  CHECK(least.take(kSender, cut("x", 1)[0], 0).channel == "BIG");
}

}  // namespace
}  // namespace tessera
