// Clouds for PCL: read from a file, cleaned, and measured.
#pragma once

#include <pcl/io/ply_io.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <cmath>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Normals = pcl::PointCloud<pcl::Normal>;

// Distinct finite points of a PLY file, or of a file of bare little-endian f32 triples (any other name).
inline Cloud::Ptr read_cloud(const std::string& path)
{
  Cloud all;
  if (path.size() > 4 && path.substr(path.size() - 4) == ".ply") {
    if (pcl::io::loadPLYFile(path, all) < 0)
      throw std::runtime_error("cannot read " + path);
  }
  else {
    std::ifstream file(path, std::ios::binary);
    if (!file)
      throw std::runtime_error("cannot read " + path);
    float xyz[3];
    while (file.read(reinterpret_cast<char*>(xyz), sizeof xyz))
      all.push_back({xyz[0], xyz[1], xyz[2]});
  }
  Cloud::Ptr cloud(new Cloud);
  std::set<std::tuple<float, float, float>> seen;
  for (const auto& p : all)
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && seen.insert({p.x, p.y, p.z}).second)
      cloud->push_back({p.x, p.y, p.z});
  // One row and no broken points: otherwise PCL would take other ways.
  cloud->width = cloud->size();
  cloud->height = 1;
  cloud->is_dense = true;
  return cloud;
}

// Mean distance from a point to its nearest other point.
inline double resolution(const Cloud::Ptr& cloud)
{
  pcl::search::KdTree<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  double sum = 0.0;
  pcl::Indices found;
  std::vector<float> distances_sq;
  for (int i = 0; i < static_cast<int>(cloud->size()); ++i) {
    tree.nearestKSearch(i, 2, found, distances_sq);
    sum += std::sqrt(static_cast<double>(distances_sq[1]));
  }
  return sum / static_cast<double>(cloud->size());
}
