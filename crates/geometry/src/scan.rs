//! A scan as read from a file, and the same scan prepared for processing.

use crate::reach::Reach;
use crate::repeated::repeated;
use crate::{Coordinates, Point, RigidTransform, narrow, wide};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// Minimum number of points that one thread centres at a time.
const POINTS_AT_A_TIME: usize = 4096;

/// The contents of a file, unchanged: file coordinates, and every point, including invalid ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawScan {
    /// File coordinates.
    pub points: Coordinates,
    /// One for each point, of any length, if the file has them.
    pub normals: Option<Vec<Point>>,
    /// Faces split into triangles of point positions, each below the number of points. Empty for a point cloud.
    pub triangles: Vec<[u32; 3]>,
    /// Position of the scanner, file coordinates, if the file gives it.
    pub viewpoint: Option<[f64; 3]>,
    /// Names of the other data that the file has for each point, as far as its format names them: colours, intensities.
    /// The data are not kept.
    pub unread: Vec<String>,
}

impl RawScan {
    /// Returns the same scan moved rigidly, including normals and viewpoint.
    #[must_use]
    pub fn moved(&self, motion: &RigidTransform) -> RawScan {
        let placed = |p: [f64; 3]| (motion * Point3::from(p)).into();
        let turned = |&n: &Point| narrow(&(motion.rotation * wide(n)));
        RawScan {
            points: self.points.iter().map(placed).collect(),
            normals: self.normals.as_ref().map(|normals| normals.iter().map(turned).collect()),
            triangles: self.triangles.clone(),
            viewpoint: self.viewpoint.map(placed),
            unread: self.unread.clone(),
        }
    }
}

/// What was dropped when a scan was cleaned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Points with a coordinate that is NaN or infinite.
    pub non_finite: usize,
    /// Points that coincide with an earlier one, as far as `f32` can tell: within 10⁻¹² of the extent near the centre,
    /// within 3·10⁻⁸ of it at the rim.
    pub duplicates: usize,
    /// Points farther from all others than any scan reaches: what a program writes where nothing was measured.
    pub far: usize,
}

/// A cleaned scan: at least three distinct finite points, centred, in `f32`.
///
/// The centre is the middle of the bounding box, subtracted in `f64` before the coordinates are rounded to some 3·10⁻⁸
/// of the extent, wherever on earth the scan is.
#[derive(Clone, Debug)]
pub struct Scan {
    origin: Vector3<f64>,
    points: Vec<Point>,
    normals: Option<Vec<Point>>,
    triangles: Vec<[u32; 3]>,
    viewpoint: Option<Vector3<f64>>,
    dropped: Dropped,
}

/// Why a scan cannot be processed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScanError {
    /// Fewer than three distinct finite points.
    #[error("{distinct} distinct finite points of {total}; at least 3 are needed")]
    TooFewPoints {
        /// Number of points left.
        distinct: usize,
        /// Number of points given.
        total: usize,
    },
    /// The extent of the cloud cannot be squared in `f32`.
    #[error("the points span {extent:e} data units; rescale them to between 1e-9 and 1e12")]
    Extent {
        /// The longest side of the bounding box.
        extent: f64,
    },
}

impl Scan {
    /// Drops non-finite, far and repeated points (the first one stays), centres the rest, and keeps normals and
    /// triangles in step.
    ///
    /// Normals are scaled to unit length; a normal for which this is impossible is stored as zero.
    ///
    /// # Errors
    /// Fewer than three distinct points, or an extent outside 1e-9 to 1e12 data units.
    ///
    /// # Panics
    /// If there are not as many normals as points, or a triangle refers to a point that does not exist: the caller must
    /// ensure both.
    pub fn new(raw: &RawScan) -> Result<Scan, ScanError> {
        match &raw.points {
            Coordinates::Single(points) => Scan::of(points, raw),
            Coordinates::Double(points) => Scan::of(points, raw),
        }
    }

