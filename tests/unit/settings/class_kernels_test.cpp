// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The file of kernels by class.
#include "settings/class_kernels.hpp"

#include <catch2/catch.hpp>

#include "settings/map_options.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

class KernelFile {
 public:
  explicit KernelFile(const std::string& text) { folder_.write("kernels.toml", text); }
  [[nodiscard]] std::string path() const { return folder_.file("kernels.toml"); }
  /// What is wrong with it, without its path.
  [[nodiscard]] std::string refused() const {
    const Outcome<std::vector<NamedKernel>> read = read_kernels(path());
    if (read.ok()) return "";
    const std::string text = read.failure().text();
    const std::size_t at = text.find("kernels.toml");
    return at == std::string::npos ? text : text.substr(at + 12);
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_CASE("kernels: a file has what was written") {
  const std::vector<NamedKernel> kernels{
      {"car", 0.5, 0.24}, {"a \"quoted\" \\ name", 1.0, 0.001}, {"line\nbreak\x7f", 1000.0, 2.0}};
  const KernelFile file("# By hand.\n" + text_of(kernels));
  const Outcome<std::vector<NamedKernel>> read = read_kernels(file.path());
  REQUIRE(read.ok());
  REQUIRE(read->size() == kernels.size());
  for (std::size_t i = 0; i < kernels.size(); ++i) {
    CHECK((*read)[i].name == kernels[i].name);
    CHECK((*read)[i].reach_m == kernels[i].reach_m);
    CHECK((*read)[i].height_m == kernels[i].height_m);
  }
}

TEST_CASE("kernels: what is not given of one is usual") {
  const KernelFile file("[[kernel]]\nclass = \"car\"\nreach_m = 0.5\n");
  const Outcome<std::vector<NamedKernel>> read = read_kernels(file.path());
  REQUIRE(read.ok());
  CHECK((*read)[0].height_m == Approx(0.24));
}

TEST_CASE("kernels: a wrong file is refused with its line") {
  CHECK(KernelFile("").refused() == " has no [[kernel]]; write one for a class");
  CHECK(KernelFile("[[kernel]]\nreach_m = 1.0\n").refused().find("class") != std::string::npos);
  CHECK(KernelFile("[[kernel]]\nclass = \"car\"\nreach_m = 0\n").refused().find(", line 3") == 0);
  CHECK(KernelFile("[[kernel]]\nclass = \"car\"\nheight_m = nan\n").refused().find(", line 3") ==
        0);
  CHECK(KernelFile("[[kernel]]\nclass = \"car\"\nlength = 1\n").refused().find(", line 3") == 0);
  CHECK(KernelFile("[[kernel]]\nclass = \"a\"\n[[kernel]]\nclass = \"a\"\n").refused() ==
        " has two kernels of class 'a'; keep one");
  CHECK(KernelFile("[[kernel]\n").refused().find("not valid TOML") != std::string::npos);
}

TEST_CASE("kernels: they go to the classes of their names, and one has to be of a class") {
  ClassTable classes;
  REQUIRE(classes.add("car", {}) == Status::kOk);
  REQUIRE(classes.add("pole", {}) == Status::kOk);
  const auto with = [&](const std::vector<NamedKernel>& kernels) {
    return with_kernels(classes, kernels, "k.toml");
  };
  REQUIRE(with({}).ok());
  CHECK(with({})->kernel(1) == classes.kernel(1));
  const Outcome<ClassTable> some = with({{"pole", 3.0, 4.0}, {"tree", 1.0, 1.0}});
  REQUIRE(some.ok());
  CHECK(some->kernel(1) == classes.kernel(1));
  CHECK(some->kernel(2) == ClassKernel{3.0F, 4.0F});
  const Outcome<ClassTable> none = with({{"tree", 1.0, 1.0}});
  REQUIRE_FALSE(none.ok());
  CHECK(none.failure().text() ==
        "k.toml has a kernel of no class of these scans, whose first is 'car'; write their names "
        "as classes.toml does");
}

TEST_CASE("set_up: kernels are for the lattice mode, without one length for all") {
  const KernelFile file(text_of({{"car", 0.5, 0.24}}));
  MapOptions options;
  options.inference = InferenceMode::kLattice;
  options.kernels = file.path();
  REQUIRE(set_up(options).ok());
  CHECK(set_up(options)->kernels.size() == 1);
  options.kernel_length_m = 0.5;
  const std::string both =
      "--kernels applies to --inference lattice without --kernel-length; leave out one";
  CHECK(set_up(options).failure().text() == both);
  options.kernel_length_m.reset();
  options.inference = InferenceMode::kMultiEntropy;
  CHECK(set_up(options).failure().text() == both);
  options.inference = InferenceMode::kLattice;
  options.kernels = file.path() + ".missing";
  CHECK_FALSE(set_up(options).ok());
}

}  // namespace
}  // namespace tessera
