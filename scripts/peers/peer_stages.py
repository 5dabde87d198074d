"""Stages of the peers that come as Python packages, on the tables that our example `stages` has written.

    peer_stages.py open3d|small_gicp|scipy|numpy FOLDER THREADS ROUNDS

Prints a line a stage and round, {"stage": ..., "seconds": ..., "cpu": ..., "made": ...}; a first round is not counted. All the work
is done inside the packages; what Python adds is the call. The numbers are those of crates/pipeline/benches/work.
"""
import json
import sys
import time

import numpy as np

NEIGHBORS, LEAF, RADIUS, TRIALS, THRESHOLD, ICP_ITERATIONS = 30, 2.0, 15.0, 10000, 7.5, 20


class Tables:
    def __init__(self, folder, threads):
        self.folder, self.threads = folder, threads
        self.pr = float(open(f"{folder}/resolution.txt").read())

    def rows(self, name, width):
        return np.fromfile(f"{self.folder}/{name}.f32", "<f4").reshape(-1, width)

    def points(self, name):
        return self.rows(name, 3).astype(float)

    def start(self):
        pose = np.eye(4)
        turn = np.array([0.01, -0.02, 0.01])
        angle = np.linalg.norm(turn)
        x, y, z = turn / angle
        skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        pose[:3, :3] += np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
        pose[:3, 3] = np.array([2.0, -1.0, 1.0]) * self.pr
        return pose


def open3d(t):
    import open3d as o3d

    reg, search = o3d.pipelines.registration, o3d.geometry

    def cloud(name, normals=True):
        made = search.PointCloud(o3d.utility.Vector3dVector(t.points(name)))
        if normals:
            made.normals = o3d.utility.Vector3dVector(t.points(f"{name}-normals"))
        return made

    whole, thinned, moving, fixed = (cloud(name) for name in ("points", "thinned", "moving", "fixed"))
    long = [t.rows(f"long{i}", 352) for i in (0, 1)]
    short = [t.rows(f"short{i}", 33) for i in (0, 1)]
    pairs = t.rows("pairs", 6).astype(float)
    p, q = (search.PointCloud(o3d.utility.Vector3dVector(pairs[:, s])) for s in (slice(0, 3), slice(3, 6)))
    identity = o3d.utility.Vector2iVector(np.repeat(np.arange(len(pairs), dtype=np.int32), 2).reshape(-1, 2))

    def normals():
        bare = search.PointCloud(whole.points)
        bare.estimate_normals(search.KDTreeSearchParamKNN(NEIGHBORS))
        return len(bare.normals)

    def clean():
        made = search.PointCloud(whole.points)
        made.remove_non_finite_points()
        return len(made.remove_duplicated_points().points)

    def two_nearest(tables):
        index = o3d.core.nns.NearestNeighborSearch(o3d.core.Tensor(tables[1]))
        index.knn_index()
        return len(index.knn_search(o3d.core.Tensor(tables[0]), 2)[0])

    def icp(estimation):
        end = reg.ICPConvergenceCriteria(-1.0, -1.0, ICP_ITERATIONS)
        return len(reg.registration_icp(moving, fixed, 6 * t.pr, t.start(), estimation, end).correspondence_set)

    def gicp():
        end = reg.ICPConvergenceCriteria(-1.0, -1.0, ICP_ITERATIONS)
        how = reg.TransformationEstimationForGeneralizedICP()
        return len(reg.registration_generalized_icp(moving, fixed, 6 * t.pr, t.start(), how, end).correspondence_set)

    def ransac():
        found = reg.registration_ransac_based_on_correspondence(
            p, q, identity, THRESHOLD, reg.TransformationEstimationPointToPoint(), 3, [],
            reg.RANSACConvergenceCriteria(TRIALS, 1.0))
        return len(found.correspondence_set)

    return {
        "read-ply": lambda: len(o3d.io.read_point_cloud(f"{t.folder}/scan.ply").points),
        "clean": clean,
        "index": lambda: bool(search.KDTreeFlann(whole)),
        "index-grid": lambda: bool(search.KDTreeFlann(whole)),
        "resolution": lambda: float(np.mean(whole.compute_nearest_neighbor_distance())) > 0,
        "voxel-grid": lambda: len(search.PointCloud(whole.points).voxel_down_sample(LEAF * t.pr).points),
        "normals": normals,
        "iss": lambda: len(search.keypoint.compute_iss_keypoints(whole, 6 * t.pr, 4 * t.pr, 0.975, 0.975, 5).points),
        "fpfh": lambda: reg.compute_fpfh_feature(thinned, search.KDTreeSearchParamRadius(RADIUS * t.pr)).num(),
        "match-352": lambda: two_nearest(long),
        "match-33": lambda: two_nearest(short),
        "ransac": ransac,
        "icp-plane": lambda: icp(reg.TransformationEstimationPointToPlane()),
        "gicp": gicp,
    }


