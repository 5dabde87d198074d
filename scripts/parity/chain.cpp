// PCL's own registration of two scans, stage by stage with the parameters of configs/paper.toml: voxel grid 2 pr, Harris
// keypoints 2 pr, normals from 50 neighbours, SHOT 15 pr, best 30 % by Lowe's ratio, RANSAC by inlier count.
//
//     chain SOURCE.ply TARGET.ply [fixed]
//
// Prints {"target_from_source": 4x4 row-major, ...}. PCL's RANSAC stops when it is 99 % sure to have seen a clean sample;
// with `fixed` it goes through all 1000 iterations.

#include "cloud.h"

#include <pcl/features/normal_3d.h>
#include <pcl/features/shot.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/keypoints/harris_3d.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_registration.h>

#include <algorithm>
#include <iomanip>
#include <iostream>
#include <numeric>
#include <sstream>

namespace {

constexpr int ITERATIONS = 1000;
constexpr std::size_t SUPPORT = 10;
constexpr std::size_t MIN_MATCHES = 3;

struct Described {
  Cloud keypoints;
  pcl::PointCloud<pcl::SHOT352> rows;
};

struct Match {
  double score;
  int source;
  int target;
};

Cloud::Ptr thinned(const Cloud::Ptr& cloud, double leaf)
{
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(cloud);
  grid.setLeafSize(static_cast<float>(leaf), static_cast<float>(leaf), static_cast<float>(leaf));
  Cloud::Ptr out(new Cloud);
  grid.filter(*out);
  return out;
}

pcl::IndicesPtr keypoints(const Cloud::Ptr& cloud, double pr)
{
  pcl::HarrisKeypoint3D<pcl::PointXYZ, pcl::PointXYZI> detector;
  detector.setNumberOfThreads(1);
  detector.setInputCloud(cloud);
  detector.setRadius(static_cast<float>(2.0 * pr));
  detector.setThreshold(0.0F);
  detector.setNonMaxSupression(true);
  detector.setRefine(false);
  pcl::PointCloud<pcl::PointXYZI> found;
  detector.compute(found);

  pcl::search::KdTree<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  pcl::IndicesPtr supported(new pcl::Indices);
  pcl::Indices near;
  std::vector<float> distances_sq;
  for (int i : detector.getKeypointsIndices()->indices)
    if (tree.radiusSearch(i, 15.0 * pr, near, distances_sq, SUPPORT) >= static_cast<int>(SUPPORT))
      supported->push_back(i);
  return supported;
}

Described describe(const Cloud::Ptr& cloud, double pr)
{
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> normal_estimation;
  normal_estimation.setInputCloud(cloud);
  normal_estimation.setKSearch(50);
  Normals::Ptr normals(new Normals);
  normal_estimation.compute(*normals);

  const pcl::IndicesPtr indices = keypoints(cloud, pr);
  pcl::SHOTEstimation<pcl::PointXYZ, pcl::Normal, pcl::SHOT352> estimation;
  estimation.setInputCloud(cloud);
  estimation.setIndices(indices);
  estimation.setInputNormals(normals);
  estimation.setRadiusSearch(15.0 * pr);
  pcl::PointCloud<pcl::SHOT352> rows;
  estimation.compute(rows);

  Described described;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (std::isfinite(rows[i].descriptor[0])) {
      described.rows.push_back(rows[i]);
      described.keypoints.push_back((*cloud)[(*indices)[i]]);
    }
  }
  return described;
}

