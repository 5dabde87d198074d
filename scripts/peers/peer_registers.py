"""Registers pairs of scans by a peer that comes as a Python package, from files to pose, in one process.

    peer_registers.py open3d|kiss-matcher|teaser|small_gicp THREADS ROUNDS SOURCE TARGET [SOURCE TARGET ...]

Prints a line a pair and round, {"pair": ..., "seconds": ..., "target_from_source": ...}; a first round is not counted.
Each peer at the parameters that its authors recommend, with a voxel of so many resolutions; the resolution is part of
the time, since somebody has to know it.
"""
import json
import sys
import time

import numpy as np

# Voxels in resolutions. TEASER++ compares every two correspondences: with a voxel of 2 a scan of 69 000 points takes it 10 s.
VOXEL, TEASER_VOXEL = 2.0, 4.0


def open3d_reader():
    import open3d as o3d

    def read(path):
        cloud = o3d.io.read_point_cloud(path)
        cloud.remove_non_finite_points()
        return cloud.remove_duplicated_points()

    def resolution(cloud):
        return float(np.mean(cloud.compute_nearest_neighbor_distance()))

    return o3d, read, resolution


def described(o3d, cloud, voxel):
    """Voxel grid, normals and FPFH, at the radii of Open3D's and TEASER++'s examples."""
    search = o3d.geometry.KDTreeSearchParamHybrid
    thin = cloud.voxel_down_sample(voxel)
    thin.estimate_normals(search(2 * voxel, 30))
    return thin, o3d.pipelines.registration.compute_fpfh_feature(thin, search(5 * voxel, 100))


def refined(o3d, source, target, voxel, reach, pose):
    """Point-to-plane ICP of the whole clouds."""
    target.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2 * voxel, 30))
    reg = o3d.pipelines.registration
    return reg.registration_icp(source, target, reach, pose, reg.TransformationEstimationPointToPlane()).transformation


def open3d(threads):
    """Its documented chain: voxel grid, normals, FPFH, RANSAC, point-to-plane ICP."""
    o3d, read, resolution = open3d_reader()
    reg = o3d.pipelines.registration

    def register(source_path, target_path):
        source, target = read(source_path), read(target_path)
        voxel = VOXEL * 0.5 * (resolution(source) + resolution(target))
        (a, fa), (b, fb) = described(o3d, source, voxel), described(o3d, target, voxel)
        checks = [reg.CorrespondenceCheckerBasedOnEdgeLength(0.9), reg.CorrespondenceCheckerBasedOnDistance(1.5 * voxel)]
        rough = reg.registration_ransac_based_on_feature_matching(
            a, b, fa, fb, True, 1.5 * voxel, reg.TransformationEstimationPointToPoint(), 3, checks,
            reg.RANSACConvergenceCriteria(100000, 0.999))
        return refined(o3d, source, target, voxel, 0.4 * voxel, rough.transformation)

    return register


def kiss_matcher(threads):
    import kiss_matcher as kiss

    _, read, resolution = open3d_reader()

    def register(source_path, target_path):
        source, target = read(source_path), read(target_path)
        pr = 0.5 * (resolution(source) + resolution(target))
        # It refuses small voxels, so that scans in metres have to be rescaled: to resolutions.
        matcher = kiss.KISSMatcher(kiss.KISSMatcherConfig(VOXEL))
        found = matcher.estimate(*(np.asarray(cloud.points, float).astype(np.float32) / pr for cloud in (source, target)))
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = found.rotation, pr * np.asarray(found.translation).ravel()
        return pose

    return register


def teaser(threads):
    """The chain of its examples: Open3D's FPFH, correspondences that are mutually nearest, TEASER++, ICP."""
    import teaserpp_python as teaserpp

    o3d, read, resolution = open3d_reader()
    reg, solver_type = o3d.pipelines.registration, teaserpp.RobustRegistrationSolver

    def parameters(voxel):
        asked = solver_type.Params()
        asked.noise_bound = voxel
        asked.estimate_scaling = False
        asked.rotation_estimation_algorithm = solver_type.ROTATION_ESTIMATION_ALGORITHM.GNC_TLS
        asked.rotation_cost_threshold = 1e-12
        return asked

    def register(source_path, target_path):
        source, target = read(source_path), read(target_path)
        voxel = TEASER_VOXEL * 0.5 * (resolution(source) + resolution(target))
        (a, fa), (b, fb) = described(o3d, source, voxel), described(o3d, target, voxel)
        pairs = np.asarray(reg.correspondences_from_features(fa, fb, mutual_filter=True))
        solver = solver_type(parameters(voxel))
        solver.solve(np.asarray(a.points)[pairs[:, 0]].T, np.asarray(b.points)[pairs[:, 1]].T)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = solver.getSolution().rotation, solver.getSolution().translation
        return refined(o3d, source, target, voxel, voxel, pose)

    return register


def small_gicp(threads):
    """From the identity: what refinement alone can do."""
    import small_gicp as gicp

    def register(source_path, target_path):
        source, target = (gicp.read_ply(path).points()[:, :3] for path in (source_path, target_path))
        tree = gicp.KdTree(target, num_threads=threads)
        sample = target[:: max(1, len(target) // 4000)]
        pr = float(np.sqrt(tree.batch_knn_search(sample, 2, threads)[1][:, 1]).mean())
        return gicp.align(target, source, downsampling_resolution=VOXEL * pr, max_correspondence_distance=10 * pr,
                          num_threads=threads).T_target_source

    return register


def main():
    peer, threads, rounds, files = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4:]
    register = {"open3d": open3d, "kiss-matcher": kiss_matcher, "teaser": teaser, "small_gicp": small_gicp}[peer](threads)
    for pair in range(len(files) // 2):
        for number in range(rounds + 1):
            begin = time.perf_counter()
            pose = register(files[2 * pair], files[2 * pair + 1])
            seconds = time.perf_counter() - begin
            if number > 0:
                print(json.dumps({"pair": pair, "seconds": seconds, "target_from_source": np.asarray(pose).tolist()}),
                      flush=True)


if __name__ == "__main__":
    main()
