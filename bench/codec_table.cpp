// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How likely is each of the decisions that a block's content is coded by? Prints the table of
// lib/src/exchange/block_probabilities.hpp; --out has it too.
#include <cmath>
#include <cstdio>

#include "block_model.hpp"
#include "codec_blocks.hpp"
#include "tessera/exchange/internal/block_codec.hpp"

namespace tessera::bench {

namespace {

/// Counts answers by context.
struct Census {
  std::array<std::array<double, 2>, detail::kContexts> answers{};

  bool bit(unsigned context, bool answer) {
    answers[context][answer ? 1 : 0] += 1.0;
    return answer;
  }
  static bool even(bool answer) { return answer; }
  [[nodiscard]] int initial(unsigned context) const {
    // Which numbers a fleet gives its classes is its own: all that is known is that most are small.
    if (context == detail::kComponent + 1) return 32;
    if (context == detail::kComponent + 2) return 96;
    if (context >= detail::kComponent && context < detail::kPassed) return 128;
    const auto& [zeros, ones] = answers[context];
    const double part = (ones + 1.0) / (zeros + ones + 2.0);
    return std::min(std::max(static_cast<int>(std::lround(256.0 * part)), 4), 252);
  }
};

Outcome<Json> measure(const Options& options, Records&) {
  TESSERA_TRY_ASSIGN(Mapper mapper, map_as_command(options));
  Census census;
  for_each_content(mapper, [&](BlockContent& content) {
    quantise(content);
    detail::BlockModel<Census> model(census, content.label_octets() != 0,
                                     content.pass_octets() != 0);
    static_cast<void>(model.code_head());
    detail::OctetCode code;
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      detail::read_octet(content, octet, true, true, code);
      static_cast<void>(model.code_octet(octet, code));
    }
  });
  Json table = Json::array();
  for (unsigned context = 0; context < detail::kContexts; ++context) {
    table.push_back(census.initial(context));
    std::printf("%d,%c", census.initial(context), context % 16 == 15 ? '\n' : ' ');
  }
  std::printf("\n");
  return Json{{"table", table}};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  return tessera::bench::run(argc, argv, "codec_table", tessera::bench::measure);
}
