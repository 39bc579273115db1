// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/ply_header.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "base/number_row.hpp"

namespace tessera {
namespace {

std::optional<StoredNumber> number_type(std::string_view name, bool is_big_endian) {
  struct Type {
    std::string_view name;
    std::string_view sized_name;
    NumberKind kind;
    std::uint8_t bytes;
  };
  static constexpr std::array<Type, 8> kTypes{{{"char", "int8", NumberKind::kSigned, 1},
                                               {"uchar", "uint8", NumberKind::kUnsigned, 1},
                                               {"short", "int16", NumberKind::kSigned, 2},
                                               {"ushort", "uint16", NumberKind::kUnsigned, 2},
                                               {"int", "int32", NumberKind::kSigned, 4},
                                               {"uint", "uint32", NumberKind::kUnsigned, 4},
                                               {"float", "float32", NumberKind::kFloat, 4},
                                               {"double", "float64", NumberKind::kFloat, 8}}};
  for (const Type& type : kTypes) {
    if (name == type.name || name == type.sized_name)
      return StoredNumber{type.kind, type.bytes, is_big_endian};
  }
  return std::nullopt;
}

class PlyHeaderReader {
 public:
  explicit PlyHeaderReader(const CloudBytes& head)
      : head_(head), rest_(head.bytes.substr(0, kMostCloudHeaderBytes)), place_{head.path, 0} {}

  Outcome<PlyHeader> read() {
    const std::size_t all = rest_.size();
    if (!head_.bytes.starts_with("ply\n") && !head_.bytes.starts_with("ply\r\n")) {
      return cloud_failure(head_.path, "its first line is not ply", "check that it is a PLY file");
    }
    while (!rest_.empty() && !header_ended_) {
      std::string_view line = take_line(rest_);
      if (++place_.line == 1) continue;
      const std::string_view keyword = take_word(line);
      TESSERA_TRY(take(keyword, line));
    }
    if (!header_ended_ || !has_format_) {
      return cloud_failure(
          head_.path,
          std::string("its header has no ") + (header_ended_ ? "format line" : "line end_header"),
          "check that it is a PLY file, and complete");
    }
    header_.header_bytes = all - rest_.size();
    header_.header_lines = place_.line;
    TESSERA_TRY(finish());
    return std::move(header_);
  }

 private:
  Failure refusal(std::string_view what, std::string_view remedy) const {
    return text_failure(place_, what, remedy);
  }

  Outcome<void> take(std::string_view keyword, std::string_view line) {
    if (keyword.empty() || keyword == "comment" || keyword == "obj_info") return {};
    if (keyword == "format") return take_format(line);
    if (keyword == "element") return take_element(line);
    if (keyword == "property") return take_property(line);
    if (keyword == "end_header") {
      header_ended_ = true;
      return {};
    }
    return refusal(
        std::string("unknown keyword '").append(printable(keyword)).append("' in the PLY header"),
        "check that it is a PLY file");
  }

  Outcome<void> take_format(std::string_view line) {
    const std::string_view format = take_word(line);
    const std::string_view version = take_word(line);
    // The types of properties depend on it.
    if (has_format_ || !header_.elements.empty())
      return refusal("the format is not in the second line", "write it once, before the elements");
    has_format_ = true;
    header_.is_ascii = format == "ascii";
    is_big_endian_ = format == "binary_big_endian";
    if (version == "1.0" &&
        (header_.is_ascii || is_big_endian_ || format == "binary_little_endian"))
      return {};
    return refusal("the format is not ascii, binary_little_endian or binary_big_endian 1.0",
                   "write the cloud in one of these");
  }

  Outcome<void> take_element(std::string_view line) {
    PlyElement element;
    element.name = take_word(line);
    if (element.name.empty() || !parse_count(take_word(line), element.count))
      return refusal("an element has no name and count", "write: element vertex 1000");
    const auto same = [&](const PlyElement& other) { return other.name == element.name; };
    if (std::any_of(header_.elements.begin(), header_.elements.end(), same))
      return refusal("duplicate element " + printable(element.name),
                     "give each element its own name");
    header_.elements.push_back(std::move(element));
    return {};
  }

  Outcome<void> take_property(std::string_view line) {
    if (header_.elements.empty())
      return refusal("a property is before the first element", "begin with: element vertex 1000");
    PlyProperty property;
    std::string_view type = take_word(line);
    std::optional<StoredNumber> length = StoredNumber{};
    if (type == "list") {
      property.is_list = true;
      length = number_type(take_word(line), is_big_endian_);
      type = take_word(line);
    }
    const std::optional<StoredNumber> number = number_type(type, is_big_endian_);
    property.name = take_word(line);
    if (!number || !length || property.name.empty() || !take_word(line).empty() ||
        (property.is_list && length->kind == NumberKind::kFloat)) {
      return refusal("a property has no type and name",
                     "write: property float x, or: property list uchar int vertex_indices");
    }
    property.number = *number;
    property.length = *length;
    header_.elements.back().properties.push_back(std::move(property));
    return {};
  }

  Outcome<void> finish() {
    const auto is_vertex = [](const PlyElement& element) { return element.name == "vertex"; };
    const auto found = std::find_if(header_.elements.begin(), header_.elements.end(), is_vertex);
    if (found == header_.elements.end())
      return cloud_failure(head_.path, "it has no element vertex",
                           "write the points as element vertex");
    header_.vertex_index = static_cast<std::size_t>(found - header_.elements.begin());
    const PlyElement& vertices = header_.vertices();
    if (vertices.count > kMostCloudPoints) return too_many_points(head_.path, vertices.count);
    std::vector<std::string> names;
    // A list is not a coordinate, whatever its name.
    for (const PlyProperty& property : vertices.properties)
      names.push_back(property.is_list ? std::string() : property.name);
    TESSERA_TRY_ASSIGN(const PointFields chosen, PointFields::choose(head_, names));
    header_.chosen = chosen;
    return {};
  }

  const CloudBytes& head_;
  std::string_view rest_;
  TextPlace place_;
  bool header_ended_ = false;
  bool has_format_ = false;
  bool is_big_endian_ = false;
  PlyHeader header_;
};

}  // namespace

std::uint64_t PlyElement::least_bytes(bool is_ascii) const noexcept {
  std::uint64_t bytes = 0;
  for (const PlyProperty& property : properties)
    bytes += is_ascii ? 2U : property.is_list ? property.length.bytes : property.number.bytes;
  return bytes;
}

CloudSummary PlyHeader::summary() const noexcept {
  return {.points = static_cast<std::size_t>(vertices().count),
          .has_labels = chosen.has(kPartLabel)};
}

Outcome<PlyHeader> parse_ply_header(const CloudBytes& head, std::uint64_t file_bytes) {
  Outcome<PlyHeader> header = PlyHeaderReader(head).read();
  if (!header.ok()) return header.failure();
  // The end of the last line may be missing.
  std::uint64_t left = file_bytes - std::min<std::uint64_t>(file_bytes, header->header_bytes) +
                       (header->is_ascii ? 1U : 0U);
  for (const PlyElement& element : header->elements) {
    const std::uint64_t least = element.least_bytes(header->is_ascii);
    if (least > 0 && element.count > left / least) {
      return cloud_failure(
          head.path,
          fmt::format("its header promises {} of the element {}, but the file is too short",
                      element.count, printable(element.name)),
          "it is truncated, get a complete copy");
    }
    left -= least * element.count;
  }
  return header;
}

}  // namespace tessera
