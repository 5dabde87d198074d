//! The points of a file as they are read: all of them, or one for each cell of a grid.

use congruent_geometry::{Coordinates, Point, RawScan};
use rustc_hash::FxHashMap;

/// Which points of a file are kept.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Keep {
    /// All of them, unchanged.
    All,
    /// In each cubic cell of this side (file units) the point nearest to the cell's centre; none that is not finite.
    OnePerCell(f64),
}

/// Points that were kept so far, with their normals if every point has one.
pub(crate) struct Gathered {
    points: Coordinates,
    normals: Option<Vec<Point>>,
    grid: Option<Grid>,
}

/// What the numbers of a file need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Precision {
    /// Each coordinate is an `f32`.
    Single,
    Double,
}

impl Gathered {
    /// Without points, for points without normals whose coordinates need this precision.
    pub(crate) fn new(keep: Keep, precision: Precision) -> Self {
        let grid = match keep {
            Keep::All => None,
            Keep::OnePerCell(leaf) => Some(Grid::new(leaf)),
        };
        let points = match precision {
            Precision::Single => Coordinates::Single(Vec::new()),
            Precision::Double => Coordinates::Double(Vec::new()),
        };
        Gathered { points, normals: None, grid }
    }

    /// Without points, for points with normals.
    pub(crate) fn with_normals(keep: Keep, precision: Precision) -> Self {
        Gathered { normals: Some(Vec::new()), ..Gathered::new(keep, precision) }
    }

    /// Allocates memory for so many points of the file, if all are kept.
    pub(crate) fn reserve(&mut self, n: usize) {
        if self.grid.is_none() {
            match &mut self.points {
                Coordinates::Single(points) => points.reserve(n),
                Coordinates::Double(points) => points.reserve(n),
            }
            self.normals.iter_mut().for_each(|normals| normals.reserve(n));
        }
    }

    /// All points so far, if they are kept in `f32` and without more: whoever has others may put them there.
    pub(crate) fn plain(&mut self) -> Option<&mut Vec<[f32; 3]>> {
        match (&self.grid, &self.normals, &mut self.points) {
            (None, None, Coordinates::Single(points)) => Some(points),
            _ => None,
        }
    }

    /// Adds points without normals.
    #[inline]
    pub(crate) fn extend(&mut self, points: impl Iterator<Item = [f64; 3]>) {
        match (&self.grid, &mut self.points) {
            (None, Coordinates::Single(kept)) => kept.extend(points.map(single)),
            (None, Coordinates::Double(kept)) => kept.extend(points),
            (Some(_), _) => points.for_each(|point| _ = self.push(point, None)),
        }
    }

    /// Adds one point, and returns the number of the kept one that stands for it. After a point without a normal there are
    /// no normals any more.
    #[inline]
    pub(crate) fn push(&mut self, point: [f64; 3], normal: Option<Point>) -> Option<usize> {
        if normal.is_none() {
            self.normals = None;
        }
        let place = match &mut self.grid {
            None => Place::New,
            Some(grid) => grid.place(&point, &self.points),
        };
        let normals = self.normals.as_mut().zip(normal);
        match place {
            Place::New => {
                match &mut self.points {
                    Coordinates::Single(points) => points.push(single(point)),
                    Coordinates::Double(points) => points.push(point),
                }
                normals.into_iter().for_each(|(normals, normal)| normals.push(normal));
                Some(self.points.len() - 1)
            }
            Place::Nearer(kept) => {
                match &mut self.points {
                    Coordinates::Single(points) => points[kept] = single(point),
                    Coordinates::Double(points) => points[kept] = point,
                }
                normals.into_iter().for_each(|(normals, normal)| normals[kept] = normal);
                Some(kept)
            }
            Place::Farther(kept) => Some(kept),
            Place::Nowhere => None,
        }
    }

    /// Returns what was kept, as a scan without faces.
    pub(crate) fn into_scan(self) -> RawScan {
        RawScan { points: self.points, normals: self.normals, ..RawScan::default() }
    }
}

/// A point whose coordinates are all `f32`, as one.
#[inline]
fn single(point: [f64; 3]) -> [f32; 3] {
    point.map(|v| v as f32)
}

