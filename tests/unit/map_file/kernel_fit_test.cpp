// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Kernels by class, fitted to true labels: what votes amount to is what the mapper makes labels of,
// scores are counted anew, and no other kernel of one class would be better.
#include "maps/kernel_fit.hpp"

#include <catch2/catch.hpp>

#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

constexpr int kClasses = 4;
constexpr std::uint32_t kFolds = 3;

InferenceConfig lattice_of(const ClassKernel& kernel) {
  InferenceConfig config;
  config.mode = InferenceMode::kLattice;
  config.lattice = {.reach_m = kernel.reach_m, .height_m = kernel.height_m};
  config.free_space.enabled = false;
  config.thinning_m = 0.0;
  config.min_range_m = 0.0F;
  return config;
}

Cloud cloud_of(std::uint64_t seed) {
  Random random(announce_seed(seed));
  return random_cloud(random, {.points = 1500, .classes = kClasses, .unlabelled = 0.05});
}

/// Of a place, whatever the labels say: layers, and one class in the upper half.
std::uint8_t truth_at(const Point3f& p) {
  if (p.z() > 0.5F) return 4;
  return static_cast<std::uint8_t>(1 + (static_cast<int>(p.x() * 2.0F + 100.0F) % 3));
}

/// A data set of one cloud; of another truth in one fold: all of its points are of class 2.
FitData data_of(std::uint64_t seed, std::uint32_t other_fold = kFolds) {
  const Cloud cloud = cloud_of(seed);
  Mapper mapper(uncapped_map(0.1), lattice_of({}), kClasses);
  REQUIRE(mapper.integrate(cloud).admitted == cloud.size());
  FitData data{.samples = {}, .classes = numbered_classes(kClasses), .folds = kFolds};
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Point3f p(cloud.xyz[3 * i], cloud.xyz[3 * i + 1], cloud.xyz[3 * i + 2]);
    const auto fold = static_cast<std::uint32_t>(i) % kFolds;
    const std::uint8_t truth = fold == other_fold ? std::uint8_t{2} : truth_at(p);
    data.samples.add_point(mapper.map(), p, truth, fold);
  }
  REQUIRE(data.samples.read_votes(mapper.map()).ok());
  return data;
}

/// Whether two classes have nearly the same votes, so that rounding of counts decides.
bool is_tie(const KernelSamples& samples, const KernelSamples::Octet& octet, std::size_t kernel) {
  float most = 0.0F;
  float second = 0.0F;
  for (const KernelSamples::Votes& votes : samples.votes(octet)) {
    const float sum = votes.sums[kernel];
    second = std::max(second, std::min(sum, most));
    most = std::max(most, sum);
  }
  return second > 0.9999F * most;
}

int label_of(const KernelSamples& samples, const KernelSamples::Octet& octet,
             const std::vector<std::size_t>& kernels) {
  int label = 0;
  float most = 0.0F;
  for (const KernelSamples::Votes& votes : samples.votes(octet)) {
    const float sum = votes.sums[kernels[votes.label - 1U]];
    if (sum > most) label = votes.label;
    most = std::max(most, sum);
  }
  return label;
}

double mean_iou(const FitData& data, const std::vector<std::size_t>& kernels, const FitPart& part) {
  std::array<double, kClasses + 1> right{};
  std::array<double, kClasses + 1> any{};
  std::array<bool, kClasses + 1> present{};
  for (const KernelSamples::Octet& octet : data.samples.octets()) {
    const auto label = static_cast<std::size_t>(label_of(data.samples, octet, kernels));
    for (const KernelSamples::Truth& truth : data.samples.truth(octet)) {
      if (part.set == 0 && (truth.fold == part.fold) != part.alone) continue;
      present[truth.label] = true;
      any[truth.label] += truth.points;
      if (label == truth.label)
        right[label] += truth.points;
      else
        any[label] += truth.points;
    }
  }
  double sum = 0.0;
  int classes = 0;
  for (std::size_t l = 1; l <= kClasses; ++l) {
    if (!present[l]) continue;
    sum += right[l] / any[l];
    ++classes;
  }
  return sum / classes;
}

}  // namespace

TEST_CASE("kernel fit: the grid's kernels are nearest to themselves") {
  for (std::size_t i = 0; i < KernelGrid::kKernels; ++i)
    CHECK(KernelGrid::nearest(KernelGrid::kernel(i)) == i);
  CHECK(KernelGrid::kernel(KernelGrid::nearest({100.0F, 0.001F})) == ClassKernel{1.1F, 0.2F});
}

