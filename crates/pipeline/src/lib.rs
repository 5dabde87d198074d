//! From two scans to one pose with a verdict: the chain of all stages.