impl Keep {
    /// Keeps the points that are to be kept of a scan that was read whole.
    ///
    /// The corners of triangles become the points that stand for them; triangles of which two corners become the same
    /// point are dropped, so a mesh of triangles larger than the cells keeps them.
    pub(crate) fn of(self, scan: RawScan) -> RawScan {
        if matches!(self, Keep::All) {
            return scan;
        }
        let precision = match scan.points {
            Coordinates::Single(_) => Precision::Single,
            Coordinates::Double(_) => Precision::Double,
        };
        let normals = scan.normals.as_ref();
        let mut kept = match normals {
            None => Gathered::new(self, precision),
            Some(_) => Gathered::with_normals(self, precision),
        };
        let points = scan.points.iter().enumerate();
        let kept_as: Vec<_> = points.map(|(i, point)| kept.push(point, normals.map(|normals| normals[i]))).collect();
        let corner = |&i: &u32| kept_as[i as usize].map(|kept| kept as u32);
        let triangle = |[a, b, c]: &[u32; 3]| Some([corner(a)?, corner(b)?, corner(c)?]);
        let is_left = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
        let triangles = scan.triangles.iter().filter_map(triangle).filter(is_left).collect();
        let RawScan { points, normals, .. } = kept.into_scan();
        RawScan { points, normals, triangles, ..scan }
    }
}

/// Where a point belongs.
enum Place {
    /// In a cell without points.
    New,
    /// In the cell of this kept point, and nearer to the cell's centre.
    Nearer(usize),
    /// In the cell of this kept point, and no nearer to the cell's centre.
    Farther(usize),
    /// In no cell, because it is not finite.
    Nowhere,
}

/// The bits of a cell's coordinates, in cells: as numbers they reach as far as any point, however small the cells are.
type Cell = [u64; 3];

/// Cubic cells and which point was kept of each.
struct Grid {
    leaf: f64,
    kept: FxHashMap<Cell, usize>,
}

impl Grid {
    fn new(leaf: f64) -> Self {
        Grid { leaf, kept: FxHashMap::default() }
    }

    /// Finds the place of a point among the points that are kept, and takes the cell for it if that is free.
    fn place(&mut self, point: &[f64; 3], points: &Coordinates) -> Place {
        if !point.iter().all(|v| v.is_finite()) {
            return Place::Nowhere;
        }
        let kept = *self.kept.entry(self.cell(point)).or_insert(points.len());
        match points.get(kept) {
            None => Place::New,
            // Equally near ones are ordered by their coordinates, so that the order of the file does not matter.
            Some(other) if (self.distance_sq(point), *point) < (self.distance_sq(&other), other) => Place::Nearer(kept),
            Some(_) => Place::Farther(kept),
        }
    }

    fn cell(&self, point: &[f64; 3]) -> Cell {
        point.map(|v| {
            let place = (v / self.leaf).floor();
            // Beyond all numbers every point is alone. The sum makes zero of minus zero.
            (if place.is_finite() { place } else { v } + 0.0).to_bits()
        })
    }

