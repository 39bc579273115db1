// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/pcd_header.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "base/number_row.hpp"
#include "scans/lzf.hpp"

namespace tessera {
namespace {

using Words = std::vector<std::string_view>;

/// The lines of a header by their keywords.
class PcdHeaderReader {
 public:
  explicit PcdHeaderReader(const CloudBytes& head)
      : head_(head), rest_(head.bytes.substr(0, kMostCloudHeaderBytes)), place_{head.path, 0} {}

  Outcome<PcdHeader> read() {
    const std::size_t all = rest_.size();
    while (!rest_.empty() && !header_ended_) {
      std::string_view line = take_line(rest_);
      ++place_.line;
      const std::string_view keyword = take_word(line);
      if (keyword.empty() || keyword.front() == '#') continue;
      Words words;
      for (std::string_view word = take_word(line); !word.empty(); word = take_word(line))
        words.push_back(word);
      TESSERA_TRY(take(keyword, words));
    }
    if (!header_ended_) {
      return cloud_failure(head_.path, "its header has no DATA line",
                           "check that it is a PCD file, and complete");
    }
    header_.header_bytes = all - rest_.size();
    header_.header_lines = place_.line;
    TESSERA_TRY(finish_fields());
    TESSERA_TRY(finish_points());
    return std::move(header_);
  }

 private:
  Failure refusal(std::string_view what, std::string_view remedy) const {
    return text_failure(place_, what, remedy);
  }

  Outcome<void> take(std::string_view keyword, const Words& words) {
    const Outcome<void> taken = take_known(keyword, words);
    has_keyword_ = true;
    return taken;
  }

  Outcome<void> take_known(std::string_view keyword, const Words& words) {
    if (keyword == "VERSION") return {};
    if (keyword == "FIELDS" || keyword == "COLUMNS") return keep(names_, keyword, words);
    if (keyword == "SIZE") return keep(sizes_, keyword, words);
    if (keyword == "TYPE") return keep(types_, keyword, words);
    if (keyword == "COUNT") return keep(counts_, keyword, words);
    if (keyword == "WIDTH") return take_number(width_, keyword, words);
    if (keyword == "HEIGHT") return take_number(height_, keyword, words);
    if (keyword == "POINTS") return take_number(points_, keyword, words);
    if (keyword == "VIEWPOINT") return take_viewpoint(words);
    if (keyword == "DATA") return take_data(words);
    // A file of another kind may contain something private, so the message does not quote it.
    if (!has_keyword_)
      return refusal("it does not begin as a PCD file does", "check that it is a PCD file");
    return refusal(
        std::string("unknown keyword '").append(printable(keyword)).append("' in the PCD header"),
        "check that it is a PCD file");
  }

  Outcome<void> keep(Words& into, std::string_view keyword, const Words& words) const {
    const std::string name(keyword);
    if (!into.empty()) return refusal("duplicate " + name, "keep one of them");
    if (words.empty()) return refusal(name + " has no values", "give one for each field");
    into = words;
    return {};
  }

  Outcome<void> take_number(std::optional<std::uint64_t>& into, std::string_view keyword,
                            const Words& words) const {
    std::uint64_t value = 0;
    if (into) return refusal("duplicate " + std::string(keyword), "keep one of them");
    if (words.size() != 1 || !parse_count(words[0], value)) {
      return refusal(std::string(keyword) + " is not one whole number", "write how many there are");
    }
    into = value;
    return {};
  }

  Outcome<void> take_viewpoint(const Words& words) {
    constexpr std::array<double, 7> kIdentity{0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0};
    bool is_fine = words.size() == kIdentity.size();
    for (std::size_t i = 0; is_fine && i < words.size(); ++i) {
      double value = 0.0;
      is_fine = parse_double(words[i], value) && std::isfinite(value);
      if (std::abs(value - kIdentity[i]) > 1e-9) header_.has_viewpoint = true;
    }
    if (is_fine) return {};
    return refusal("VIEWPOINT is not seven finite numbers", "write tx ty tz qw qx qy qz");
  }

