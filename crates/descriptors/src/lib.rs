//! Local reference frames and descriptors: what a surface looks like around a keypoint.
