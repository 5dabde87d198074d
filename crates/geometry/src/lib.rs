//! Points, surfaces and rigid motions: the foundation of every stage of Congruent.
//!
//! A [`RawScan`] holds the contents of a file; [`Scan::new`] cleans and centres it. A [`Surface`] adds unit normals, a
//! neighbour index and the resolution, and is what detectors and descriptors work on.

mod bounds;
mod coarse_mesh;
mod coordinates;
mod distant;
mod fit;
mod flatness;
pub mod lanes;
mod length;
mod neighbors;
mod normals;
pub mod numbers;
pub mod random;
mod reach;
mod repeated;
mod resolution;
mod roughness;
mod scan;
mod spare;
mod strays;
mod surface;
mod transform;
mod view;
mod voxel;

pub use coarse_mesh::samples_of_coarse_mesh;
pub use coordinates::Coordinates;
pub use fit::{fit_three, fit_weighted};
pub use flatness::{MOSTLY_FLAT, flatness};
pub use length::{Length, LengthError};
pub use neighbors::{
    Cells, LastSeen, NearestField, NearestTable, Neighbor, NeighborIndex, OrderedPoints, RadiusSearch,
};
pub use normals::{Neighborhood, Orientation, Oriented, OuterSum, PointNormal, SortedEigen};
pub use normals::{estimate_normals, orient, sorted_eigen, vertex_normals};
pub use resolution::{Resolution, Spacings, resolution, resolution_at, resolution_sampled};
pub use roughness::roughness;
pub use scan::{Dropped, RawScan, Scan, ScanError};
pub use spare::Spare;
pub use strays::without_strays;
pub use surface::Surface;
pub use transform::{RigidTransform, angle_between, from_rows, mean_displacement, to_rows, uncentred};
pub use view::{Camera, Scanner, Turning, View, ViewKind, estimate_view, view_of_scanner};
pub use voxel::{Sample, most_central, voxel_centroids, voxel_count};

/// A point or a normal as stored: three `f32` values, in centred coordinates.
pub type Point = [f32; 3];

/// Widens the three values to `f64` for arithmetic.
#[inline]
#[must_use]
pub fn wide(p: Point) -> nalgebra::Vector3<f64> {
    nalgebra::Vector3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))
}

/// Narrows the three values to `f32` for storage.
#[inline]
#[must_use]
pub fn narrow(v: &nalgebra::Vector3<f64>) -> Point {
    [v.x as f32, v.y as f32, v.z as f32]
}