def small_gicp(t):
    import small_gicp as gicp

    whole = gicp.PointCloud(t.points("points"))
    tree = gicp.KdTree(whole, num_threads=t.threads)
    points = t.points("points")
    prepared = [gicp.PointCloud(t.points(name)) for name in ("moving", "fixed")]
    for cloud in prepared:
        gicp.estimate_normals_covariances(cloud, num_neighbors=NEIGHBORS, num_threads=t.threads)
    moving, fixed = prepared
    fixed_tree = gicp.KdTree(fixed, num_threads=t.threads)

    def normals():
        gicp.estimate_normals(whole, tree, NEIGHBORS, t.threads)
        return whole.size()

    def align(kind):
        found = gicp.align(fixed, moving, fixed_tree, t.start(), kind, 6 * t.pr, t.threads, ICP_ITERATIONS, 0.0, 0.0)
        return found.num_inliers

    return {
        "read-ply": lambda: gicp.read_ply(f"{t.folder}/scan.ply").size(),
        "index": lambda: bool(gicp.KdTree(whole, num_threads=t.threads)),
        "index-grid": lambda: bool(gicp.KdTree(whole, num_threads=t.threads)),
        "resolution": lambda: len(tree.batch_knn_search(points, 2, t.threads)[1]),
        "voxel-grid": lambda: gicp.voxelgrid_sampling(whole, LEAF * t.pr, t.threads).size(),
        "normals": normals,
        "icp-plane": lambda: align("PLANE_ICP"),
        "gicp": lambda: align("GICP"),
    }


def scipy(t):
    from scipy.spatial import cKDTree

    points = t.points("points")
    tree = cKDTree(points)
    tables = {dim: [t.rows(f"{name}{i}", dim) for i in (0, 1)] for name, dim in (("long", 352), ("short", 33))}

    def two_nearest(dim):
        return len(cKDTree(tables[dim][1]).query(tables[dim][0], k=2, workers=t.threads)[0])

    return {
        "index": lambda: bool(cKDTree(points)),
        "index-grid": lambda: bool(cKDTree(points)),
        "resolution": lambda: float(tree.query(points, k=2, workers=t.threads)[0][:, 1].mean()) > 0,
        "match-352": lambda: two_nearest(352),
        "match-33": lambda: two_nearest(33),
    }


def numpy(t):
    tables = {dim: [t.rows(f"{name}{i}", dim) for i in (0, 1)] for name, dim in (("long", 352), ("short", 33))}

    def two_nearest(dim):
        a, b = tables[dim]
        norms = np.einsum("ij,ij->i", b, b)
        found = 0
        for start in range(0, len(a), 512):
            distances = norms - 2 * (a[start:start + 512] @ b.T)
            found += len(np.argpartition(distances, 2, axis=1)[:, :2])
        return found

    return {"match-352": lambda: two_nearest(352), "match-33": lambda: two_nearest(33)}


def main():
    peer, folder, threads, rounds = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    stages = {"open3d": open3d, "small_gicp": small_gicp, "scipy": scipy, "numpy": numpy}[peer]
    for name, work in stages(Tables(folder, threads)).items():
        work()
        for _ in range(rounds):
            begin, cpu_begin = time.perf_counter(), time.process_time()
            made = work()
            seconds, cpu = time.perf_counter() - begin, time.process_time() - cpu_begin
            print(json.dumps({"stage": name, "seconds": seconds, "cpu": cpu, "made": int(made)}), flush=True)


if __name__ == "__main__":
    main()
