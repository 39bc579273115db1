// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/sheet.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "pictures/lettering.hpp"
#include "pictures/oblique_view.hpp"
#include "pictures/top_view.hpp"

namespace tessera {
namespace {

constexpr Color kPaper{255, 255, 255};
constexpr Color kGround{231, 233, 236};
constexpr Color kRule{150, 155, 163};
constexpr Color kInk{28, 30, 34};
constexpr Color kFaintInk{110, 115, 123};
constexpr float kDegree = std::numbers::pi_v<float> / 180.0F;
/// Angle of the view to the longer side, so that fronts and sides of objects are visible; larger
/// for long streets, which would otherwise be a thin line into the distance.
constexpr float kElevation_deg = 35.0F;  ///< Angle of the oblique view downwards.
constexpr float kHeadingOffset_deg = 32.0F;
constexpr float kLongHeadingOffset_deg = 55.0F;
constexpr float kLongRatio = 4.0F;

/// One view with its texts. Lengths in this file are canvas pixels: two per pixel of the final
/// picture.
struct Panel {
  Canvas canvas;
  std::string caption;
  float pixels_per_m = 1.0F;
  std::string scale_note;
};

struct Layout {
  int width = 0;
  int pad = 0;
  float cell = 0.0F;  ///< One dot of a letter.

  [[nodiscard]] int content_width() const { return width - 2 * pad; }
  [[nodiscard]] int line_height() const { return static_cast<int>(std::lround(11.0F * cell)); }
};

Layout make_layout(int width_px) {
  Layout layout;
  layout.width = 2 * width_px;
  layout.cell = std::max(3.0F, static_cast<float>(width_px) / 400.0F);
  layout.pad = static_cast<int>(std::lround(6.0F * layout.cell));
  return layout;
}

std::vector<LegendEntry> used_entries(const Scene& scene, const std::vector<LegendEntry>& legend) {
  std::set<std::tuple<int, int, int>> colors;
  Color last{};
  bool any = false;
  for (const RenderVoxel& voxel : scene.voxels) {
    if (!is_drawable(voxel) || (any && voxel.color == last)) continue;
    last = voxel.color;
    any = true;
    colors.emplace(last.r, last.g, last.b);
  }
  std::vector<LegendEntry> used;
  for (const LegendEntry& entry : legend) {
    if (colors.contains({entry.color.r, entry.color.g, entry.color.b})) used.push_back(entry);
  }
  return used;
}

struct LegendGrid {
  std::vector<LegendEntry> entries;
  int columns = 1;
  int rows = 0;
  int entry_width = 0;
};

LegendGrid make_legend(const Scene& scene, const ImageOptions& options, const Layout& layout) {
  LegendGrid grid;
  grid.entries = used_entries(scene, options.legend);
  if (grid.entries.empty()) return grid;
  const int count = static_cast<int>(grid.entries.size());
  for (const LegendEntry& entry : grid.entries) {
    const float width =
        static_cast<float>(text_width(entry.name, layout.cell)) + 17.0F * layout.cell;
    grid.entry_width = std::max(grid.entry_width, static_cast<int>(width));
  }
  const int fitting = std::clamp(layout.content_width() / grid.entry_width, 1, count);
  grid.rows = (count + fitting - 1) / fitting;
  grid.columns = (count + grid.rows - 1) / grid.rows;
  grid.entry_width = std::max(grid.entry_width, layout.content_width() / grid.columns);
  return grid;
}

void draw_legend(Canvas& sheet, const LegendGrid& grid, const Layout& layout, int top) {
  const int swatch_width = static_cast<int>(10.0F * layout.cell);
  const int swatch_height = static_cast<int>(7.0F * layout.cell);
  for (std::size_t i = 0; i < grid.entries.size(); ++i) {
    const int column = static_cast<int>(i) / grid.rows;
    const int row = static_cast<int>(i) % grid.rows;
    const int x = layout.pad + column * grid.entry_width;
    const int y = top + row * layout.line_height();
    sheet.fill({x, y, swatch_width, swatch_height}, grid.entries[i].color);
    sheet.outline({x, y, swatch_width, swatch_height}, 2, kRule);
    const PixelPoint at{static_cast<float>(x) + 13.0F * layout.cell, static_cast<float>(y)};
    draw_text(sheet, at, grid.entries[i].name, layout.cell, kInk);
  }
}

std::string length_text(float length_m) {
  std::string text = std::to_string(static_cast<int>(std::lround(length_m * 100.0F)));
  if (length_m >= 1.0F) return text.substr(0, text.size() - 2) + " m";
  return text + " cm";
}

/// A label on a dimmed plate with its top left corner at (x, y).
void draw_plate(Canvas& canvas, int x, int y, std::string_view text, const Layout& layout) {
  const int pad = static_cast<int>(3.0F * layout.cell);
  const int height = static_cast<int>(13.0F * layout.cell);
  canvas.fill({x, y, text_width(text, layout.cell) + 2 * pad, height}, kPaper, 0.72F);
  draw_text(canvas, {static_cast<float>(x + pad), static_cast<float>(y + pad)}, text, layout.cell,
            kInk);
}

void draw_scale_bar(Canvas& canvas, const Panel& panel, const Layout& layout) {
  const float length_m =
      round_length(0.2F * static_cast<float>(canvas.width()) / panel.pixels_per_m);
  const int bar = static_cast<int>(std::lround(length_m * panel.pixels_per_m));
  const std::string text = length_text(length_m) + panel.scale_note;
  const int unit = static_cast<int>(std::lround(layout.cell));
  const int width = std::max(bar, text_width(text, layout.cell)) + 6 * unit;
  const int height = 19 * unit;
  const int x = 4 * unit;
  const int y = canvas.height() - height - 4 * unit;
  canvas.fill({x, y, width, height}, kPaper, 0.72F);
  draw_text(canvas, {static_cast<float>(x + 3 * unit), static_cast<float>(y + 3 * unit)}, text,
            layout.cell, kInk);
  const int bar_y = y + 14 * unit;
  canvas.fill({x + 3 * unit, bar_y, bar, unit}, kInk);
  canvas.fill({x + 3 * unit, bar_y - unit, unit, 3 * unit}, kInk);
  canvas.fill({x + 3 * unit + bar - unit, bar_y - unit, unit, 3 * unit}, kInk);
}

/// By index of the scene's voxels: outside of a view.
using CutOff = std::vector<bool>;

/// Marks the drawable voxels that the view does not show; returns the text for its caption.
template <class Frame>
std::string mark_cut_off(const Scene& scene, const Frame& frame, CutOff& cut_off) {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < scene.voxels.size(); ++i) {
    if (!is_drawable(scene.voxels[i]) || frame.shows(scene.voxels[i])) continue;
    cut_off[i] = true;
    ++count;
  }
  if (count == 0) return "";
  return fmt::format(", {} stray voxel{} not shown", count, (count == 1 ? "" : "s"));
}

Panel make_top_panel(const Scene& scene, const ImageOptions& options, const Layout& layout,
                     int max_height, CutOff& cut_off) {
  const TopFrame frame = make_top_frame(scene, layout.content_width(), max_height);
  const char* axes = frame.turned ? "from above, x down, y right" : "from above, x right, y up";
  return {draw_top_view(scene, frame, options, kGround), axes + mark_cut_off(scene, frame, cut_off),
          frame.pixels_per_m, ""};
}

/// The direction in which the viewer of the oblique view looks.
float heading_rad_of(const Scene& scene) {
  const Stretch stretch = stretch_of(scene.sample);
  const float share = std::clamp((stretch.ratio - 1.0F) / (kLongRatio - 1.0F), 0.0F, 1.0F);
  return stretch.direction_rad +
         std::lerp(kHeadingOffset_deg, kLongHeadingOffset_deg, share) * kDegree;
}

Panel make_oblique_panel(const Scene& scene, const Layout& layout, int max_height,
                         CutOff& cut_off) {
  const Camera camera = place_camera(scene, heading_rad_of(scene), kElevation_deg * kDegree,
                                     layout.content_width(), max_height);
  return {draw_oblique_view(scene, camera, kGround),
          "oblique" + mark_cut_off(scene, camera, cut_off), camera.scale_px / camera.focus_m,
          " in the middle"};
}

std::vector<Panel> make_panels(const Scene& scene, const ImageOptions& options,
                               const Layout& layout, CutOff& cut_off) {
  std::vector<Panel> panels;
  const float width = static_cast<float>(layout.content_width());
  if (scene.drawable == 0) {
    panels.push_back(
        {Canvas(layout.content_width(), layout.content_width() / 4, kGround), "", 0.0F, ""});
    return panels;
  }
  const bool both = options.view == View::kBoth;
  if (options.view != View::kTop) {
    const int max_height = static_cast<int>((both ? 0.62F : 0.8F) * width);
    panels.push_back(make_oblique_panel(scene, layout, max_height, cut_off));
  }
  if (options.view != View::kOblique) {
    const int max_height = static_cast<int>((both ? 0.8F : 1.0F) * width);
    panels.push_back(make_top_panel(scene, options, layout, max_height, cut_off));
  }
  return panels;
}

void letter_panel(Panel& panel, const std::string& empty_note, const Layout& layout) {
  const int inset = static_cast<int>(4.0F * layout.cell);
  if (panel.caption.empty()) {
    const float cell = 2.0F * layout.cell;
    const float x = 0.5F * static_cast<float>(panel.canvas.width() - text_width(empty_note, cell));
    const float y = 0.5F * (static_cast<float>(panel.canvas.height()) - 7.0F * cell);
    draw_text(panel.canvas, {x, y}, empty_note, cell, kFaintInk);
    return;
  }
  draw_plate(panel.canvas, inset, inset, panel.caption, layout);
  draw_scale_bar(panel.canvas, panel, layout);
}

}  // namespace

