"""The module as its users see it. Run by scripts/check, with the module's folder in PYTHONPATH."""
import pathlib
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np

import congruent


def landscape(offset):
    """Hills of different heights on 24 by 24 units, as a grid of points that `offset` shifts against another one."""
    generator = np.random.default_rng(4)
    hills = [(generator.uniform(0, 24, 2), generator.uniform(1, 3), generator.uniform(-3, 3)) for _ in range(40)]
    x, y = np.meshgrid(np.arange(0, 24, 0.25) + offset, np.arange(0, 24, 0.25) + offset)
    z = sum(h * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * w * w)) for (cx, cy), w, h in hills)
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)


def turned(degrees, shift):
    """A rotation about a slanted axis, then a shift, as a matrix."""
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    cross = np.cross(np.eye(3), axis)
    angle = np.radians(degrees)
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) + np.sin(angle) * cross.T + (1 - np.cos(angle)) * cross.T @ cross.T
    matrix[:3, 3] = shift
    return matrix


def moved(points, pose):
    return points @ pose[:3, :3].T + pose[:3, 3]


SOURCE = landscape(0.0)
TRUTH = turned(50.0, [100.0, -20.0, 5.0])
TARGET = moved(landscape(0.1), TRUTH)


def worst(pose):
    return np.linalg.norm(moved(SOURCE, pose) - moved(SOURCE, TRUTH), axis=1).max()


