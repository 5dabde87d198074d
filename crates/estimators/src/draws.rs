//! Draws without replacement.

use congruent_geometry::random::Stream;

/// Draws two different numbers below `n`, each ordered pair with the same chance. `n` must be at least two.
pub(crate) fn two_of(n: u32, stream: &mut Stream) -> [u32; 2] {
    let first = stream.below(n);
    // The number already taken is skipped.
    let second = stream.below(n - 1);
    [first, second + u32::from(second >= first)]
}

/// Draws three different numbers below `n`, each ordered triple with the same chance. `n` must be at least three.
pub(crate) fn three_of(n: u32, stream: &mut Stream) -> [u32; 3] {
    let [first, second] = two_of(n, stream);
    // Numbers already taken are skipped, lowest first.
    let mut third = stream.below(n - 2);
    third += u32::from(third >= first.min(second));
    third += u32::from(third >= first.max(second));
    [first, second, third]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triples_are_different_and_even() {
        let mut stream = Stream::new(5, 0);
        let mut counts = std::collections::BTreeMap::new();
        for _ in 0..24_000 {
            let [a, b, c] = three_of(4, &mut stream);
            assert!(a != b && b != c && a != c);
            *counts.entry([a, b, c]).or_insert(0u32) += 1;
        }
        // 24 ordered triples, 1000 of each expected, with a standard deviation of 31.
        assert!(counts.len() == 24 && counts.values().all(|&c| c.abs_diff(1000) < 160), "{counts:?}");
    }
}
