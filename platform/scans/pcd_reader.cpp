// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/pcd_reader.hpp"

#include <fmt/core.h>

#include <array>
#include <string>

#include "base/number_row.hpp"
#include "scans/lzf.hpp"
#include "scans/pcd_header.hpp"
#include "scans/point_fields.hpp"

namespace tessera {
namespace {

std::string count_text(std::uint64_t rows, std::uint64_t promised) {
  return fmt::format("it has {} points, but its header says {}", rows, promised);
}

/// Finds the words of a row that are used; false iff the row has another number of words.
bool split_row(std::string_view row, const PcdHeader& header, PointAppender::Words& words) {
  std::array<std::uint64_t, kNumParts> wanted{};
  for (std::size_t part = 0; part < kNumParts; ++part) {
    const std::size_t index = header.chosen.index(part);
    // No row has this many words.
    wanted[part] =
        index == PointFields::kAbsent ? PointFields::kAbsent : header.fields[index].offset_words;
  }
  words = {};
  std::uint64_t count = 0;
  for (std::string_view word = take_word(row); !word.empty(); word = take_word(row), ++count) {
    for (std::size_t part = 0; part < kNumParts; ++part) {
      if (wanted[part] == count) words[part] = word;
    }
  }
  return count == header.record_words;
}

Outcome<void> read_ascii(const CloudBytes& file, const PcdHeader& header, PointAppender& points) {
  std::string_view text = file.bytes.substr(header.header_bytes);
  TextPlace place{file.path, header.header_lines};
  std::uint64_t rows = 0;
  while (!text.empty()) {
    const std::string_view row = trimmed(take_line(text));
    ++place.line;
    if (row.empty()) continue;
    if (++rows > header.points) {
      return text_failure(
          place,
          fmt::format("the file has more points than the {} that its header says", header.points),
          "write the right number of POINTS");
    }
    PointAppender::Words words;
    if (!split_row(row, header, words)) {
      return text_failure(place,
                          fmt::format("the row does not have the {} numbers that the header says",
                                      header.record_words),
                          "write the numbers of a point in one row");
    }
    TESSERA_TRY(points.append(words, place));
  }
  if (rows == header.points) return {};
  return cloud_failure(file.path, count_text(rows, header.points),
                       "it is truncated, get a complete copy");
}

/// Places of the parts of a point: in records, or field by field for all points.
struct Layout {
  PointAppender::Places places;
  std::array<std::size_t, kNumParts> strides_bytes{};
};

Layout layout_of(const PcdHeader& header, const char* payload, bool is_by_field) {
  Layout layout;
  for (std::size_t part = 0; part < kNumParts; ++part) {
    const std::size_t index = header.chosen.index(part);
    if (index == PointFields::kAbsent) continue;
    const PcdField& field = header.fields[index];
    const std::uint64_t before = field.offset_bytes * (is_by_field ? header.points : 1);
    layout.places[part] = {field.number, payload + before};
    layout.strides_bytes[part] =
        is_by_field ? field.number.bytes : static_cast<std::size_t>(header.record_bytes);
  }
  return layout;
}

Outcome<void> read_layout(std::string_view path, const PcdHeader& header, Layout layout,
                          PointAppender& points) {
  for (std::uint64_t i = 0; i < header.points; ++i) {
    if (!points.append(layout.places)) return bad_label(path, static_cast<std::size_t>(i));
    for (std::size_t part = 0; part < kNumParts; ++part) {
      if (layout.places[part].from != nullptr)
        layout.places[part].from += layout.strides_bytes[part];
    }
  }
  return {};
}

Outcome<void> read_binary(const CloudBytes& file, const PcdHeader& header, PointAppender& points) {
  const std::string_view payload = file.bytes.substr(header.header_bytes);
  const std::uint64_t fitting = payload.size() / header.record_bytes;
  if (fitting != header.points) {
    return cloud_failure(file.path, count_text(fitting, header.points),
                         "write the right number of POINTS");
  }
  return read_layout(file.path, header, layout_of(header, payload.data(), false), points);
}

Outcome<void> read_compressed(const CloudBytes& file, const PcdHeader& header,
                              PointAppender& points) {
  const std::string_view compressed = file.bytes.substr(
      header.header_bytes + kPcdSizesBytes, static_cast<std::size_t>(header.compressed_bytes));
  // Checked with the header: the file can hold this much.
  std::string payload(static_cast<std::size_t>(header.points * header.record_bytes), '\0');
  if (!decompress_lzf(compressed, payload)) {
    return cloud_failure(file.path, "its compressed points are damaged", "get another copy");
  }
  return read_layout(file.path, header, layout_of(header, payload.data(), true), points);
}

}  // namespace

Outcome<CloudSummary> inspect_pcd(const CloudBytes& head, std::uint64_t file_bytes) {
  TESSERA_TRY_ASSIGN(const PcdHeader header, parse_pcd_header(head, file_bytes));
  return header.summary();
}

Outcome<void> read_pcd(const CloudBytes& file, Cloud& cloud) {
  TESSERA_TRY_ASSIGN(const PcdHeader header, parse_pcd_header(file, file.bytes.size()));
  CloudSummary summary = header.summary();
  summary.keeps_no_returns = file.with_no_returns && header.chosen.has(kPartNoReturn);
  PointAppender points(cloud, summary, header.is_organised);
  if (header.data == PcdData::kAscii) return read_ascii(file, header, points);
  const Outcome<void> read = header.data == PcdData::kBinary
                                 ? read_binary(file, header, points)
                                 : read_compressed(file, header, points);
  if (!read.ok()) return read;
  return points.check_byte_order(file.path);
}

}  // namespace tessera