TEST_CASE("kernel fit: votes amount to what the mapper makes labels of") {
  const FitData data = data_of(11);
  const Cloud cloud = cloud_of(11);
  for (const std::size_t kernel : {std::size_t{0}, std::size_t{9}, KernelGrid::kKernels - 1}) {
    Mapper mapper(uncapped_map(0.1), lattice_of(KernelGrid::kernel(kernel)), kClasses);
    mapper.integrate(cloud);
    // By block and octet, as samples are: all voxels of an octet have its shares.
    std::map<std::pair<std::uint64_t, int>, int> labels;
    KernelSamples octets;
    for (const auto& [place, evidence] : observed_voxels(mapper.map())) {
      const Voxel voxel = place;
      int best = 0;
      float most = 0.0F;
      for (int l = 1; l <= kClasses; ++l) {
        const float count = evidence.sigma[static_cast<std::size_t>(l)];
        if (count > most) best = l;
        most = std::max(most, count);
      }
      if (best == 0) continue;
      const auto coordinate = [&](std::size_t i) { return static_cast<std::int32_t>(voxel[i]); };
      const VoxelCoord at{coordinate(0), coordinate(1), coordinate(2)};
      labels[{pack_in_grid(block_of(at)).bits, octet_in_block(at)}] = best;
      const auto centre = [&](std::size_t i) {
        return 0.1F * (static_cast<float>(voxel[i]) + 0.5F);
      };
      octets.add_point(mapper.map(), {centre(0), centre(1), centre(2)}, 1, 0);
    }
    REQUIRE(octets.read_votes(mapper.map()).ok());
    REQUIRE(octets.octets().size() == labels.size());
    const std::vector<std::size_t> kernels(kClasses, kernel);
    std::size_t i = 0;
    int compared = 0;
    for (const auto& [place, label] : labels) {
      // Where no vote reaches, evidence has the classes of its own points.
      const KernelSamples::Octet& octet = octets.octets()[i++];
      const int found = label_of(octets, octet, kernels);
      if (found == 0 || is_tie(octets, octet, kernel)) continue;
      CHECK(found == label);
      ++compared;
    }
    CHECK(compared > 500);
  }
  CHECK(data.samples.octets().size() > 500);
}

TEST_CASE("kernel fit: scores are mean IoUs over points, of all or of a part") {
  std::vector<FitData> data;
  data.push_back(data_of(21));
  const KernelFit fit(data);
  KernelChoice choice = fit.of_one({});
  choice.kernels = {0, 5, 10, 15};
  for (const FitPart& part : {FitPart{}, FitPart{.set = 0, .fold = 1, .alone = false},
                              FitPart{.set = 0, .fold = 1, .alone = true}}) {
    CHECK(*fit.score(choice, part) == Approx(mean_iou(data[0], choice.kernels, part)));
  }
  CHECK(fit.iou(choice, "class 1") > 0.0);
  CHECK(fit.iou(choice, "tree") < 0.0);
}

TEST_CASE("kernel fit: no other kernel of one class is better, and what is left out has no say") {
  std::vector<FitData> data;
  data.push_back(data_of(31));
  data.push_back(data_of(32));
  const KernelFit fit(data);
  const KernelChoice one = fit.of_one({});
  const KernelChoice fitted = fit.fit(one, {});
  const double reached = *fit.score(fitted, {});
  CHECK(reached > *fit.score(one, {}) + 0.01);
  for (std::size_t name = 0; name < fitted.names.size(); ++name) {
    for (std::size_t kernel = 0; kernel < KernelGrid::kKernels; ++kernel) {
      KernelChoice other = fitted;
      other.kernels[name] = kernel;
      CHECK(*fit.score(other, {}) <= reached + KernelFit::kLeastGain);
    }
  }
  const FitPart rest{.set = 0, .fold = 1, .alone = false};
  std::vector<FitData> changed;
  changed.push_back(data_of(31, 1));
  changed.push_back(data_of(32));
  const KernelFit of_changed(changed);
  CHECK(of_changed.fit(one, rest).kernels == fit.fit(one, rest).kernels);
  CHECK(of_changed.score(one, {}) != fit.score(one, {}));
}

TEST_CASE(
    "kernel fit: a class without truth keeps the kernel of its table, whatever it takes away") {
  // Class 3 is predicted and never true.
  std::vector<FitData> data;
  FitData set = data_of(41);
  Mapper mapper(uncapped_map(0.1), lattice_of({}), kClasses);
  const Cloud cloud = cloud_of(41);
  mapper.integrate(cloud);
  set.samples = {};
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Point3f p(cloud.xyz[3 * i], cloud.xyz[3 * i + 1], cloud.xyz[3 * i + 2]);
    const std::uint8_t truth = truth_at(p);
    set.samples.add_point(mapper.map(), p, truth == 3 ? std::uint8_t{1} : truth, 0);
  }
  REQUIRE(set.samples.read_votes(mapper.map()).ok());
  REQUIRE(set.classes.set_kernel(3, {0.25F, 2.0F}) == Status::kOk);
  data.push_back(std::move(set));
  const KernelFit fit(data);
  const KernelChoice start = fit.start_of({});
  CHECK(start.kernels[0] == KernelGrid::nearest({}));
  CHECK(start.kernels[2] == KernelGrid::nearest({0.25F, 2.0F}));
  const KernelChoice fitted = fit.fit(start, {});
  CHECK(fitted.kernels[2] == start.kernels[2]);
  CHECK(*fit.score(fitted, {}) >= *fit.score(start, {}));
  // A fold that does not exist has no truth.
  CHECK_FALSE(fit.score(fitted, {.set = 0, .fold = 9, .alone = true}).has_value());
}

TEST_CASE("kernel fit: data sets with other tables share the kernels of the same names") {
  std::vector<FitData> data;
  data.push_back(data_of(51));
  FitData other = data_of(52);
  ClassTable renamed;
  for (const char* const name : {"class 2", "class 1", "class 3", "tree"})
    REQUIRE(renamed.add(name, {}) == Status::kOk);
  other.classes = renamed;
  data.push_back(std::move(other));
  const KernelFit fit(data);
  KernelChoice choice = fit.of_one({});
  REQUIRE(choice.names ==
          std::vector<std::string>{"class 1", "class 2", "class 3", "class 4", "tree"});
  choice.kernels = {0, 5, 10, 15, 3};
  const double first = mean_iou(data[0], {0, 5, 10, 15}, {});
  const double second = mean_iou(data[1], {5, 0, 10, 3}, {});
  CHECK(*fit.score(choice, {}) == Approx(0.5 * (first + second)));
}

}  // namespace tessera::oracle
