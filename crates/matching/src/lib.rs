//! From two tables of descriptors to ranked correspondences.