    /// Cleans the scan, given its points.
    fn of<T: Copy + Into<f64> + Sync>(raw_points: &[[T; 3]], raw: &RawScan) -> Result<Scan, ScanError> {
        let n_points = raw_points.len();
        assert!(raw.normals.as_ref().is_none_or(|n| n.len() == n_points), "one normal a point");
        let finite = |p: &[f64; 3]| p.iter().all(|v| v.is_finite());
        let all = || raw_points.iter().map(|p| p.map(Into::into));
        let n_finite = all().filter(finite).count();
        let reach = Reach::of(all().filter(finite), n_finite);
        let of_scan = |p: &[f64; 3]| finite(p) && reach.holds(p);
        let (low, high) = bounds(all().filter(of_scan));
        let extent = (high - low).max();
        if n_finite > 1 && extent > 0.0 && !(1e-9..=1e12).contains(&extent) {
            return Err(ScanError::Extent { extent });
        }
        let origin = low * 0.5 + high * 0.5;
        let distinguish = snapping(extent);

        // Dropped points become NaN.
        let centred = |p: &[T; 3]| {
            let p = p.map(Into::into);
            match of_scan(&p) {
                true => narrow(&(Vector3::from(p) - origin).map(&distinguish)).map(|v| v + 0.0),
                false => [f32::NAN; 3],
            }
        };
        let mut points: Vec<Point> = raw_points.par_iter().with_min_len(POINTS_AT_A_TIME).map(centred).collect();
        let left_out = points.iter().filter(|p| p[0].is_nan()).count();
        let repeated = repeated(&points);
        repeated.iter().for_each(|&(i, _)| points[i as usize] = [f32::NAN; 3]);
        let kept: Vec<bool> = points.iter().map(|p| !p[0].is_nan()).collect();
        points.retain(|p| !p[0].is_nan());
        let non_finite = n_points - n_finite;
        let dropped = Dropped { non_finite, duplicates: repeated.len(), far: left_out - non_finite };
        if points.len() < 3 {
            return Err(ScanError::TooFewPoints { distinct: points.len(), total: n_points });
        }
        let normals = raw.normals.as_ref().map(|all| {
            let of_kept = all.iter().zip(&kept).filter(|(_, kept)| **kept);
            of_kept.map(|(normal, _)| unit(*normal)).collect()
        });
        let triangles = if raw.triangles.is_empty() {
            Vec::new()
        } else {
            let mut new_index = numbered(&kept);
            repeated.iter().for_each(|&(i, first)| new_index[i as usize] = new_index[first as usize]);
            raw.triangles.iter().filter_map(|t| renumbered(t, &new_index)).collect()
        };
        let finite_viewpoint = raw.viewpoint.filter(finite);
        let viewpoint = finite_viewpoint.map(|v| Vector3::from(v) - origin);
        Ok(Scan { origin, points, normals, triangles, viewpoint, dropped })
    }

    /// Returns the centre, which was subtracted from the file's coordinates.
    #[must_use]
    pub fn origin(&self) -> &Vector3<f64> {
        &self.origin
    }

    /// Returns the centred points, in the order of the file.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Returns the file's own normals, unit length or zero.
    #[must_use]
    pub fn normals(&self) -> Option<&[Point]> {
        self.normals.as_deref()
    }

    /// Returns the triangles of point positions, three different ones each.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the position of the scanner, centred like the points; `None` if the file does not give it, or it is not
    /// finite.
    #[must_use]
    pub fn viewpoint(&self) -> Option<Vector3<f64>> {
        self.viewpoint
    }

    /// Returns what was dropped.
    #[must_use]
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// Returns the same scan, with the same origin, restricted to points for which `kept` holds and to triangles
    /// between them.
    pub(crate) fn only(&self, kept: &[bool]) -> Scan {
        let new_index = numbered(kept);
        let of = |all: &[Point]| all.iter().zip(kept).filter(|(_, kept)| **kept).map(|(point, _)| *point).collect();
        Scan {
            origin: self.origin,
            points: of(&self.points),
            normals: self.normals.as_deref().map(of),
            triangles: self.triangles.iter().filter_map(|t| renumbered(t, &new_index)).collect(),
            viewpoint: self.viewpoint,
            dropped: self.dropped,
        }
    }