  Outcome<void> take_data(const Words& words) {
    const std::string_view kind = words.size() == 1 ? words[0] : std::string_view();
    header_ended_ = true;
    if (kind == "ascii") header_.data = PcdData::kAscii;
    if (kind == "binary") header_.data = PcdData::kBinary;
    if (kind == "binary_compressed") header_.data = PcdData::kCompressed;
    if (kind == "ascii" || kind == "binary" || kind == "binary_compressed") return {};
    return refusal("DATA is not ascii, binary or binary_compressed",
                   "write the cloud in one of these");
  }

  Outcome<void> finish_fields() {
    for (const auto& [keyword, values] :
         {std::pair{"SIZE", &sizes_}, std::pair{"TYPE", &types_}, std::pair{"COUNT", &counts_}}) {
      if (values->size() == names_.size() || (values == &counts_ && counts_.empty())) continue;
      return cloud_failure(
          head_.path,
          fmt::format("{} has {} values for {} fields", keyword, values->size(), names_.size()),
          "give one for each of FIELDS");
    }
    std::vector<std::string> names;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      TESSERA_TRY(add_field(i));
      names.emplace_back(names_[i]);
    }
    TESSERA_TRY_ASSIGN(const PointFields chosen, PointFields::choose(head_, names));
    header_.chosen = chosen;
    for (std::size_t part = 0; part < kNumParts; ++part) {
      const std::size_t index = chosen.index(part);
      if (index == PointFields::kAbsent || header_.fields[index].count == 1) continue;
      return cloud_failure(head_.path,
                           "the field " + names[index] + " does not have one number per point",
                           "write COUNT 1 for it");
    }
    return {};
  }

  Outcome<void> add_field(std::size_t i) {
    PcdField field;
    std::uint64_t size = 0;
    const bool is_size = parse_count(sizes_[i], size) && size <= 8 && (size & (size - 1)) == 0;
    const std::string_view type = types_[i];
    if (type == "I") field.number.kind = NumberKind::kSigned;
    if (type == "U") field.number.kind = NumberKind::kUnsigned;
    if (!is_size || size < (type == "F" ? 4U : 1U) || (type != "I" && type != "U" && type != "F")) {
      return cloud_failure(
          head_.path,
          "TYPE " + printable(type) + " of SIZE " + printable(sizes_[i]) + " is not a number type",
          "PCD has I and U of 1, 2, 4 or 8 bytes and F of 4 or 8");
    }
    field.number.bytes = static_cast<std::uint8_t>(size);
    if (!counts_.empty() &&
        (!parse_count(counts_[i], field.count) || field.count > PcdHeader::kMostRecordBytes)) {
      return cloud_failure(head_.path, fmt::format("COUNT of field {} is invalid", i + 1),
                           "write how many numbers the field has");
    }
    field.offset_bytes = header_.record_bytes;
    field.offset_words = header_.record_words;
    header_.record_bytes += size * field.count;
    header_.record_words += field.count;
    header_.fields.push_back(field);
    if (header_.record_bytes <= PcdHeader::kMostRecordBytes) return {};
    return cloud_failure(head_.path, "a point takes more than 1 MiB", "write fewer fields");
  }

  Outcome<void> finish_points() {
    if (!points_ && !(width_ && height_)) {
      return cloud_failure(head_.path, "its header has neither POINTS nor WIDTH and HEIGHT",
                           "write how many points there are");
    }
    // Each is bounded first, so that the product is bounded.
    for (const std::optional<std::uint64_t>& value : {points_, width_, height_}) {
      if (value && *value > kMostCloudPoints) return too_many_points(head_.path, *value);
    }
    header_.points = points_.value_or(width_.value_or(0) * height_.value_or(0));
    if (header_.points > kMostCloudPoints) return too_many_points(head_.path, header_.points);
    if (width_ && height_ && *width_ * *height_ != header_.points) {
      return cloud_failure(head_.path,
                           fmt::format("POINTS is {}, but WIDTH times HEIGHT is {}", header_.points,
                                       *width_ * *height_),
                           "write the same in both");
    }
    header_.is_organised = height_.value_or(1) > 1;
    return {};
  }

