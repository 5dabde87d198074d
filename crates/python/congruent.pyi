"""Registers raw 3D scans without correspondences or an initial pose, and says whether it worked.

A *scan* is given as a `Scan`, as the path of a file, or as an array of shape (n, 3). Points that are not finite are
dropped. Coordinates keep their units and their frame; UTM coordinates are no problem in double precision.

Settings are those of the program `congruent` (`congruent config show default` explains them): `config` is the name of a
preset ("default", "fast", "paper") or a text of TOML, and `settings` changes single ones, such as
`{"metric": "inlier-count", "metric.mse.threshold": "5pr"}`.

The same scans, settings and seed give the same bits on any number of threads. `threads` is their number; by default all of
the machine. The interpreter is free for other Python threads meanwhile, and a child of `os.fork` may call everything. Ctrl-C takes effect
when a call has returned.

Mistakes raise `ValueError`, files that cannot be read `OSError`; a pair that cannot be registered is no error but a
verdict.
"""
import os
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

class Scan:
    """A scan as in its file."""

    def __init__(
        self,
        points: ArrayLike,
        normals: ArrayLike | None = None,
        *,
        triangles: ArrayLike | None = None,
        viewpoint: ArrayLike | None = None,
    ) -> None:
        """Takes points (n, 3), a normal for each (n, 3), triangles of point numbers (m, 3) that count from 0, and the
        position of the scanner."""

    @property
    def points(self) -> NDArray[np.float64]:
        """A copy, (n, 3)."""
    @property
    def normals(self) -> NDArray[np.float32] | None:
        """A copy, (n, 3); None if there are none."""
    @property
    def triangles(self) -> NDArray[np.uint32]:
        """A copy, (m, 3); (0, 3) for a point cloud."""
    @property
    def viewpoint(self) -> list[float] | None:
        """Position of the scanner, if it is known."""
    def __len__(self) -> int:
        """Number of points."""

class Registration:
    """The pose that was found, and whether it can be trusted."""

    @property
    def verdict(self) -> Literal["ok", "ambiguous", "failed"]:
        """Whether the pose can be relied on: only if it is "ok"."""
    @property
    def confidence(self) -> float:
        """Probability that the pose is right, 0 to 1."""
    @property
    def reason(self) -> str | None:
        """Why the pose is not accepted; None if it is."""
    @property
    def target_from_source(self) -> NDArray[np.float64] | None:
        """The pose, (4, 4): maps source coordinates into the target's frame. If the verdict is "failed", the best one
        found, not to be relied on; None if there is none."""
    @property
    def alternatives(self) -> list[NDArray[np.float64]]:
        """The other poses that fit nearly as well, best first; empty unless the verdict is "ambiguous"."""
    @property
    def covariance(self) -> NDArray[np.float64] | None:
        """Covariance (6, 6) of the small motion between the pose and the true one, about `covariance_about`: a rotation
        vector (radians), then a translation, along the axes of the target. None if it is unknown."""
    @property
    def covariance_about(self) -> list[float] | None:
        """The centroid of the overlap, target coordinates."""
    @property
    def overlap(self) -> float | None:
        """Fraction of the surfaces that touch under the pose."""
    @property
    def contradicted(self) -> float | None:
        """Fraction of the points that float where the other scanner saw empty space, or hide what it saw; summed over both
        scans."""
    @property
    def correspondences(self) -> int:
        """Number of correspondences."""
    @property
    def inliers(self) -> int:
        """Number of correspondences that agree with the pose."""
    @property
    def resolution(self) -> float:
        """Mean distance between neighbouring points of both scans (1 pr); 0 if a scan cannot be sampled."""
    @property
    def timings(self) -> dict[str, float]:
        """Seconds of each stage, over all attempts."""

class Model:
    """Many scans in one frame, as far as they are connected."""

    @property
    def components(self) -> list[list[int]]:
        """Scans that are connected, by their positions; the largest component first. A scan that fits nowhere is alone."""
    @property
    def frame_from_scan(self) -> list[NDArray[np.float64]]:
        """For each scan the motion (4, 4) into the coordinates of the first scan of its component."""
    @property
    def uncertainty(self) -> list[float | None]:
        """For each scan a lower bound of the error of its points relative to the component's first scan."""
    @property
    def conflicts(self) -> list[tuple[int, int]]:
        """Scans that contradict each other where they were placed, the largest contradiction first. If there are any, the
        poses may be wrong."""

def read(path: str | os.PathLike[str], *, thin: float | None = None) -> Scan:
    """Reads a PLY, OBJ, STL, OFF, PCD, XYZ/TXT/CSV, LAS/LAZ or E57 file. `thin` keeps one point for each cubic cell of this
    side while reading."""

def register(
    source: Scan | str | os.PathLike[str] | ArrayLike,
    target: Scan | str | os.PathLike[str] | ArrayLike,
    config: str = "default",
    *,
    settings: Mapping[str, object] | None = None,
    seed: int | None = None,
    init: ArrayLike | None = None,
    max_rotation: float | None = None,
    max_translation: str | None = None,
    up: ArrayLike | None = None,
    threads: int | None = None,
) -> Registration:
    """Registers two scans.

    `init` is a pose (4, 4) that competes with those that the search finds; `max_rotation` (degrees) and `max_translation`
    (such as "50u", in data units, or "20pr") bound how far from it the answer may be. `up` says that both scans are levelled:
    the pose rotates only about this direction.
    """

def refine(
    source: Scan | str | os.PathLike[str] | ArrayLike,
    target: Scan | str | os.PathLike[str] | ArrayLike,
    init: ArrayLike,
    config: str = "default",
    *,
    settings: Mapping[str, object] | None = None,
    seed: int | None = None,
    max_rotation: float | None = None,
    max_translation: str | None = None,
    up: ArrayLike | None = None,
    threads: int | None = None,
) -> Registration:
    """Refines the rough pose `init` without a search, and judges the result."""

def reconstruct(
    scans: Sequence[Scan | str | os.PathLike[str] | ArrayLike],
    config: str = "default",
    *,
    settings: Mapping[str, object] | None = None,
    seed: int | None = None,
    threads: int | None = None,
) -> Model:
    """Registers every pair of scans and puts all scans into one frame."""