Sheet draw_sheet(const Scene& scene, const ImageOptions& options) {
  const Layout layout = make_layout(options.width_px);
  const LegendGrid legend = make_legend(scene, options, layout);
  CutOff cut_off(scene.voxels.size(), false);
  std::vector<Panel> panels = make_panels(scene, options, layout, cut_off);
  const int title_height = options.title.empty() ? 0 : static_cast<int>(14.0F * layout.cell);
  const int legend_height =
      legend.rows == 0 ? 0 : legend.rows * layout.line_height() + layout.pad / 2;
  int height = layout.pad + title_height + legend_height;
  for (const Panel& panel : panels) height += panel.canvas.height() + layout.pad;
  Canvas sheet(layout.width, height + height % 2, kPaper);
  int y = layout.pad;
  if (title_height > 0) {
    const float cell = 1.25F * layout.cell;
    draw_text(sheet, {static_cast<float>(layout.pad), static_cast<float>(y)},
              shortened(options.title, layout.content_width(), cell), cell, kInk);
  }
  y += title_height;
  for (Panel& panel : panels) {
    letter_panel(panel, options.empty_note, layout);
    sheet.blit(panel.canvas, layout.pad, y);
    sheet.outline({layout.pad, y, panel.canvas.width(), panel.canvas.height()}, 2, kRule);
    y += panel.canvas.height() + layout.pad;
  }
  draw_legend(sheet, legend, layout, y);
  return {sheet.halved(),
          static_cast<std::uint64_t>(std::count(cut_off.begin(), cut_off.end(), true))};
}

}  // namespace tessera
