// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Voxels as a table, a row each, for other programs: PCD for the Point Cloud Library, NPY for
// numpy, CSV for all others. Rows are written at once; nothing is collected.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/atomic_file.hpp"
#include "base/outcome.hpp"
#include "pictures/ply_stream.hpp"
#include "tessera/base/geometry.hpp"
#include "tessera/semantics/class_table.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {

enum class TableFormat : std::uint8_t {
  kPcd,  ///< Binary, PCD 0.7.
  kNpy,  ///< NPY 1.0, a structured array of one dimension, little-endian.
  kCsv,  ///< The columns of "query".
};

/// Content of the header.
struct TableHead {
  TableFormat format = TableFormat::kPcd;
  std::uint64_t rows = 0;
  int num_components = 0;                      ///< C + 2: number of counts in a row (NPY, CSV).
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

  /// commit() reports a failure to write.
  void put(const TableRow& row);
  /// Fails as AtomicFile::commit(), and with kFailure iff the number of rows differs from the head.
  /// Until then path is unchanged.
  Outcome<void> commit();

 private:
  VoxelTable(AtomicFile file, const TableHead& head) : file_(std::move(file)), head_(head) {}
  void put_header();
  void put_pcd(const TableRow& row);
  void put_npy(const TableRow& row);
  void put_csv(const TableRow& row);

  AtomicFile file_;
  TableHead head_;
  std::string line_;  ///< Kept, to reuse its memory.
  std::uint64_t rows_ = 0;
};

}  // namespace tessera
