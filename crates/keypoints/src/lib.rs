//! Keypoint detectors: where a surface is worth describing.
