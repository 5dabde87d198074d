// What PCL makes of one scan: resolution, voxel grid, normals, keypoints, frames and descriptors, as bare little-endian
// f32 and u32 tables. README.md lists them.
//
//     reference POINTS DIRECTORY

#include "cloud.h"

#include <pcl/features/fpfh.h>
#include <pcl/features/normal_3d.h>
#include <pcl/features/shot.h>
#include <pcl/features/shot_lrf.h>
#include <pcl/features/spin_image.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/keypoints/harris_3d.h>
#include <pcl/keypoints/iss_3d.h>

#include <cstdint>
#include <cstdio>
#include <iomanip>
#include <iostream>

namespace {

// Lengths in resolutions.
constexpr double LEAF = 2.0;
constexpr double HARRIS_RADIUS = 3.0;
constexpr double ISS_SALIENT_RADIUS = 2.7;
constexpr double ISS_SUPPRESSION_RADIUS = 1.8;
constexpr double DESCRIPTOR_RADIUS = 15.0;
// Points that get a frame and descriptors, spread evenly over the indices.
constexpr std::size_t DESCRIBED = 200;

using Harris = pcl::HarrisKeypoint3D<pcl::PointXYZ, pcl::PointXYZI>;

class Directory {
public:
  explicit Directory(std::string path) : path_(std::move(path)) {}

  template <typename T> void write(const std::string& name, const std::vector<T>& values) const
  {
    std::ofstream file(path_ + "/" + name, std::ios::binary);
    file.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
    if (!file)
      throw std::runtime_error("cannot write " + path_ + "/" + name);
  }

