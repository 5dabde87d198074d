//! Non-maximum suppression: keeps the points whose response is the largest in their neighbourhood.

use crate::Keypoint;
use crate::detector::POINTS_AT_A_TIME;
use congruent_geometry::{RadiusSearch, Surface};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Which of neighbours with exactly equal responses are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ties {
    /// The one with the lowest index.
    #[default]
    LowestIndex,
    /// All of them, as in PCL: on a surface without noise that may be every point.
    KeepAll,
}

impl Ties {
    fn beats(self, (other, other_index): (f64, u32), (own, own_index): (f64, u32)) -> bool {
        other > own || (self == Ties::LowestIndex && other == own && other_index < own_index)
    }
}

/// Returns the points that no other point within `radius` (inclusive, data units) beats; ascending by index.
///
/// `responses` holds one entry for each point of the surface; points with `None` or a non-finite response are not kept
/// and do not beat others. A point that is itself beaten still beats weaker ones.
///
/// # Panics
/// If there are not as many responses as points.
#[must_use]
pub fn local_maxima(surface: &Surface, responses: &[Option<f64>], radius: f64, ties: Ties) -> Vec<Keypoint> {
    assert_eq!(responses.len(), surface.len(), "each point has its response");
    let around = RadiusSearch::new(surface, radius);
    let keypoint = |index: u32| {
        let response = responses[index as usize].filter(|r| r.is_finite())?;
        let mut beaten = false;
        around.visit(&surface.points()[index as usize], |n| {
            if let Some(other) = responses[n.index as usize].filter(|r| r.is_finite()) {
                beaten |= ties.beats((other, n.index), (response, index));
            }
        });
        (!beaten).then_some(Keypoint { index, response })
    };
    (0..surface.len() as u32).into_par_iter().with_max_len(POINTS_AT_A_TIME).filter_map(keypoint).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::indices;
    use congruent_simulation::testing::surface;

    fn kept(responses: &[Option<f64>], ties: Ties) -> Vec<u32> {
        let line = surface((0..responses.len()).map(|i| [i as f32, 0.0, 0.0]).collect());
        indices(&local_maxima(&line, responses, 1.0, ties))
    }

    #[test]
    fn only_the_largest_of_a_neighborhood_stays() {
        let responses = [1.0, 2.0, 1.0, 3.0, 4.0, 5.0].map(Some);
        for ties in [Ties::LowestIndex, Ties::KeepAll] {
            assert_eq!(kept(&responses, ties), [1, 5]);
        }
    }

    #[test]
    fn ties_go_to_the_lowest_index_or_to_all() {
        let responses = [1.0, 2.0, 2.0, 1.0].map(Some);
        assert_eq!(kept(&responses, Ties::LowestIndex), [1]);
        assert_eq!(kept(&responses, Ties::KeepAll), [1, 2]);
    }

    #[test]
    fn points_without_a_finite_response_neither_stay_nor_beat() {
        let responses = [Some(1.0), None, Some(-1.0), Some(f64::NAN), Some(-2.0), Some(f64::INFINITY)];
        assert_eq!(kept(&responses, Ties::LowestIndex), [0, 2, 4]);
    }
}
