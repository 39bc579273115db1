// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/voxel_table.hpp"

#include <fmt/core.h>

#include <array>
#include <string_view>
#include <utility>

#include "base/number_text.hpp"

namespace tessera {
namespace {

/// A field of PCD, in the form that PCL reads.
struct PcdField {
  std::string_view name;
  char type;
};
/// PCL has colours as the bits of a float, 0x00rrggbb, and labels as 32 bits.
constexpr std::array<PcdField, 10> kPcdFields{{{"x", 'F'},
                                               {"y", 'F'},
                                               {"z", 'F'},
                                               {"rgb", 'F'},
                                               {"label", 'U'},
                                               {"probability", 'F'},
                                               {"variance", 'F'},
                                               {"evidence", 'F'},
                                               {"state", 'U'},
                                               {"robots", 'U'}}};

std::string pcd_header(const TableHead& head) {
  std::string text =
      "# .PCD v0.7 - Point Cloud Data file format\n"
      "# voxels of a tessera map: centres, metres, map frame; state 1 free, 2 occupied\n";
  for (std::size_t label = 0; label < head.label_names.size(); ++label) {
    if (head.label_names[label].empty()) continue;
    text += fmt::format("# label {} {}\n", label, one_line(head.label_names[label]));
  }
  const std::size_t fields = kPcdFields.size() - (head.with_robots ? 0U : 1U);
  std::string names = "FIELDS";
  std::string sizes = "\nSIZE";
  std::string types = "\nTYPE";
  std::string counts = "\nCOUNT";
  for (std::size_t i = 0; i < fields; ++i) {
    names += ' ' + std::string(kPcdFields[i].name);
    sizes += " 4";
    types += {' ', kPcdFields[i].type};
    counts += " 1";
  }
  const std::string rows = std::to_string(head.rows);
  return text + "VERSION 0.7\n" + names + sizes + types + counts + "\nWIDTH " + rows +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + rows + "\nDATA binary\n";
}

std::string npy_header(const TableHead& head) {
  std::string text = "{'descr': [";
  for (const char* const name : {"x", "y", "z"}) text += std::string("('") + name + "', '<f4'), ";
  for (const char* const name : {"red", "green", "blue", "label", "state"})
    text += std::string("('") + name + "', '|u1'), ";
  for (const char* const name : {"probability", "variance", "evidence"})
    text += std::string("('") + name + "', '<f4'), ";
  text += fmt::format("('sigma', '<f4', ({},))", head.num_components);
  if (head.with_robots) text += ", ('robots', '|u1')";
  text += fmt::format("], 'fortran_order': False, 'shape': ({},), }}", head.rows);
  // Magic, version, length and text together are a multiple of 64 bytes, the last a line's end.
  constexpr std::size_t kBefore = 10;
  while ((kBefore + text.size() + 1) % 64 != 0) text += ' ';
  text += '\n';
  const auto low = static_cast<char>(text.size() & 0xFFU);
  const auto high = static_cast<char>(text.size() >> 8U);
  return std::string("\x93NUMPY\x01", 7) + std::string(1, '\0') + low + high + text;
}

std::string csv_header(const TableHead& head) {
  std::string text = "x,y,z,state,label,probability,variance,evidence";
  for (int l = 0; l < head.num_components; ++l) text += fmt::format(",sigma_{}", l);
  return text + (head.with_robots ? ",robots\n" : "\n");
}

void add_number(std::string& line, double value) { line.append(nine_digits(value)).push_back(','); }

std::uint8_t byte_of(VoxelState state) { return static_cast<std::uint8_t>(state); }

}  // namespace

Outcome<VoxelTable> VoxelTable::open(const TableHead& head, const std::string& path) {
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  VoxelTable table(std::move(file), head);
  table.put_header();
  return table;
}

void VoxelTable::put_header() {
  const std::string text = head_.format == TableFormat::kPcd   ? pcd_header(head_)
                           : head_.format == TableFormat::kNpy ? npy_header(head_)
                                                               : csv_header(head_);
  file_.write(std::as_bytes(std::span(text)));
}

void VoxelTable::put(const TableRow& row) {
  ++rows_;
  if (head_.format == TableFormat::kPcd) put_pcd(row);
  if (head_.format == TableFormat::kNpy) put_npy(row);
  if (head_.format == TableFormat::kCsv) put_csv(row);
}

void VoxelTable::put_pcd(const TableRow& row) {
  PlyStream stream(file_);
  for (const double value : row.p_map) stream.put(static_cast<float>(value));
  stream.put(std::uint32_t{row.color.r} << 16U | std::uint32_t{row.color.g} << 8U | row.color.b);
  stream.put(static_cast<std::uint32_t>(row.estimate.label));
  stream.put(static_cast<float>(row.estimate.probability));
  stream.put(static_cast<float>(row.estimate.variance));
  stream.put(static_cast<float>(row.estimate.evidence));
  stream.put(std::uint32_t{byte_of(row.estimate.state)});
  if (head_.with_robots) stream.put(std::uint32_t{row.robots});
  stream.end_element();
}

void VoxelTable::put_npy(const TableRow& row) {
  PlyStream stream(file_);
  for (const double value : row.p_map) stream.put(static_cast<float>(value));
  stream.put(row.color.r);
  stream.put(row.color.g);
  stream.put(row.color.b);
  stream.put(static_cast<std::uint8_t>(row.estimate.label));
  stream.put(byte_of(row.estimate.state));
  stream.put(static_cast<float>(row.estimate.probability));
  stream.put(static_cast<float>(row.estimate.variance));
  stream.put(static_cast<float>(row.estimate.evidence));
  for (std::size_t l = 0; l < static_cast<std::size_t>(head_.num_components); ++l)
    stream.put(row.evidence->sigma[l]);
  if (head_.with_robots) stream.put(row.robots);
  stream.end_element();
}

void VoxelTable::put_csv(const TableRow& row) {
  line_.clear();
  for (const double value : row.p_map) add_number(line_, value);
  line_ += to_string(row.estimate.state);
  line_ += fmt::format(",{},", row.estimate.label);
  add_number(line_, row.estimate.probability);
  add_number(line_, row.estimate.variance);
  add_number(line_, row.estimate.evidence);
  for (std::size_t l = 0; l < static_cast<std::size_t>(head_.num_components); ++l)
    add_number(line_, static_cast<double>(row.evidence->sigma[l]));
  if (head_.with_robots)
    line_ += fmt::format("{}\n", row.robots);
  else
    line_.back() = '\n';
  file_.write(std::as_bytes(std::span(line_)));
}

Outcome<void> VoxelTable::commit() {
  if (rows_ != head_.rows) {
    return Failure{file_.path() + " would have another number of rows than its header says",
                   FailureKind::kFailure};
  }
  return file_.commit();
}

}  // namespace tessera