    /// Squared distance to the centre of the point's own cell, in cells.
    fn distance_sq(&self, point: &[f64; 3]) -> f64 {
        let offset = |v: f64| (v / self.leaf) - (v / self.leaf).floor() - 0.5;
        point.iter().map(|&v| offset(v) * offset(v)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gathered(points: &[[f64; 3]], leaf: f64) -> RawScan {
        let mut gathered = Gathered::with_normals(Keep::OnePerCell(leaf), Precision::Double);
        for point in points {
            gathered.push(*point, Some(point.map(|v| v as f32)));
        }
        gathered.into_scan()
    }

    /// A wavy sheet, about four points a cell of side 1.
    fn sheet() -> Vec<[f64; 3]> {
        let at = |i: i32, j: i32| [0.5 * f64::from(i) + 0.01 * f64::from(j % 7), 0.5 * f64::from(j) - 20.0, 0.3];
        (0..80).flat_map(|i| (0..80).map(move |j| at(i, j))).collect()
    }

    #[test]
    fn one_point_of_each_cell_is_kept_the_nearest_to_its_centre() {
        let points = sheet();
        let kept = gathered(&points, 1.0);
        let mut nearest = std::collections::BTreeMap::<[i64; 3], [f64; 3]>::new();
        let from_centre = |p: &[f64; 3]| p.iter().map(|v| (v - v.floor() - 0.5).powi(2)).sum::<f64>();
        for point in &points {
            let best = nearest.entry(point.map(|v| v.floor() as i64)).or_insert(*point);
            if from_centre(point) < from_centre(best) {
                *best = *point;
            }
        }
        let mut sorted = kept.points.to_vec();
        sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
        let mut expected: Vec<_> = nearest.into_values().collect();
        expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert_eq!(sorted, expected);
        assert!(kept.points.len() * 3 < points.len(), "{} of {}", kept.points.len(), points.len());
        let normals = kept.normals.unwrap();
        assert!(kept.points.iter().zip(&normals).all(|(point, normal)| point.map(|v| v as f32) == *normal));
    }

    #[test]
    fn the_order_of_the_points_decides_only_their_order() {
        let mut points = sheet();
        points.extend([[0.25, 0.75, 0.5], [0.75, 0.25, 0.5], [0.75, 0.75, 0.5]]); // Equally near to their centre.
        let sorted = |mut points: Vec<[f64; 3]>| {
            points.sort_by(|a, b| a.partial_cmp(b).unwrap());
            points
        };
        let forwards = sorted(gathered(&points, 1.0).points.to_vec());
        points.reverse();
        assert_eq!(forwards, sorted(gathered(&points, 1.0).points.to_vec()));
    }

    #[test]
    fn thinning_again_changes_nothing() {
        let once = gathered(&sheet(), 1.3);
        assert_eq!(gathered(&once.points.to_vec(), 1.3), once);
        assert_eq!(Keep::OnePerCell(1.3).of(once.clone()), once);
    }

    #[test]
    fn what_is_not_finite_has_no_place_and_what_is_far_away_has_one() {
        let points =
            [[0.1; 3], [f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [1e300; 3], [-1e300, 0.0, 0.0], [0.2; 3]];
        assert_eq!(gathered(&points, 1e-3).points, [[0.1; 3], [1e300; 3], [-1e300, 0.0, 0.0], [0.2; 3]]);
        assert_eq!(gathered(&points, 1.0).points, [[0.2; 3], [1e300; 3], [-1e300, 0.0, 0.0]]);
        // Cells so small that each holds one point, but for zeros of both signs.
        let mut sheet = sheet();
        for leaf in [1e-12, 1e-300, 1e-310] {
            assert_eq!(gathered(&sheet, leaf).points, sheet, "{leaf}");
        }
        sheet.push([-0.0, -20.0, 0.3]);
        sheet.push([0.0, -20.0, 0.3]);
        assert_eq!(gathered(&sheet, 1e-310).points.len(), sheet.len() - 2);
    }

    #[test]
    fn a_fine_mesh_becomes_coarse_and_a_coarse_one_stays() {
        let point = |i: u32| [f64::from(i % 9), f64::from(i / 9), 0.5];
        let cells = (0..8).flat_map(|row| (0..8).map(move |column| 9 * row + column));
        let mesh = RawScan {
            points: (0..81).map(point).collect(),
            normals: Some((0..81u8).map(|i| [i.into(), 0.0, 1.0]).collect()),
            triangles: cells.flat_map(|i: u32| [[i, i + 1, i + 10], [i, i + 10, i + 9]]).collect(),
            viewpoint: Some([4.0, 4.0, 9.0]),
            ..RawScan::default()
        };
        assert_eq!(Keep::OnePerCell(0.9).of(mesh.clone()), mesh);
        let coarse = Keep::OnePerCell(3.0).of(mesh.clone());
        assert_eq!(coarse.points.len(), 9);
        // Two triangles for each of 2 × 2 squares, and no folded ones.
        assert_eq!(coarse.triangles.len(), 8);
        assert_eq!(coarse.viewpoint, mesh.viewpoint);
        let normals = coarse.normals.as_ref().unwrap();
        let number = |p: [f64; 3]| (9.0 * p[1] + p[0]) as f32;
        assert!(coarse.points.iter().zip(normals).all(|(point, normal)| number(point) == normal[0]));
        let broken =
            RawScan { points: vec![[0.0; 3], [5.0; 3], [f64::NAN; 3]].into(), triangles: vec![[0, 1, 2]], ..coarse };
        let broken = Keep::OnePerCell(1.0).of(RawScan { normals: None, ..broken });
        assert_eq!((broken.points.len(), broken.triangles.len()), (2, 0));
    }
}