// Exact nearest and second nearest; the best 30 % by 1 - d1/d2.
std::vector<Match> matches(const Described& source, const Described& target)
{
  using Row = Eigen::Map<const Eigen::Matrix<float, 352, 1>>;
  std::vector<Match> all;
  for (std::size_t i = 0; i < source.rows.size(); ++i) {
    float first = std::numeric_limits<float>::infinity();
    float second = first;
    int nearest = -1;
    for (std::size_t j = 0; j < target.rows.size(); ++j) {
      const float d = (Row(source.rows[i].descriptor) - Row(target.rows[j].descriptor)).squaredNorm();
      if (d < first) {
        second = first;
        first = d;
        nearest = static_cast<int>(j);
      }
      else if (d < second) {
        second = d;
      }
    }
    if (std::isfinite(second) && second > 1e-12F)
      all.push_back({1.0 - std::sqrt(static_cast<double>(first) / second), static_cast<int>(i), nearest});
  }
  std::stable_sort(all.begin(), all.end(), [](const Match& a, const Match& b) { return a.score > b.score; });
  all.resize(std::min(all.size(), std::max(MIN_MATCHES, all.size() * 3 / 10)));
  return all;
}

// Row-major; the identity where there is no answer. `n_inliers` is 0 then.
Eigen::Matrix4f ransac(const Described& source, const Described& target, const std::vector<Match>& matches,
                       double threshold, bool fixed, std::size_t& n_inliers)
{
  using Model = pcl::SampleConsensusModelRegistration<pcl::PointXYZ>;
  n_inliers = 0;
  if (matches.size() < MIN_MATCHES)
    return Eigen::Matrix4f::Identity();
  // One point for each match on both sides: several matches may share a target point.
  Cloud::Ptr from(new Cloud);
  Cloud::Ptr to(new Cloud);
  for (const Match& match : matches) {
    from->push_back(source.keypoints[match.source]);
    to->push_back(target.keypoints[match.target]);
  }
  Model::Ptr model(new Model(from));
  model->setInputTarget(to);
  pcl::RandomSampleConsensus<pcl::PointXYZ> consensus(model, threshold);
  consensus.setMaxIterations(ITERATIONS);
  // log(1 - 1) asks for ever more iterations, so that the maximum decides.
  consensus.setProbability(fixed ? 1.0 : 0.99);
  if (!consensus.computeModel())
    return Eigen::Matrix4f::Identity();
  Eigen::VectorXf coefficients;
  consensus.getModelCoefficients(coefficients);
  pcl::Indices inliers;
  consensus.getInliers(inliers);
  n_inliers = inliers.size();
  return Eigen::Map<Eigen::Matrix<float, 4, 4, Eigen::RowMajor>>(coefficients.data());
}

void run(const std::string& source_path, const std::string& target_path, bool fixed)
{
  const Cloud::Ptr source_full = read_cloud(source_path);
  const Cloud::Ptr target_full = read_cloud(target_path);
  const double leaf = resolution(source_full) + resolution(target_full); // 2 pr, pr being the mean of both
  const Cloud::Ptr source = thinned(source_full, leaf);
  const Cloud::Ptr target = thinned(target_full, leaf);
  const double pr = 0.5 * (resolution(source) + resolution(target));

  const Described a = describe(source, pr);
  const Described b = describe(target, pr);
  const std::vector<Match> kept = matches(a, b);
  std::size_t n_inliers = 0;
  const Eigen::Matrix4f pose = ransac(a, b, kept, 7.5 * pr, fixed, n_inliers);

  std::ostringstream json;
  json << std::setprecision(9) << "{\"target_from_source\": [";
  for (int row = 0; row < 4; ++row)
    json << (row ? ", [" : "[") << pose(row, 0) << ", " << pose(row, 1) << ", " << pose(row, 2) << ", " << pose(row, 3)
         << "]";
  json << "], \"keypoints\": [" << a.keypoints.size() << ", " << b.keypoints.size() << "], \"matches\": " << kept.size()
       << ", \"inliers\": " << n_inliers << "}";
  std::cout << json.str() << '\n';
}

} // namespace

int main(int argc, char** argv)
{
  const bool fixed = argc == 4 && std::string(argv[3]) == "fixed";
  if (argc != 3 && !fixed) {
    std::cerr << "usage: chain SOURCE.ply TARGET.ply [fixed]\n";
    return 2;
  }
  try {
    run(argv[1], argv[2], fixed);
  }
  catch (const std::exception& error) {
    std::cerr << "chain: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
