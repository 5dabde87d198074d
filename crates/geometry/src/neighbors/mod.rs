//! Neighbour search, with one structure for each pattern of queries.
//!
//! Arbitrary queries: [`NeighborIndex`]. All points of a cloud, one after the other: [`OrderedPoints`] and their
//! blocks. Many queries with one radius: [`RadiusSearch`]. Queries that hardly move from one time to the next:
//! [`LastSeen`]. Everything within a reach, again and again: [`NearestTable`]. All of these are exact; [`NearestField`]
//! serves where the nearest point to within a cell is enough.

pub(crate) mod blocks;
mod cells;
mod few_neighbors;
mod field;
mod following;
mod grid;
mod index;
mod nearest_table;
mod ordered;
mod radius;

pub use cells::Cells;
pub(crate) use few_neighbors::nearest_others;
pub use field::NearestField;
pub use following::LastSeen;
pub use index::{Neighbor, NeighborIndex};
pub use nearest_table::NearestTable;
pub use ordered::OrderedPoints;
pub(crate) use ordered::lesser;
pub use radius::RadiusSearch;
