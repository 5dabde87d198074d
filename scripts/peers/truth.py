"""How far a pose is from the truth, in resolutions: the mean displacement of the points that both scans share.

    truth.py < requests > answers

A request is a JSON line {"source": ..., "target": ..., "truth": 4x4, "poses": [4x4 or null, ...]}; its answer a list of
errors, infinite for null. Needs the virtual environment.
"""
import json
import sys

import numpy as np
import open3d as o3d
from scipy.spatial import cKDTree

# Points with a counterpart this near are shared.
SHARED = 4.0


def points(path):
    every = np.asarray(o3d.io.read_point_cloud(path).points)
    return np.unique(every[np.isfinite(every).all(1)], axis=0)


def errors(request):
    source, target = points(request["source"]), points(request["target"])
    trees = cKDTree(source), cKDTree(target)
    pr = np.mean([tree.query(tree.data, k=2)[0][:, 1].mean() for tree in trees])
    truth = np.array(request["truth"])
    moved = source @ truth[:3, :3].T + truth[:3, 3]
    shared = trees[1].query(moved)[0] < SHARED * pr

    def error(pose):
        if pose is None:
            return float("inf")
        pose = np.array(pose)
        off = source[shared] @ pose[:3, :3].T + pose[:3, 3] - moved[shared]
        return float(np.linalg.norm(off, axis=1).mean() / pr)

    return [error(pose) for pose in request["poses"]]


for line in sys.stdin:
    print(json.dumps(errors(json.loads(line))), flush=True)
