// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// pcl_pair A.xyz B.xyz T: the transform between two clouds of float32 x, y, z, of which B is moved
// by T, 16 numbers, first; by what PCL has. A line a method: its name, seconds of CPU, whether it
// says that it found one, the share of B's points with one of A within 0.3 m, and T_a_b, 16
// numbers. others.py compiles and calls it.
#include <pcl/common/transforms.h>
#include <pcl/features/fpfh.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/sample_consensus_prerejective.h>

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <limits>
#include <string>

namespace {

using Point = pcl::PointNormal;
using Cloud = pcl::PointCloud<Point>;
using Features = pcl::PointCloud<pcl::FPFHSignature33>;

// As PCL's tutorial on aligning objects has them by the size of a cell, for cells of 0.3 m.
constexpr float kCell_m = 0.3F;
constexpr double kNormals_m = 0.75;
constexpr double kFeatures_m = 1.5;
constexpr double kNear_m = 1.5 * 0.3;
constexpr double kPartner_m = 0.3;
constexpr int kDraws = 50000;
constexpr unsigned kSeed = 1;

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Cloud::Ptr read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  Cloud::Ptr points(new Cloud);
  float xyz[3];
  while (file.read(reinterpret_cast<char*>(xyz), sizeof xyz)) {
    Point point;
    point.x = xyz[0];
    point.y = xyz[1];
    point.z = xyz[2];
    points->push_back(point);
  }
  if (points->empty()) {
    std::cerr << "pcl_pair: " << path << " has no points\n";
    std::exit(1);
  }
  return points;
}

Cloud::Ptr with_normals(const Cloud::Ptr& all) {
  Cloud::Ptr points(new Cloud);
  pcl::VoxelGrid<Point> grid;
  grid.setLeafSize(kCell_m, kCell_m, kCell_m);
  grid.setInputCloud(all);
  grid.filter(*points);
  pcl::NormalEstimation<Point, Point> normals;
  normals.setRadiusSearch(kNormals_m);
  normals.setInputCloud(points);
  normals.compute(*points);
  Cloud::Ptr kept(new Cloud);
  for (const Point& point : *points) {
    if (std::isfinite(point.normal_x)) kept->push_back(point);
  }
  return kept;
}

Features::Ptr features_of(const Cloud::Ptr& points) {
  Features::Ptr features(new Features);
  pcl::FPFHEstimation<Point, Point, pcl::FPFHSignature33> estimation;
  estimation.setRadiusSearch(kFeatures_m);
  estimation.setInputCloud(points);
  estimation.setInputNormals(points);
  estimation.compute(*features);
  return features;
}

double share_near(const Cloud::Ptr& a, const Cloud::Ptr& b, const Eigen::Matrix4f& T_a_b) {
  if (!T_a_b.allFinite()) return 0.0;
  Cloud moved;
  pcl::transformPointCloud(*b, moved, T_a_b);
  pcl::search::KdTree<Point> tree;
  tree.setInputCloud(a);
  std::size_t near = 0;
  pcl::Indices index(1);
  std::vector<float> squared(1);
  for (const Point& point : moved) {
    if (tree.nearestKSearch(point, 1, index, squared) > 0 && squared[0] <= kPartner_m * kPartner_m)
      ++near;
  }
  return static_cast<double>(near) / static_cast<double>(moved.size());
}

void print(const char* name, double used_s, bool found, double share,
           const Eigen::Matrix4f& T_a_b) {
  std::cout << name << ' ' << used_s << ' ' << found << ' ' << share;
  std::cout.precision(9);
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) std::cout << ' ' << T_a_b(row, column);
  }
  std::cout << '\n' << std::flush;
}

template <class Registration>
Eigen::Matrix4f refine(Registration& registration, const Cloud::Ptr& a, const Cloud::Ptr& b,
                       double within_m, const Eigen::Matrix4f& first, bool& found) {
  registration.setInputSource(b);
  registration.setInputTarget(a);
  registration.setMaxCorrespondenceDistance(within_m);
  registration.setMaximumIterations(100);
  registration.setTransformationEpsilon(1e-8);
  Cloud moved;
  registration.align(moved, first);
  found = found && registration.hasConverged();
  return registration.getFinalTransformation();
}

using PlaneIcp = pcl::IterativeClosestPointWithNormals<Point, Point>;
using Gicp = pcl::GeneralizedIterativeClosestPoint<Point, Point>;

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 + 16) return 2;
  Eigen::Matrix4f T_moved;
  for (int i = 0; i < 16; ++i) T_moved(i / 4, i % 4) = std::strtof(argv[3 + i], nullptr);
  const Cloud::Ptr all_a = read(argv[1]);
  const Cloud::Ptr all_b = read(argv[2]);
  pcl::transformPointCloud(*all_b, *all_b, T_moved);
  double since = cpu_s();
  const Cloud::Ptr a = with_normals(all_a);
  const Cloud::Ptr b = with_normals(all_b);
  const double thinned_s = cpu_s() - since;
  const auto one = [&](const char* name, auto& registration) {
    since = cpu_s();
    bool found = true;
    const Eigen::Matrix4f T = refine(registration, a, b, 5.0, Eigen::Matrix4f::Identity(), found);
    print(name, thinned_s + cpu_s() - since, found, share_near(a, b, T), T);
  };
  PlaneIcp plane;
  one("icp", plane);
  Gicp gicp;
  one("gicp", gicp);

  since = cpu_s();
  std::srand(kSeed);
  pcl::SampleConsensusPrerejective<Point, Point, pcl::FPFHSignature33> consensus;
  consensus.setInputSource(b);
  consensus.setSourceFeatures(features_of(b));
  consensus.setInputTarget(a);
  consensus.setTargetFeatures(features_of(a));
  consensus.setMaximumIterations(kDraws);
  consensus.setNumberOfSamples(3);
  consensus.setCorrespondenceRandomness(5);
  consensus.setSimilarityThreshold(0.9F);
  consensus.setMaxCorrespondenceDistance(kNear_m);
  consensus.setInlierFraction(0.25F);
  Cloud moved;
  consensus.align(moved);
  bool found = consensus.hasConverged();
  Eigen::Matrix4f T = consensus.getFinalTransformation();
  if (found) {
    Gicp last;
    T = refine(last, a, b, 2.0 * kNear_m, T, found);
  }
  print("fpfh", thinned_s + cpu_s() - since, found, share_near(a, b, T), T);
  return 0;
}
