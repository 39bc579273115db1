// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The file of kernels by class: [[kernel]] with class, reach_m and height_m.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/outcome.hpp"
#include "settings/setting.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

struct NamedKernel {
  std::string name{};  ///< Of the class.
  double reach_m = 0.8;
  double height_m = 0.24;
};

/// Lengths of a kernel.
inline constexpr Allowed kKernelLengths = from_to(0.001, 1000.0, "metres");
static_assert(static_cast<float>(kKernelLengths.least) == ClassKernel::kLeast_m &&
              static_cast<float>(kKernelLengths.most) == ClassKernel::kMost_m);

inline constexpr Setting kKernelRows[] = {
    row<&NamedKernel::name>({.table = "kernel", .key = "class"}, "name of a class",
                            {.required = "the name of a class"}),
    row<&NamedKernel::reach_m>({.table = "kernel", .key = "reach_m"},
                               "how far its labels reach on x and y, taken as 1.5 to 11 voxels",
                               {.otherwise = "0.8", .allowed = kKernelLengths}),
    row<&NamedKernel::height_m>({.table = "kernel", .key = "height_m"},
                                "how far on z; beyond the next layers of two voxels nothing counts",
                                {.otherwise = "0.24", .allowed = kKernelLengths}),
};
inline constexpr SettingTable<NamedKernel> kKernelSettings{kKernelRows};

/// Fails with kUsage, naming the line, iff the file cannot be read, is no such file, has no kernel
/// or two of one class.
Outcome<std::vector<NamedKernel>> read_kernels(const std::string& path);
/// The file's text.
[[nodiscard]] std::string text_of(const std::vector<NamedKernel>& kernels);

/// The classes with these kernels, by name; those of other classes are left out. Fails with kUsage
/// iff there are kernels and none is of a class. path: of the file, for the message.
Outcome<ClassTable> with_kernels(const ClassTable& classes, const std::vector<NamedKernel>& kernels,
                                 const std::string& path);

}  // namespace tessera
