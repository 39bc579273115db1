// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/class_kernels.hpp"

#include <fmt/core.h>

#include "base/input_file.hpp"
#include "settings/config_file.hpp"

namespace tessera {

Outcome<std::vector<NamedKernel>> read_kernels(const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 16U;
  TESSERA_TRY_ASSIGN(const std::string text, read_text_file(path, kMostBytes));
  TESSERA_TRY_ASSIGN(ConfigFile file, ConfigFile::parse(text, path));
  std::vector<NamedKernel> kernels;
  file.read_all(kKernelSettings, kernels);
  TESSERA_TRY(file.finish());
  if (kernels.empty()) return Failure{path + " has no [[kernel]]; write one for a class"};
  for (std::size_t i = 0; i < kernels.size(); ++i) {
    for (std::size_t earlier = 0; earlier < i; ++earlier) {
      if (kernels[i].name == kernels[earlier].name)
        return Failure{path + " has two kernels of class '" + kernels[i].name + "'; keep one"};
    }
  }
  return kernels;
}

std::string text_of(const std::vector<NamedKernel>& kernels) {
  std::string text;
  for (const NamedKernel& kernel : kernels) {
    std::string name;
    for (const char c : kernel.name) {
      if (static_cast<unsigned char>(c) < 0x20 || c == '\x7f') {
        name += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
        continue;
      }
      if (c == '"' || c == '\\') name += '\\';
      name += c;
    }
    text += fmt::format("[[kernel]]\nclass = \"{}\"\nreach_m = {:.4g}\nheight_m = {:.4g}\n\n", name,
                        kernel.reach_m, kernel.height_m);
  }
  if (!text.empty()) text.pop_back();
  return text;
}

Outcome<ClassTable> with_kernels(const ClassTable& classes, const std::vector<NamedKernel>& kernels,
                                 const std::string& path) {
  ClassTable table = classes;
  bool any = kernels.empty();
  for (int label = 1; label <= table.num_classes(); ++label) {
    for (const NamedKernel& kernel : kernels) {
      if (kernel.name != table[label].name_view()) continue;
      any = true;
      static_cast<void>(table.set_kernel(
          label, {static_cast<float>(kernel.reach_m), static_cast<float>(kernel.height_m)}));
    }
  }
  if (any) return table;
  return Failure{path + " has a kernel of no class of these scans, whose first is '" +
                 std::string(table[1].name_view()) + "'; write their names as classes.toml does"};
}

}  // namespace tessera
