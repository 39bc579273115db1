// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The parts of a picture on their own: letters, framing, files that appear only when complete.
#include <algorithm>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "pictures/bitmap_font.hpp"
#include "pictures/canvas.hpp"
#include "pictures/framing.hpp"
#include "pictures/lettering.hpp"

namespace tessera {
namespace {

TEST_CASE("glyph_of: every printable character has ink, and no two look the same") {
  std::vector<Glyph> glyphs;
  for (int code = '!'; code <= '~'; ++code) glyphs.push_back(glyph_of(static_cast<char>(code)));
  REQUIRE(std::count(glyphs.begin(), glyphs.end(), Glyph{}) == 0);
  std::sort(glyphs.begin(), glyphs.end());
  REQUIRE(std::adjacent_find(glyphs.begin(), glyphs.end()) == glyphs.end());
}

TEST_CASE("glyph_of: what is not printable ASCII is shown as a question mark") {
  REQUIRE(glyph_of('\n') == glyph_of('?'));
  REQUIRE(glyph_of(static_cast<char>(0xE9)) == glyph_of('?'));
}

TEST_CASE("draw_text: text that leaves the canvas is clipped") {
  Canvas canvas(20, 20, Color{});
  draw_text(canvas, {-7.0F, -3.0F}, "clipped on all sides", 4.0F, Color{255, 255, 255});
  REQUIRE(std::count(canvas.data(), canvas.data() + 400, Color{255, 255, 255}) > 0);
}

TEST_CASE("text_width: a UTF-8 character counts once") {
  REQUIRE(text_width("stra\xC3\x9F"
                     "e",
                     2.0F) == text_width("strase", 2.0F));
}

TEST_CASE("shortened: a text that fits stays, a long one keeps its ends") {
  const int room_px = text_width("0123456789", 2.0F);
  CHECK(shortened("0123456789", room_px, 2.0F) == "0123456789");
  CHECK(shortened("0123456789a", room_px, 2.0F) == "0123...89a");
  CHECK(shortened("\xC3\xA4\xC3\xB6\xC3\xBC\xC3\x9F 34567 89ab\xC3\xA4", room_px, 2.0F) ==
        "\xC3\xA4\xC3\xB6\xC3\xBC\xC3\x9F...ab\xC3\xA4");
  CHECK(shortened("0123456789a", 1, 2.0F) == "...");
}

TEST_CASE("scaled: a factor of one returns the colour itself") {
  for (int value = 0; value < 256; ++value) {
    const Color color{static_cast<std::uint8_t>(value), 0, 255};
    REQUIRE(scaled(color, 1.0F) == color);
  }
}

TEST_CASE("halved: each pixel is the mean of four") {
  Canvas canvas(2, 2, Color{0, 0, 0});
  canvas.at(0, 0) = {200, 100, 0};
  canvas.at(1, 1) = {200, 100, 4};
  REQUIRE(canvas.halved().at(0, 0) == Color{100, 50, 1});
}

TEST_CASE("round_length: the largest of 1, 2, 5, 10 ... that fits") {
  REQUIRE(round_length(1.0F) == Approx(1.0));
  REQUIRE(round_length(1.99F) == Approx(1.0));
  REQUIRE(round_length(4.9F) == Approx(2.0));
  REQUIRE(round_length(73.0F) == Approx(50.0));
  REQUIRE(round_length(0.3F) == Approx(0.2));
}

TEST_CASE("stretch_of: finds the direction of a street") {
  std::vector<RenderVoxel> voxels;
  for (int i = -50; i <= 50; ++i) {
    const float along = static_cast<float>(i);
    const float across = static_cast<float>((i + 50) % 5);
    voxels.push_back({along - across, along + across, 0.0F, {}});
  }
  REQUIRE(stretch_of(voxels).direction_rad == Approx(0.7854).margin(0.02));
}

}  // namespace
}  // namespace tessera