  const CloudBytes& head_;
  std::string_view rest_;
  TextPlace place_;
  bool header_ended_ = false;
  bool has_keyword_ = false;  ///< A keyword of PCD was found.
  PcdHeader header_;
  Words names_;
  Words sizes_;
  Words types_;
  Words counts_;
  std::optional<std::uint64_t> width_;
  std::optional<std::uint64_t> height_;
  std::optional<std::uint64_t> points_;
};

Failure truncated(std::string_view path, const PcdHeader& header, std::uint64_t payload_bytes) {
  return cloud_failure(
      path,
      fmt::format("its header promises {} points, which do not fit into the {} bytes after it",
                  header.points, payload_bytes),
      "it is truncated, get a complete copy");
}

/// The two sizes before compressed points.
Outcome<void> check_compressed(const CloudBytes& head, std::uint64_t payload_bytes,
                               PcdHeader& header) {
  constexpr StoredNumber kSize{NumberKind::kUnsigned, 4, false};
  if (head.bytes.size() < header.header_bytes + kPcdSizesBytes)
    return truncated(head.path, header, payload_bytes);
  const char* const sizes = head.bytes.data() + header.header_bytes;
  header.compressed_bytes = static_cast<std::uint64_t>(kSize.load(sizes));
  const auto promised = static_cast<std::uint64_t>(kSize.load(sizes + 4));
  if (header.compressed_bytes > payload_bytes - kPcdSizesBytes) {
    return cloud_failure(head.path,
                         fmt::format("its compressed points have {} bytes, but the file has {}",
                                     header.compressed_bytes, payload_bytes - kPcdSizesBytes),
                         "it is truncated or has the other byte order, get a complete copy");
  }
  const std::uint64_t needed = header.points * header.record_bytes;
  const std::uint64_t in_all = needed + header.points * kScanPointBytes;
  if (in_all > PcdHeader::kMostUnpackedBytes) {
    return cloud_failure(
        head.path,
        fmt::format("its compressed points take {} MiB, unpacked and as a scan, the limit is {}",
                    in_all >> 20U, PcdHeader::kMostUnpackedBytes >> 20U),
        "write them uncompressed, or fewer fields");
  }
  if (promised == needed) {
    if (needed <= lzf_most_bytes(header.compressed_bytes)) return {};
    return cloud_failure(head.path,
                         fmt::format("{} compressed bytes cannot become the {} of its points",
                                     header.compressed_bytes, needed),
                         "it is damaged, write it again");
  }
  return cloud_failure(
      head.path,
      fmt::format("{} compressed bytes claim to become {}, but the header's {} points take {}",
                  header.compressed_bytes, promised, header.points, needed),
      "it is damaged, write it again");
}

Outcome<void> check_size(const CloudBytes& head, std::uint64_t file_bytes, PcdHeader& header) {
  const std::uint64_t payload_bytes =
      file_bytes - std::min<std::uint64_t>(file_bytes, header.header_bytes);
  switch (header.data) {
    case PcdData::kAscii:
      // At least a digit and a blank for each number; the end of the last line may be missing.
      if (header.points * 2 * header.record_words > payload_bytes + 1)
        return truncated(head.path, header, payload_bytes);
      return {};
    case PcdData::kBinary:
      if (header.points * header.record_bytes > payload_bytes)
        return truncated(head.path, header, payload_bytes);
      return {};
    case PcdData::kCompressed:
      return check_compressed(head, payload_bytes, header);
  }
  return {};
}

}  // namespace

CloudSummary PcdHeader::summary() const noexcept {
  return {.points = static_cast<std::size_t>(points),
          .has_labels = chosen.has(kPartLabel),
          .has_viewpoint = has_viewpoint};
}

Outcome<PcdHeader> parse_pcd_header(const CloudBytes& head, std::uint64_t file_bytes) {
  Outcome<PcdHeader> header = PcdHeaderReader(head).read();
  if (!header.ok()) return header.failure();
  TESSERA_TRY(check_size(head, file_bytes, *header));
  return header;
}

}  // namespace tessera
