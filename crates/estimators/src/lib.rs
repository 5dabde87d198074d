//! Hypothesis generators and the one loop that samples, scores and ranks.