    /// Returns the side lengths of the bounding box.
    #[must_use]
    pub fn extent(&self) -> Vector3<f64> {
        let (low, high) = bounds(self.points.iter().map(|p| p.map(f64::from)));
        high - low
    }
}

fn bounds(points: impl Iterator<Item = [f64; 3]>) -> (Vector3<f64>, Vector3<f64>) {
    let none = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    points.fold(none, |(low, high), p| (low.inf(&Vector3::from(p)), high.sup(&Vector3::from(p))))
}

/// Returns the new position of each point that is kept; `u32::MAX` for the others.
fn numbered(kept: &[bool]) -> Vec<u32> {
    let mut next = 0..;
    kept.iter().map(|kept| if *kept { next.next().unwrap_or(u32::MAX) } else { u32::MAX }).collect()
}

fn unit(normal: Point) -> Point {
    let v = crate::wide(normal);
    let length = v.norm();
    if length.is_finite() && length > 0.0 { narrow(&(v / length)) } else { [0.0; 3] }
}

/// Returns a triangle in the new numbering, or `None` if a corner was dropped or two have become one.
fn renumbered(triangle: &[u32; 3], new_index: &[u32]) -> Option<[u32; 3]> {
    let [a, b, c] = triangle.map(|i| new_index[i as usize]);
    let whole = [a, b, c].iter().all(|&i| i != u32::MAX) && a != b && b != c && c != a;
    whole.then_some([a, b, c])
}

