// PCL's stages, on the tables that our example `stages` has written.
//
//     pcl_stages FOLDER THREADS ROUNDS
//
// Prints a line a stage and round, {"stage": ..., "seconds": ..., "cpu": ..., "made": ...}; a first round is not counted. Where PCL
// has a parallel form, that one runs.

#include "../parity/cloud.h"

#include <pcl/features/fpfh_omp.h>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/features/shot_omp.h>
#include <pcl/features/spin_image.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/keypoints/harris_3d.h>
#include <pcl/keypoints/iss_3d.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_registration.h>

#include <chrono>
#include <cstdint>
#include <ctime>
#include <functional>
#include <iostream>

namespace {

// The same numbers as in crates/pipeline/benches/work.
constexpr int NEIGHBORS = 30;
constexpr double LEAF = 2.0;
constexpr double RADIUS = 15.0;
constexpr std::size_t FITS = 100000;
constexpr int TRIALS = 10000;
constexpr double THRESHOLD = 7.5;
constexpr int ICP_ITERATIONS = 20;

using PointCloudNormal = pcl::PointCloud<pcl::PointNormal>;
using Tree = pcl::search::KdTree<pcl::PointXYZ>;
using Model = pcl::SampleConsensusModelRegistration<pcl::PointXYZ>;

template <typename T> std::vector<T> table(const std::string& path)
{
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file)
    throw std::runtime_error("cannot read " + path);
  std::vector<T> values(static_cast<std::size_t>(file.tellg()) / sizeof(T));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
  return values;
}

// A scan with normals, and a tree that is built.
struct Surface {
  Cloud::Ptr points{new Cloud};
  Normals::Ptr normals{new Normals};
  Tree::Ptr tree{new Tree};

  Surface(const std::string& folder, const std::string& name)
  {
    const auto p = table<float>(folder + "/" + name + ".f32");
    const auto n = table<float>(folder + "/" + name + "-normals.f32");
    for (std::size_t i = 0; i + 2 < p.size(); i += 3) {
      points->push_back({p[i], p[i + 1], p[i + 2]});
      normals->push_back({n[i], n[i + 1], n[i + 2]});
    }
    tree->setInputCloud(points);
  }

  PointCloudNormal::Ptr together() const
  {
    PointCloudNormal::Ptr both(new PointCloudNormal);
    pcl::concatenateFields(*points, *normals, *both);
    return both;
  }
};

struct Inputs {
  std::string folder;
  int threads;
  double pr = 0.0;
  Surface whole, thinned, moving, fixed;
  pcl::IndicesPtr keypoints{new pcl::Indices};
  Cloud::Ptr from{new Cloud}, to{new Cloud};
  std::vector<Eigen::VectorXf> poses;

  Inputs(const std::string& where, int n_threads)
      : folder(where), threads(n_threads), whole(where, "points"), thinned(where, "thinned"), moving(where, "moving"),
        fixed(where, "fixed")
  {
    std::ifstream(folder + "/resolution.txt") >> pr;
    for (auto i : table<std::uint32_t>(folder + "/keypoints.u32"))
      keypoints->push_back(static_cast<int>(i));
    const auto pairs = table<float>(folder + "/pairs.f32");
    for (std::size_t i = 0; i + 5 < pairs.size(); i += 6) {
      from->push_back({pairs[i], pairs[i + 1], pairs[i + 2]});
      to->push_back({pairs[i + 3], pairs[i + 4], pairs[i + 5]});
    }
    const auto rows = table<float>(folder + "/poses.f32");
    for (std::size_t i = 0; i + 15 < rows.size(); i += 16)
      poses.emplace_back(Eigen::Map<const Eigen::VectorXf>(rows.data() + i, 16));
  }
};

std::size_t read_ply(const Inputs& in)
{
  Cloud cloud;
  pcl::io::loadPLYFile(in.folder + "/scan.ply", cloud);
  return cloud.size();
}

std::size_t index(const Inputs& in)
{
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(in.whole.points);
  return in.whole.points->size();
}

std::size_t measured_resolution(const Inputs& in)
{
  double sum = 0.0;
  const int n = static_cast<int>(in.whole.points->size());
#pragma omp parallel for reduction(+ : sum) num_threads(in.threads)
  for (int i = 0; i < n; ++i) {
    pcl::Indices found;
    std::vector<float> distances_sq;
    in.whole.tree->nearestKSearch(i, 2, found, distances_sq);
    sum += std::sqrt(static_cast<double>(distances_sq[1]));
  }
  return sum > 0.0 ? 1 : 0;
}

