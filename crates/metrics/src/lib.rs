//! Hypothesis metrics: how good is a pose, given the correspondences.