class Register(unittest.TestCase):
    def test_the_pose_is_found_with_a_verdict(self):
        found = congruent.register(SOURCE, TARGET)
        self.assertEqual(found.verdict, "ok", found)
        self.assertIsNone(found.reason)
        self.assertGreaterEqual(found.confidence, 0.8)
        self.assertEqual(found.target_from_source.shape, (4, 4))
        self.assertLess(worst(found.target_from_source), 0.05)
        self.assertEqual(found.covariance.shape, (6, 6))
        self.assertTrue(np.all(np.linalg.eigvalsh(found.covariance) > -1e-12))
        self.assertEqual(found.alternatives, [])
        self.assertTrue(0.2 < found.resolution < 0.5, found.resolution)
        self.assertTrue(0.5 < found.overlap <= 1.0 and found.contradicted < 0.05)
        self.assertTrue(3 <= found.inliers <= found.correspondences)
        self.assertIn("estimation", found.timings)
        self.assertIn("ok", repr(found))

    def test_the_bits_do_not_depend_on_the_threads_or_on_other_calls(self):
        expected = congruent.register(SOURCE, TARGET, threads=1).target_from_source.tobytes()
        results = []
        call = lambda: results.append(congruent.register(SOURCE, TARGET, threads=2).target_from_source.tobytes())
        callers = [threading.Thread(target=call) for _ in range(3)]
        for caller in callers:
            caller.start()
        for caller in callers:
            caller.join()
        self.assertEqual(results, [expected] * 3)

    def test_arrays_of_any_kind_scans_and_files_are_the_same(self):
        expected = congruent.register(SOURCE, TARGET).target_from_source
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "source.xyz"
            np.savetxt(path, SOURCE, fmt="%.17g")
            for source in [SOURCE.tolist(), np.asfortranarray(SOURCE), congruent.Scan(SOURCE), path, str(path)]:
                found = congruent.register(source, TARGET)
                np.testing.assert_array_equal(found.target_from_source, expected)
        single = congruent.register(SOURCE.astype(np.float32), TARGET)
        self.assertLess(worst(single.target_from_source), 0.05)

    def test_points_that_are_not_finite_are_dropped(self):
        spoilt = np.concatenate([SOURCE, [[np.nan, 0, 0], [0, np.inf, 0]]])
        np.testing.assert_array_equal(
            congruent.register(spoilt, TARGET).target_from_source, congruent.register(SOURCE, TARGET).target_from_source
        )

    def test_a_plane_is_not_registered_and_the_reason_is_said(self):
        plane = SOURCE * [1, 1, 0]
        found = congruent.register(plane, moved(plane, TRUTH))
        self.assertNotEqual(found.verdict, "ok")
        self.assertIsInstance(found.reason, str)
        self.assertIn(found.reason, repr(found))

    def test_settings_are_those_of_the_program(self):
        paper = congruent.register(SOURCE, TARGET, "paper", settings={"metric": "inlier-count"}, seed=3)
        self.assertIsNone(paper.covariance)
        text = "seed = 3\n[metric.mse]\nthreshold = \"5pr\"\n"
        self.assertIn(congruent.register(SOURCE, TARGET, text).verdict, ["ok", "ambiguous", "failed"])
        for config, settings, expected in [
            ("defualt", None, "did you mean `default`"),
            ("[metric.mes]\n", None, "config:1:9"),
            ("default", {"metric.mse.thresold": "5pr"}, "did you mean `threshold`"),
            ("default", {"metric.mse.threshold": 5}, "settings['metric.mse.threshold']"),
        ]:
            with self.assertRaises(ValueError) as raised:
                congruent.register(SOURCE, TARGET, config, settings=settings)
            self.assertIn(expected, str(raised.exception))

    def test_what_is_known_of_the_pose_is_used(self):
        rough = turned(55.0, [100.0, -21.0, 5.5])
        near = congruent.register(SOURCE, TARGET, init=rough, max_rotation=15, max_translation="5u")
        self.assertLess(worst(near.target_from_source), 0.05)
        elsewhere = congruent.register(SOURCE, TARGET, init=np.eye(4), max_rotation=10)
        self.assertNotEqual(elsewhere.verdict, "ok")
        refined = congruent.refine(SOURCE, TARGET, rough)
        self.assertEqual(refined.verdict, "ok")
        self.assertLess(worst(refined.target_from_source), 0.05)
        level = congruent.register(SOURCE, moved(SOURCE, np.eye(4)), up=np.array([0, 0, 1]))
        np.testing.assert_allclose(level.target_from_source[2, :3], [0, 0, 1], atol=1e-9)

    def test_mistakes_are_named(self):
        mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
        for call, expected in [
            (lambda: congruent.register(SOURCE[:, :2], TARGET), "source: an array of shape (n, 3)"),
            (lambda: congruent.register(SOURCE[:2], TARGET), "source: "),
            (lambda: congruent.register(SOURCE, None), "target: a two-dimensional array"),
            (lambda: congruent.register(SOURCE, TARGET, init=mirror), "init: the upper left 3x3 part"),
            (lambda: congruent.register(SOURCE, TARGET, init=np.eye(3)), "(4, 4)"),
            (lambda: congruent.register(SOURCE, TARGET, init=TRUTH.T), "init: the last row is"),
            (lambda: congruent.register(SOURCE, TARGET, init=TRUTH, up=(0, 0, 1)), "tilts the source"),
            (lambda: congruent.register(SOURCE, TARGET, max_rotation=5), "give init"),
            (lambda: congruent.register(SOURCE, TARGET, init=np.eye(4), max_translation="5"), "max_translation"),
            (lambda: congruent.register(SOURCE, TARGET, init=np.eye(4), max_rotation=np.nan), "max_rotation"),
            (lambda: congruent.register(SOURCE, TARGET, up=(0, 0, 0)), "not a direction"),
            (lambda: congruent.register(SOURCE, TARGET, threads=0), "threads"),
            (lambda: congruent.Scan(SOURCE, SOURCE[:-1]), "normals: "),
            (lambda: congruent.Scan(SOURCE, triangles=[[0, 1, len(SOURCE)]]), f"{len(SOURCE)} is none of the"),
            (lambda: congruent.Scan(SOURCE, triangles=[[0, 1, -1]]), "-1 is none of the"),
            (lambda: congruent.Scan(SOURCE, viewpoint=(1, 2)), "viewpoint: three numbers"),
            (lambda: congruent.register(SOURCE, TARGET, up="z"), "up: three numbers"),
            (lambda: congruent.read("scan.ply", thin=0.0), "thin: "),
        ]:
            with self.assertRaises(ValueError) as raised:
                call()
            self.assertIn(expected, str(raised.exception))
        with self.assertRaises(OSError) as raised:
            congruent.read("absent.ply")
        self.assertIn("absent.ply: cannot be read", str(raised.exception))


