//! The program `congruent`.
fn main() {}
