// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/ply_reader.hpp"

#include <fmt/core.h>

#include <string>

#include "base/number_row.hpp"
#include "scans/ply_header.hpp"
#include "scans/point_fields.hpp"

namespace tessera {
namespace {

/// Names an element and its number, counted from 0.
std::string name_of(const PlyElement& element, std::uint64_t i) {
  return fmt::format("the element {} number {} (from 0)", printable(element.name), i);
}

Failure more_than_promised(std::string_view path) {
  return cloud_failure(path, "it continues after the last element of its header",
                       "write the right number of each element");
}

/// Elements of a binary file, one after the other.
class BinaryReader {
 public:
  BinaryReader(const CloudBytes& file, const PlyHeader& header)
      : path_(file.path), header_(header), rest_(file.bytes.substr(header.header_bytes)) {}

  Outcome<void> read(PointAppender& points) {
    for (const PlyElement& element : header_.elements) {
      if (element.properties.empty()) continue;
      const bool is_vertex = &element == &header_.vertices();
      for (std::uint64_t i = 0; i < element.count; ++i) {
        PointAppender::Places places;
        if (!take(element, places)) {
          return cloud_failure(path_, "it ends within " + name_of(element, i),
                               "it is truncated or of the other byte order, get a complete copy");
        }
        if (is_vertex && !points.append(places))
          return bad_label(path_, static_cast<std::size_t>(i));
      }
    }
    // Less than a vertex is padding.
    if (rest_.size() < header_.vertices().least_bytes(false)) return {};
    return more_than_promised(path_);
  }

 private:
  /// False iff the file ends within the element.
  bool take(const PlyElement& element, PointAppender::Places& places) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (property.is_list) {
        if (!take_list(property)) return false;
        continue;
      }
      if (rest_.size() < property.number.bytes) return false;
      const std::size_t part = header_.chosen.part_of(i);
      if (part < kNumParts) places[part] = {property.number, rest_.data()};
      rest_.remove_prefix(property.number.bytes);
    }
    return true;
  }

  bool take_list(const PlyProperty& property) {
    if (rest_.size() < property.length.bytes) return false;
    std::int64_t length = 0;
    if (!property.length.load_whole(rest_.data(), length) || length < 0) return false;
    rest_.remove_prefix(property.length.bytes);
    // A length has 32 bits at most.
    const std::uint64_t bytes = static_cast<std::uint64_t>(length) * property.number.bytes;
    if (bytes > rest_.size()) return false;
    rest_.remove_prefix(static_cast<std::size_t>(bytes));
    return true;
  }

  std::string_view path_;
  const PlyHeader& header_;
  std::string_view rest_;
};

/// Finds the words of a row that are used; false iff there are fewer or more than the properties
/// need.
bool split_row(std::string_view row, const PlyElement& element, const PointFields& chosen,
               PointAppender::Words& words) {
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const std::string_view word = take_word(row);
    if (word.empty()) return false;
    if (!element.properties[i].is_list) {
      const std::size_t part = chosen.part_of(i);
      if (part < kNumParts) words[part] = word;
      continue;
    }
    std::uint64_t length = 0;
    if (!parse_count(word, length)) return false;
    // Ends with the row, even if the list claims to be longer.
    for (; length > 0; --length) {
      if (take_word(row).empty()) return false;
    }
  }
  return take_word(row).empty();
}

Outcome<void> read_ascii(const CloudBytes& file, const PlyHeader& header, PointAppender& points) {
  std::string_view text = file.bytes.substr(header.header_bytes);
  TextPlace place{file.path, header.header_lines};
  for (const PlyElement& element : header.elements) {
    const bool is_vertex = &element == &header.vertices();
    if (element.properties.empty()) continue;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::string_view row;
      while (row.empty() && !text.empty()) {
        row = trimmed(take_line(text));
        ++place.line;
      }
      if (row.empty()) {
        return cloud_failure(file.path, "it ends before " + name_of(element, i),
                             "it is truncated, get a complete copy");
      }
      PointAppender::Words words;
      if (!split_row(row, element, header.chosen, words)) {
        return text_failure(place, "the row does not have the numbers that the header says",
                            "write the numbers of an element in one row");
      }
      if (!is_vertex) continue;
      TESSERA_TRY(points.append(words, place));
    }
  }
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) return {};
  return more_than_promised(file.path);
}

}  // namespace

Outcome<CloudSummary> inspect_ply(const CloudBytes& head, std::uint64_t file_bytes) {
  TESSERA_TRY_ASSIGN(const PlyHeader header, parse_ply_header(head, file_bytes));
  return header.summary();
}

Outcome<void> read_ply(const CloudBytes& file, Cloud& cloud) {
  TESSERA_TRY_ASSIGN(const PlyHeader header, parse_ply_header(file, file.bytes.size()));
  CloudSummary summary = header.summary();
  summary.keeps_no_returns = file.with_no_returns && header.chosen.has(kPartNoReturn);
  PointAppender points(cloud, summary, false);
  if (header.is_ascii) return read_ascii(file, header, points);
  const Outcome<void> read = BinaryReader(file, header).read(points);
  if (!read.ok()) return read;
  return points.check_byte_order(file.path);
}

}  // namespace tessera
