// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Bytes that nobody encoded: each is refused, or it is the one code of what it says. Every code has
// exactly the memory that it takes, so that sanitizers see a byte read beyond.
#include <catch2/catch.hpp>

#include "support/sample_content.hpp"

namespace tessera {
namespace {

using oracle::Random;

constexpr int kComponents = 21;

/// What is accepted has evidence of these components and levels only, and is coded to those bytes.
bool accepts(const CodedBytes& bytes, unsigned layers, OwnContent& own) {
  own->clear();
  const Status status = decode_block(bytes, layers, kComponents, *own);
  if (status != Status::kOk) {
    REQUIRE(status == Status::kCorrupt);
    return false;
  }
  REQUIRE((own->components() >> kComponents) == 0);
  REQUIRE(coded(*own, layers) == bytes);
  return true;
}

/// Codes of smooth blocks, and of random ones, which are mostly coded plainly.
std::vector<CodedBytes> samples(Random& random) {
  std::vector<CodedBytes> codes;
  for (int i = 0; i < 40; ++i) {
    OwnContent own(kComponents);
    i % 4 == 3 ? fill_at_random(*own, random, kComponents, 8, i % 8 == 3 ? 1.0 : 0.02)
               : fill_smoothly(*own, random, kComponents);
    quantise(*own);
    codes.push_back(coded(*own));
  }
  return codes;
}

TEST_CASE("hostile codes: what is cut or longer is refused, or the code of something else") {
  Random random(1);
  OwnContent own(kComponents);
  for (const CodedBytes& code : samples(random)) {
    REQUIRE(accepts(code, kAllLayers, own));
    const std::size_t step = 1 + code.size() / 60;
    for (std::size_t size = 1; size < code.size(); size += step) {
      CodedBytes cut = code;
      cut.resize(size);
      cut.shrink_to_fit();
      // A part may be the code of something else.
      static_cast<void>(accepts(cut, kAllLayers, own));
    }
    for (int extra = 0; extra < 256; extra += 51) {
      CodedBytes longer = code;
      longer.push_back(static_cast<std::byte>(extra));
      longer.shrink_to_fit();
      const bool taken = accepts(longer, kAllLayers, own);
      if (extra == 0) REQUIRE_FALSE(taken);
    }
  }
}

TEST_CASE("hostile codes: what is mutated is refused, or it is the code of what it says") {
  Random random(2);
  OwnContent own(kComponents);
  const std::vector<CodedBytes> codes = samples(random);
  int accepted = 0;
  for (int i = 0; i < 60000; ++i) {
    CodedBytes bytes = codes[static_cast<std::size_t>(random.below(40))];
    for (int n = 1 + random.below(3); n > 0; --n) {
      auto& byte = bytes[static_cast<std::size_t>(random.below(static_cast<int>(bytes.size())))];
      byte = static_cast<std::byte>(random.below(256));
    }
    if (random.below(4) == 0)
      bytes.resize(1 + static_cast<std::size_t>(random.below(static_cast<int>(bytes.size()))));
    bytes.shrink_to_fit();
    accepted += accepts(bytes, kAllLayers, own) ? 1 : 0;
  }
  CHECK(accepted > 0);
}

TEST_CASE("hostile codes: so are random bytes, for any layers") {
  Random random(3);
  OwnContent own(kComponents);
  int accepted = 0;
  for (int i = 0; i < 60000; ++i) {
    CodedBytes bytes(static_cast<std::size_t>(random.below(i % 4 == 0 ? 1400 : 12)));
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.below(256));
    if (i % 8 == 0 && bytes.size() > 1) bytes[0] = bytes[1] = std::byte{0};  // coded plainly
    accepted += accepts(bytes, 1U + static_cast<unsigned>(random.below(15)), own) ? 1 : 0;
  }
  CHECK(accepted > 10);
}

TEST_CASE("hostile codes: components that the map has not are refused") {
  OwnContent own;
  own->add(kComponents - 1, 5, 1.0F);
  quantise(*own);
  const CodedBytes known = coded(*own);
  own->clear();
  own->add(kComponents, 5, 1.0F);
  quantise(*own);
  const CodedBytes unknown = coded(*own);
  own->clear();
  CHECK(decode_block(known, kAllLayers, kComponents, *own) == Status::kOk);
  own->clear();
  CHECK(decode_block(unknown, kAllLayers, kComponents, *own) == Status::kCorrupt);
  own->clear();
  CHECK(decode_block(unknown, kAllLayers, kComponents + 1, *own) == Status::kOk);
}

}  // namespace
}  // namespace tessera