/// Rounds coordinates to multiples of about 10⁻¹² of the extent, so that the squared distance between any two different
/// points is above zero in `f32` (numbers around zero are far finer than that). Other coordinates have fewer digits
/// anyway.
fn snapping(extent: f64) -> impl Fn(f64) -> f64 {
    let step = extent.log2().floor().exp2() * 2f64.powi(-40);
    // The sum has no digits below a step.
    let shift = 1.5 * 2f64.powi(52) * step;
    move |v| (v + shift) - shift
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::without_strays;

    fn cloud(points: &[[f64; 3]]) -> RawScan {
        RawScan { points: points.to_vec().into(), ..RawScan::default() }
    }

    #[test]
    fn a_moved_scan_takes_along_all_that_it_has() {
        let scan = RawScan {
            normals: Some(vec![[1.0, 0.0, 0.0]; 3]),
            triangles: vec![[0, 1, 2]],
            viewpoint: Some([1.0, 0.0, 0.0]),
            unread: vec!["red".to_owned()],
            ..cloud(&[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
        };
        let quarter = RigidTransform::new(Vector3::new(0.0, 0.0, 5.0), Vector3::z() * std::f64::consts::FRAC_PI_2);
        let moved = scan.moved(&quarter);
        assert!((Vector3::from(moved.points.at(0)) - Vector3::new(0.0, 1.0, 5.0)).norm() < 1e-12);
        assert!((wide(moved.normals.as_ref().unwrap()[0]) - Vector3::y()).norm() < 1e-6);
        assert_eq!(moved.viewpoint, moved.points.get(0));
        assert_eq!((moved.triangles, moved.unread), (scan.triangles, scan.unread));
    }

    #[test]
    fn broken_points_are_dropped_and_counted_and_indices_follow() {
        let raw = RawScan {
            points: vec![
                [0.0; 3],
                [f64::NAN, 0.0, 0.0],
                [2.0, 0.0, 0.0],
                [0.0, 0.0, -0.0],
                [0.0, 4.0, 0.0],
                [0.0, f64::INFINITY, 1.0],
            ]
            .into(),
            normals: Some(vec![
                [0.0, 0.0, 2.0],
                [1.0, 0.0, 0.0],
                [0.0; 3],
                [0.0, 1.0, 0.0],
                [f32::NAN, 0.0, 0.0],
                [0.0; 3],
            ]),
            triangles: vec![[0, 2, 4], [3, 2, 4], [0, 3, 2], [0, 1, 2]],
            viewpoint: Some([1.0, 2.0, 9.0]),
            ..RawScan::default()
        };
        let scan = Scan::new(&raw).unwrap();
        assert_eq!(scan.dropped(), Dropped { non_finite: 2, duplicates: 1, far: 0 });
        assert_eq!(scan.points(), [[-1.0, -2.0, 0.0], [1.0, -2.0, 0.0], [-1.0, 2.0, 0.0]]);
        assert_eq!(scan.normals().unwrap(), [[0.0, 0.0, 1.0], [0.0; 3], [0.0; 3]]);
        assert_eq!(scan.triangles(), [[0, 1, 2], [0, 1, 2]]);
        assert_eq!(scan.viewpoint(), Some(Vector3::new(0.0, 0.0, 9.0)));
        let nowhere = RawScan { viewpoint: Some([f64::NAN; 3]), ..raw };
        assert_eq!(Scan::new(&nowhere).unwrap().viewpoint(), None);
    }

    #[test]
    fn a_place_that_stands_for_nothing_measured_moves_no_point_of_the_scan() {
        let points: Vec<[f64; 3]> =
            (0..900).map(|i| [f64::from(i % 30) * 1e-3, f64::from(i / 30) * 1e-3, 1.0]).collect();
        let clean = Scan::new(&cloud(&points)).unwrap();
        for n_unmeasured in [1, 400] {
            let mut with_unmeasured = points.clone();
            with_unmeasured.splice(17..17, vec![[-9999.0; 3]; n_unmeasured]);
            let scan = Scan::new(&cloud(&with_unmeasured)).unwrap();
            assert_eq!(scan.dropped(), Dropped { far: n_unmeasured, ..Dropped::default() });
            assert_eq!((scan.points(), scan.origin()), (clean.points(), clean.origin()));
        }
    }

    #[test]
    fn too_few_points_are_an_error() {
        for (points, distinct) in [(vec![], 0), (vec![[1.0; 3]; 9], 1), (vec![[0.0; 3], [1.0; 3], [f64::NAN; 3]], 2)] {
            let total = points.len();
            assert_eq!(Scan::new(&cloud(&points)).unwrap_err(), ScanError::TooFewPoints { distinct, total });
        }
    }

    #[test]
    fn absurd_extents_are_an_error() {
        for scale in [1e-12, 1e200, f64::MAX] {
            let error = Scan::new(&cloud(&[[0.0; 3], [scale, 0.0, 0.0], [0.0, scale, 0.0]])).unwrap_err();
            assert!(matches!(error, ScanError::Extent { .. }), "{scale}: {error}");
        }
    }

    #[test]
    fn geographic_coordinates_keep_their_millimetres() {
        let at = |x: f64| [4.5e6 + x, 5.4e5, 300.0];
        let scan = Scan::new(&cloud(&[at(0.0), at(0.001), at(100.0)])).unwrap();
        assert!((scan.points()[1][0] - scan.points()[0][0] - 0.001).abs() < 1e-5);
    }

    #[test]
    fn points_whose_distance_is_nothing_in_single_precision_are_one() {
        for extent in [1e-9, 2.0, 1e12] {
            let half = 0.5 * extent;
            let points = vec![[half, 0.0, 0.0], [half, 1e-30, 0.0], [-half, 0.0, 0.0], [-half, 0.0, 1e-15 * extent]];
            let pairs = Scan::new(&RawScan { points: points.clone().into(), ..RawScan::default() });
            assert_eq!(pairs.unwrap_err(), ScanError::TooFewPoints { distinct: 2, total: 4 });
            let near = [[half, 2e-12 * extent, 0.0], [0.0, half, 0.0], [0.0, -half, 0.0]];
            let scan =
                Scan::new(&RawScan { points: [points, near.to_vec()].concat().into(), ..RawScan::default() }).unwrap();
            assert_eq!((scan.points().len(), scan.dropped().duplicates), (5, 2));
            let measured = crate::resolution_sampled(scan.points(), 10).unwrap();
            assert!(measured.median > 0.0 && without_strays(&scan, &measured).is_none());
        }
    }
}