std::size_t voxel_grid(const Inputs& in)
{
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(in.whole.points);
  const float leaf = static_cast<float>(LEAF * in.pr);
  grid.setLeafSize(leaf, leaf, leaf);
  Cloud out;
  grid.filter(out);
  return out.size();
}

std::size_t normals(const Inputs& in)
{
  pcl::NormalEstimationOMP<pcl::PointXYZ, pcl::Normal> estimation(in.threads);
  estimation.setInputCloud(in.whole.points);
  estimation.setSearchMethod(in.whole.tree);
  estimation.setKSearch(NEIGHBORS);
  Normals out;
  estimation.compute(out);
  return out.size();
}

std::size_t iss(const Inputs& in)
{
  pcl::ISSKeypoint3D<pcl::PointXYZ, pcl::PointXYZ> detector;
  detector.setNumberOfThreads(in.threads);
  detector.setInputCloud(in.whole.points);
  detector.setSearchMethod(Tree::Ptr(new Tree));
  detector.setSalientRadius(6.0 * in.pr);
  detector.setNonMaxRadius(4.0 * in.pr);
  detector.setThreshold21(0.975);
  detector.setThreshold32(0.975);
  detector.setMinNeighbors(5);
  Cloud out;
  detector.compute(out);
  return out.size();
}

std::size_t harris(const Inputs& in, double radius)
{
  pcl::HarrisKeypoint3D<pcl::PointXYZ, pcl::PointXYZI> detector;
  detector.setNumberOfThreads(in.threads);
  detector.setInputCloud(in.whole.points);
  detector.setRadius(static_cast<float>(radius * in.pr));
  detector.setThreshold(0.0F);
  detector.setNonMaxSupression(true);
  detector.setRefine(false);
  pcl::PointCloud<pcl::PointXYZI> out;
  detector.compute(out);
  return out.size();
}

// Settings that all features share.
template <typename Feature> void prepare(Feature& feature, const Inputs& in, const Surface& surface)
{
  feature.setInputCloud(surface.points);
  feature.setInputNormals(surface.normals);
  feature.setSearchMethod(surface.tree);
  feature.setRadiusSearch(RADIUS * in.pr);
}

std::size_t shot(const Inputs& in)
{
  pcl::SHOTEstimationOMP<pcl::PointXYZ, pcl::Normal, pcl::SHOT352> estimation(in.threads);
  prepare(estimation, in, in.whole);
  estimation.setIndices(in.keypoints);
  pcl::PointCloud<pcl::SHOT352> out;
  estimation.compute(out);
  return out.size();
}

std::size_t spin_images(const Inputs& in)
{
  pcl::SpinImageEstimation<pcl::PointXYZ, pcl::Normal, pcl::Histogram<153>> estimation(8, 0.0, 1);
  prepare(estimation, in, in.whole);
  estimation.setIndices(in.keypoints);
  pcl::PointCloud<pcl::Histogram<153>> out;
  estimation.compute(out);
  return out.size();
}

std::size_t fpfh(const Inputs& in)
{
  pcl::FPFHEstimationOMP<pcl::PointXYZ, pcl::Normal, pcl::FPFHSignature33> estimation(in.threads);
  prepare(estimation, in, in.thinned);
  pcl::PointCloud<pcl::FPFHSignature33> out;
  estimation.compute(out);
  return out.size();
}

inline float* values(pcl::SHOT352& row) { return row.descriptor; }
inline float* values(pcl::FPFHSignature33& row) { return row.histogram; }

// Two nearest of each row, with the tree's building.
template <typename Row> std::size_t two_nearest(const Inputs& in, const std::string& name, std::size_t dim)
{
  typename pcl::PointCloud<Row>::Ptr tables[2];
  for (int i = 0; i < 2; ++i) {
    const auto all = table<float>(in.folder + "/" + name + std::to_string(i) + ".f32");
    tables[i].reset(new pcl::PointCloud<Row>);
    for (std::size_t at = 0; at + dim <= all.size(); at += dim) {
      Row row;
      std::copy_n(all.data() + at, dim, values(row));
      tables[i]->push_back(row);
    }
  }
  pcl::KdTreeFLANN<Row> tree;
  tree.setInputCloud(tables[1]);
  const int n = static_cast<int>(tables[0]->size());
#pragma omp parallel for num_threads(in.threads)
  for (int i = 0; i < n; ++i) {
    pcl::Indices found;
    std::vector<float> distances_sq;
    tree.nearestKSearch((*tables[0])[i], 2, found, distances_sq);
  }
  return tables[0]->size();
}

Model::Ptr model(const Inputs& in)
{
  Model::Ptr made(new Model(in.from));
  made->setInputTarget(in.to);
  return made;
}

