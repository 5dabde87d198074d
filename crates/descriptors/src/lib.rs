//! Local reference frames and descriptors: what a surface looks like around a keypoint.
//!
//! A [`Descriptor`] turns a point of a [`Surface`](congruent_geometry::Surface) and its surroundings into numbers that
//! do not change when the surface moves; [`Features`] is a table of them. A [`ReferenceFrame`] gives a point its own
//! axes. [`DescriptorConfig`] and [`FrameConfig`] are a user's choice of one.

mod config;
mod descriptor;
mod features;
mod fpfh;
mod frames;
mod lfsh;
mod neighborhood;
mod pair;
mod shot;
mod spin_image;
#[cfg(test)]
mod testing;

pub use config::DescriptorConfig;
pub use descriptor::Descriptor;
pub use features::Features;
pub use fpfh::{Fpfh, FpfhConfig, FpfhVariant};
pub use frames::{
    FrameConfig, LocalFrame, Margins, ReferenceFrame, ShotFrame, ShotFrameConfig, ToldiFrame, ToldiFrameConfig,
};
pub use lfsh::{Lfsh, LfshConfig};
pub use shot::{Shot, ShotConfig};
pub use spin_image::{SpinImage, SpinImageConfig};