class Scans(unittest.TestCase):
    def test_a_file_is_read_whole(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "square.off"
            path.write_text("OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n")
            scan = congruent.read(path)
            self.assertEqual(len(congruent.read(path, thin=10.0)), 1)
        self.assertEqual(len(scan), 4)
        self.assertEqual(scan.points.dtype, np.float64)
        np.testing.assert_array_equal(scan.triangles, [[0, 1, 2], [0, 2, 3]])
        self.assertIsNone(scan.normals)
        self.assertIsNone(scan.viewpoint)
        self.assertIn("4 points", repr(scan))

    def test_what_is_given_comes_back(self):
        points, up = np.arange(12.0).reshape(4, 3), np.tile([0.0, 0.0, 1.0], (4, 1))
        scan = congruent.Scan(points, up, triangles=[[0, 1, 2]], viewpoint=(1, 2, 3))
        np.testing.assert_array_equal(scan.points, points)
        np.testing.assert_array_equal(scan.normals, up)
        self.assertEqual(list(scan.viewpoint), [1.0, 2.0, 3.0])
        again = congruent.Scan(scan.points, scan.normals, triangles=scan.triangles, viewpoint=np.arange(1, 7).reshape(3, 2)[:, 0])
        np.testing.assert_array_equal(again.triangles, [[0, 1, 2]])
        self.assertEqual(list(again.viewpoint), [1.0, 3.0, 5.0])


class Reconstruct(unittest.TestCase):
    def test_scans_that_overlap_come_into_one_frame(self):
        left, right = SOURCE[SOURCE[:, 0] < 16], TARGET[SOURCE[:, 0] > 8]
        model = congruent.reconstruct([left, right, SOURCE])
        self.assertEqual([sorted(members) for members in model.components], [[0, 1, 2]])
        self.assertEqual(model.conflicts, [])
        self.assertEqual(len(model.uncertainty), 3)
        first_from_second = np.linalg.inv(model.frame_from_scan[0]) @ model.frame_from_scan[1]
        self.assertLess(worst(np.linalg.inv(first_from_second)), 0.1)
        self.assertIn("3 of 3", repr(model))

    def test_nothing_is_a_model_without_scans(self):
        self.assertEqual(congruent.reconstruct([]).components, [])

    def test_the_scan_that_cannot_be_used_is_named(self):
        with self.assertRaises(ValueError) as raised:
            congruent.reconstruct([SOURCE, SOURCE[:1]])
        self.assertIn("scans[1]", str(raised.exception))


class Forks(unittest.TestCase):
    @unittest.skipUnless(sys.platform == "linux", "a fork")
    def test_a_child_registers_as_its_parent_did(self):
        program = (
            "import os, signal, test_congruent as t\n"
            "run = lambda: t.congruent.register(t.SOURCE, t.TARGET).target_from_source.tobytes()\n"
            "before = run()\n"
            "child = os.fork()\n"
            "if child == 0:\n"
            "    signal.alarm(60)\n"
            "    os._exit(0 if run() == before else 1)\n"
            "raise SystemExit(os.waitpid(child, 0)[1])\n"
        )
        here = pathlib.Path(__file__).resolve().parent
        done = subprocess.run([sys.executable, "-c", program], cwd=here, timeout=120)
        self.assertEqual(done.returncode, 0)


if __name__ == "__main__":
    unittest.main()
