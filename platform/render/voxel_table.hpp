// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Voxels as a table, a row each, for other people's programs: PCD for the Point Cloud Library, NPY
// for numpy, CSV for all else. Rows are written as they come; nothing is collected.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "posix/atomic_file.hpp"
#include "posix/outcome.hpp"
#include "render/ply_stream.hpp"
#include "tessera/base/geometry.hpp"
#include "tessera/semantics/class_table.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {

enum class TableFormat : std::uint8_t {
  kPcd,  ///< Binary, PCD 0.7.
  kNpy,  ///< NPY 1.0, a structured array of one dimension, little-endian.
  kCsv,  ///< The columns of "query".
};

/// What the header says.
struct TableHead {
  TableFormat format = TableFormat::kPcd;
  std::uint64_t rows = 0;
  int num_components = 0;                      ///< C + 2: how many counts a row has (NPY, CSV).
  bool with_robots = false;                    ///< A last column: robots with a label there.
  std::span<const std::string> label_names{};  ///< Of label 0, 1, ...: comments of PCD.
};

struct TableRow {
  Point3d p_map = Point3d::Zero();  ///< The voxel's centre, metres.
  Estimate estimate;
  const VoxelEvidence* evidence = nullptr;
  Color color{};
  std::uint8_t robots = 0;
};

class VoxelTable {
 public:
  /// Fails as AtomicFile::open().
  static Outcome<VoxelTable> open(const TableHead& head, const std::string& path);

  /// A failure to write is told by commit().
  void put(const TableRow& row);
  /// Fails as AtomicFile::commit(), and with kFailure iff there were not as many rows as the head
  /// says. Until then path is as it was.
  Outcome<void> commit();

 private:
  VoxelTable(AtomicFile file, const TableHead& head) : file_(std::move(file)), head_(head) {}
  void put_header();
  void put_pcd(const TableRow& row);
  void put_npy(const TableRow& row);
  void put_csv(const TableRow& row);

  AtomicFile file_;
  TableHead head_;
  std::string line_;  ///< Kept, so that its memory is.
  std::uint64_t rows_ = 0;
};

}  // namespace tessera
