//! Where a cloud is near: a coarse yes or no that spares most neighbour searches.
//!
//! Most hypotheses bring most points nowhere near the target. A look into a grid says so at a hundredth of the cost of a
//! search, and never wrongly.

use congruent_geometry::Point;
use std::collections::BTreeSet;

/// More cells than this would cost more than they save; the cells grow instead.
const MAX_CELLS: f64 = 4e6;
/// Cells along the reach.
const FINENESS: f64 = 2.0;
/// Rounding must not lose a point at the very edge.
const MARGIN: f64 = 1.001;

/// The cells that hold all places within reach of a cloud, and some more.
pub(crate) struct Vicinity {
    low: Point,
    cell: f32,
    size: [usize; 3],
    near: Vec<bool>,
}

impl Vicinity {
    /// Around points, as far as `reach` (data units). Nothing for no points or a reach that is no positive number.
    pub(crate) fn new(points: &[Point], reach: f64) -> Option<Vicinity> {
        let first = *points.first()?;
        if !(reach.is_finite() && reach > 0.0) {
            return None;
        }
        let fold = |pick: fn(f32, f32) -> f32| {
            points.iter().fold(first, |a, p| std::array::from_fn(|axis| pick(a[axis], p[axis])))
        };
        let (low, high) = (fold(f32::min), fold(f32::max));
        let extent: [f64; 3] = std::array::from_fn(|axis| f64::from(high[axis]) - f64::from(low[axis]) + 4.0 * reach);
        let cells = extent.iter().product::<f64>() * (FINENESS / reach).powi(3);
        let cell = reach / FINENESS * (cells / MAX_CELLS).cbrt().max(1.0);
        let size = extent.map(|side| (side / cell).ceil() as usize + 1);
        let low = low.map(|v| (f64::from(v) - 2.0 * reach) as f32);
        let near = vec![false; size.iter().product()];
        let mut vicinity = Vicinity { low, cell: cell as f32, size, near };
        vicinity.mark(points, reach * MARGIN / cell);
        Some(vicinity)
    }

    /// Whether a point of the cloud may be within reach; where this says no, there is none.
    pub(crate) fn may_be_near(&self, point: &Point) -> bool {
        self.place(point).is_some_and(|place| self.near[place])
    }

    /// `reach` in cells.
    fn mark(&mut self, points: &[Point], reach: f64) {
        let occupied: BTreeSet<usize> = points.iter().filter_map(|p| self.place(p)).collect();
        let steps = reach.ceil() as isize + 1;
        let gap_sq = |step: isize| ((step.abs() - 1).max(0) as f64).powi(2);
        for place in occupied {
            let [x, y, z] = self.coordinates(place);
            for dz in -steps..=steps {
                for dy in -steps..=steps {
                    for dx in -steps..=steps {
                        if gap_sq(dx) + gap_sq(dy) + gap_sq(dz) <= reach * reach {
                            self.mark_one([
                                x.checked_add_signed(dx),
                                y.checked_add_signed(dy),
                                z.checked_add_signed(dz),
                            ]);
                        }
                    }
                }
            }
        }
    }

    fn mark_one(&mut self, cell: [Option<usize>; 3]) {
        let [Some(x), Some(y), Some(z)] = cell else { return };
        if x < self.size[0] && y < self.size[1] && z < self.size[2] {
            self.near[(z * self.size[1] + y) * self.size[0] + x] = true;
        }
    }

    fn coordinates(&self, place: usize) -> [usize; 3] {
        let [nx, ny, _] = self.size;
        [place % nx, place / nx % ny, place / nx / ny]
    }

    fn place(&self, point: &Point) -> Option<usize> {
        let mut cells = [0; 3];
        for (axis, cell) in cells.iter_mut().enumerate() {
            let at = (point[axis] - self.low[axis]) / self.cell;
            if !(at >= 0.0 && at < self.size[axis] as f32) {
                return None;
            }
            *cell = at as usize;
        }
        Some((cells[2] * self.size[1] + cells[1]) * self.size[0] + cells[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::NeighborIndex;
    use congruent_geometry::random::Stream;

    fn scatter(n: usize, half: f64, seed: u64) -> Vec<Point> {
        let mut stream = Stream::new(seed, 0);
        (0..n).map(|_| std::array::from_fn(|_| stream.between(-half, half) as f32)).collect()
    }

    #[test]
    fn no_point_within_reach_is_missed_and_most_of_the_others_are_spared() {
        let cloud = scatter(40, 50.0, 1);
        let index = NeighborIndex::new(&cloud);
        for reach in [0.001, 3.0, 11.0, 400.0] {
            let vicinity = Vicinity::new(&cloud, reach).unwrap();
            for query in scatter(20_000, 80.0, 2).iter().chain(&cloud) {
                let distance = f64::from(index.nearest(query).unwrap().distance_sq).sqrt();
                assert!(distance > reach || vicinity.may_be_near(query), "{reach} {distance}");
            }
        }
        let spared = Vicinity::new(&cloud, 3.0).unwrap();
        let asked = scatter(20_000, 80.0, 2).iter().filter(|q| spared.may_be_near(q)).count();
        assert!(asked < 1500, "{asked}");
    }

    #[test]
    fn without_points_or_reach_there_is_no_vicinity() {
        assert!(Vicinity::new(&[], 1.0).is_none());
        for reach in [0.0, -1.0, f64::INFINITY, f64::NAN] {
            assert!(Vicinity::new(&[[0.0; 3]], reach).is_none());
        }
        // Of no extent at all.
        assert!(Vicinity::new(&[[5.0; 3]; 3], 1.0).unwrap().may_be_near(&[5.0; 3]));
    }
}