  void write_text(const std::string& name, double value) const
  {
    std::ofstream file(path_ + "/" + name);
    file << std::setprecision(17) << value << '\n';
  }

private:
  std::string path_;
};

std::vector<float> flat(const Cloud& cloud)
{
  std::vector<float> values;
  for (const auto& p : cloud)
    values.insert(values.end(), {p.x, p.y, p.z});
  return values;
}

std::vector<float> flat(const Normals& normals)
{
  std::vector<float> values;
  for (const auto& n : normals)
    values.insert(values.end(), {n.normal_x, n.normal_y, n.normal_z, n.curvature});
  return values;
}

Cloud voxels(const Cloud::Ptr& cloud, double leaf)
{
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(cloud);
  grid.setLeafSize(static_cast<float>(leaf), static_cast<float>(leaf), static_cast<float>(leaf));
  Cloud out;
  grid.filter(out);
  return out;
}

// Turned towards the origin.
Normals::Ptr nearest_normals(const Cloud::Ptr& cloud, int k)
{
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(cloud);
  estimation.setKSearch(k);
  estimation.setViewPoint(0.0F, 0.0F, 0.0F);
  Normals::Ptr normals(new Normals);
  estimation.compute(*normals);
  return normals;
}

// Keypoints, and the response of every point.
void harris(const Directory& out, const std::string& name, const Cloud::Ptr& cloud, Harris::ResponseMethod method,
            double radius)
{
  Harris detector;
  detector.setNumberOfThreads(1);
  detector.setInputCloud(cloud);
  detector.setMethod(method);
  detector.setRadius(static_cast<float>(radius));
  detector.setThreshold(0.0F);
  detector.setRefine(false);
  pcl::PointCloud<pcl::PointXYZI> found;
  detector.setNonMaxSupression(true);
  detector.compute(found);
  const auto& indices = detector.getKeypointsIndices()->indices;
  out.write(name + ".u32", std::vector<std::uint32_t>(indices.begin(), indices.end()));

  detector.setNonMaxSupression(false);
  detector.compute(found);
  std::vector<float> responses;
  for (const auto& point : found)
    responses.push_back(point.intensity);
  out.write(name + ".f32", responses);
}

std::vector<std::uint32_t> iss(const Cloud::Ptr& cloud, double pr)
{
  pcl::ISSKeypoint3D<pcl::PointXYZ, pcl::PointXYZ> detector;
  detector.setNumberOfThreads(1);
  detector.setInputCloud(cloud);
  detector.setSearchMethod(pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  detector.setSalientRadius(ISS_SALIENT_RADIUS * pr);
  detector.setNonMaxRadius(ISS_SUPPRESSION_RADIUS * pr);
  detector.setThreshold21(0.975);
  detector.setThreshold32(0.975);
  detector.setMinNeighbors(5);
  Cloud keypoints;
  detector.compute(keypoints);
  const auto& found = detector.getKeypointsIndices()->indices;
  return {found.begin(), found.end()};
}

// Settings that all features share.
template <typename Feature> void prepare(Feature& feature, const Cloud::Ptr& cloud, const pcl::IndicesPtr& keypoints,
                                         double radius)
{
  feature.setInputCloud(cloud);
  feature.setIndices(keypoints);
  feature.setRadiusSearch(radius);
  feature.setSearchMethod(pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
}

// Rows x, y, z.
std::vector<float> frames(const Cloud::Ptr& cloud, const pcl::IndicesPtr& keypoints, double radius)
{
  pcl::SHOTLocalReferenceFrameEstimation<pcl::PointXYZ, pcl::ReferenceFrame> estimation;
  prepare(estimation, cloud, keypoints, radius);
  pcl::PointCloud<pcl::ReferenceFrame> found;
  estimation.compute(found);
  std::vector<float> values;
  for (const auto& frame : found)
    values.insert(values.end(), frame.rf, frame.rf + 9);
  return values;
}

std::vector<float> shot(const Cloud::Ptr& cloud, const Normals::Ptr& normals, const pcl::IndicesPtr& keypoints,
                        double radius)
{
  pcl::SHOTEstimation<pcl::PointXYZ, pcl::Normal, pcl::SHOT352> estimation;
  prepare(estimation, cloud, keypoints, radius);
  estimation.setInputNormals(normals);
  pcl::PointCloud<pcl::SHOT352> found;
  estimation.compute(found);
  std::vector<float> values;
  for (const auto& row : found)
    values.insert(values.end(), row.descriptor, row.descriptor + 352);
  return values;
}

std::vector<float> spin_images(const Cloud::Ptr& cloud, const Normals::Ptr& normals, const pcl::IndicesPtr& keypoints,
                               double radius)
{
  pcl::SpinImageEstimation<pcl::PointXYZ, pcl::Normal, pcl::Histogram<153>> estimation(8, 0.0, 1);
  prepare(estimation, cloud, keypoints, radius);
  estimation.setInputNormals(normals);
  pcl::PointCloud<pcl::Histogram<153>> found;
  estimation.compute(found);
  std::vector<float> values;
  for (const auto& row : found)
    values.insert(values.end(), row.histogram, row.histogram + 153);
  return values;
}

std::vector<float> fpfh(const Cloud::Ptr& cloud, const Normals::Ptr& normals, const pcl::IndicesPtr& keypoints,
                        double radius)
{
  pcl::FPFHEstimation<pcl::PointXYZ, pcl::Normal, pcl::FPFHSignature33> estimation;
  prepare(estimation, cloud, keypoints, radius);
  estimation.setInputNormals(normals);
  pcl::PointCloud<pcl::FPFHSignature33> found;
  estimation.compute(found);
  std::vector<float> values;
  for (const auto& row : found)
    values.insert(values.end(), row.histogram, row.histogram + 33);
  return values;
}

void run(const std::string& points, const Directory& out)
{
  const Cloud::Ptr cloud = read_cloud(points);
  const double pr = resolution(cloud);
  out.write("points.f32", flat(*cloud));
  out.write_text("resolution.txt", pr);
  out.write("voxels.f32", flat(voxels(cloud, LEAF * pr)));

  const Normals::Ptr normals = nearest_normals(cloud, 20);
  out.write("normals20.f32", flat(*normals));
  out.write("normals50.f32", flat(*nearest_normals(cloud, 50)));

  const double radius = HARRIS_RADIUS * pr;
  harris(out, "harris", cloud, Harris::HARRIS, radius);
  harris(out, "noble", cloud, Harris::NOBLE, radius);
  harris(out, "tomasi", cloud, Harris::TOMASI, radius);
  out.write("iss.u32", iss(cloud, pr));

  pcl::IndicesPtr keypoints(new pcl::Indices);
  const std::size_t stride = std::max<std::size_t>(1, cloud->size() / DESCRIBED);
  for (std::size_t i = stride / 2; i < cloud->size() && keypoints->size() < DESCRIBED; i += stride)
    keypoints->push_back(static_cast<int>(i));
  out.write("described.u32", std::vector<std::uint32_t>(keypoints->begin(), keypoints->end()));
  const double reach = DESCRIPTOR_RADIUS * pr;
  out.write("frames.f32", frames(cloud, keypoints, reach));
  out.write("shot.f32", shot(cloud, normals, keypoints, reach));
  out.write("spin.f32", spin_images(cloud, normals, keypoints, reach));
  out.write("fpfh.f32", fpfh(cloud, normals, keypoints, reach));
  std::cerr << cloud->size() << " points, resolution " << pr << ", " << keypoints->size() << " described\n";
}

} // namespace

int main(int argc, char** argv)
{
  if (argc != 3) {
    std::cerr << "usage: reference POINTS DIRECTORY\n";
    return 2;
  }
  try {
    run(argv[1], Directory(argv[2]));
  }
  catch (const std::exception& error) {
    std::cerr << "reference: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