std::size_t score(const Inputs& in)
{
  const Model::Ptr judge = model(in);
  std::size_t inliers = 0;
  for (const auto& pose : in.poses)
    inliers += judge->countWithinDistance(pose, THRESHOLD);
  return inliers;
}

std::size_t fits(const Inputs& in)
{
  const Model::Ptr fitter = model(in);
  const std::size_t n = in.from->size();
  std::size_t made = 0;
  for (std::size_t i = 0; i < FITS; ++i) {
    const pcl::Indices three{static_cast<int>(i % n), static_cast<int>((7 * i + 1) % n),
                             static_cast<int>((13 * i + 5) % n)};
    Eigen::VectorXf pose;
    made += fitter->computeModelCoefficients(three, pose) ? 1 : 0;
  }
  return made;
}

std::size_t ransac(const Inputs& in)
{
  pcl::RandomSampleConsensus<pcl::PointXYZ> consensus(model(in), THRESHOLD);
  consensus.setMaxIterations(TRIALS);
  // log(1 - 1) asks for ever more iterations, so that the maximum decides.
  consensus.setProbability(1.0);
  consensus.setNumberOfThreads(in.threads);
  return consensus.computeModel() ? 1 : 0;
}

Eigen::Matrix4f start(double pr)
{
  Eigen::Matrix4f pose = Eigen::Matrix4f::Identity();
  const Eigen::Vector3f turn(0.01F, -0.02F, 0.01F);
  pose.topLeftCorner<3, 3>() = Eigen::AngleAxisf(turn.norm(), turn.normalized()).toRotationMatrix();
  pose.topRightCorner<3, 1>() = Eigen::Vector3f(2.0F, -1.0F, 1.0F) * static_cast<float>(pr);
  return pose;
}

template <typename Registration> void settle(Registration& icp, double pr)
{
  icp.setMaxCorrespondenceDistance(6.0 * pr);
  icp.setMaximumIterations(ICP_ITERATIONS);
  icp.setTransformationEpsilon(0.0);
  icp.setEuclideanFitnessEpsilon(-1.0);
}

std::size_t icp_plane(const Inputs& in)
{
  pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
  settle(icp, in.pr);
  icp.setInputSource(in.moving.together());
  icp.setInputTarget(in.fixed.together());
  PointCloudNormal out;
  icp.align(out, start(in.pr));
  return out.size();
}

std::size_t gicp(const Inputs& in)
{
  pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> icp;
  settle(icp, in.pr);
  icp.setInputSource(in.moving.points);
  icp.setInputTarget(in.fixed.points);
  Cloud out;
  icp.align(out, start(in.pr));
  return out.size();
}

using Work = std::function<std::size_t(const Inputs&)>;

void run(const Inputs& in, int rounds)
{
  const std::vector<std::pair<std::string, Work>> stages{
      {"read-ply", read_ply},
      {"index", index},
      {"index-grid", index},
      {"resolution", measured_resolution},
      {"voxel-grid", voxel_grid},
      {"normals", normals},
      {"iss", iss},
      {"harris-3pr", [](const Inputs& i) { return harris(i, 3.0); }},
      {"harris-5pr", [](const Inputs& i) { return harris(i, 5.0); }},
      {"harris-7pr", [](const Inputs& i) { return harris(i, 7.0); }},
      {"shot", shot},
      {"spin-image", spin_images},
      {"fpfh", fpfh},
      {"match-352", [](const Inputs& i) { return two_nearest<pcl::SHOT352>(i, "long", 352); }},
      {"match-33", [](const Inputs& i) { return two_nearest<pcl::FPFHSignature33>(i, "short", 33); }},
      {"score", score},
      {"fit-three", fits},
      {"ransac", ransac},
      {"icp-plane", icp_plane},
      {"gicp", gicp},
  };
  for (const auto& [name, work] : stages) {
    for (int round = 0; round <= rounds; ++round) {
      const auto begin = std::chrono::steady_clock::now();
      const std::clock_t cpu_begin = std::clock(); // of all threads
      const std::size_t made = work(in);
      const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
      const double cpu = static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC;
      if (round > 0)
        std::cout << "{\"stage\": \"" << name << "\", \"seconds\": " << seconds.count() << ", \"cpu\": " << cpu
                  << ", \"made\": " << made << "}" << std::endl;
    }
  }
}

} // namespace

int main(int argc, char** argv)
{
  if (argc != 4) {
    std::cerr << "usage: pcl_stages FOLDER THREADS ROUNDS\n";
    return 2;
  }
  try {
    run(Inputs(argv[1], std::stoi(argv[2])), std::stoi(argv[3]));
  }
  catch (const std::exception& error) {
    std::cerr << "pcl_stages: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
