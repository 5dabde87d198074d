//! From the poses that pairs propose to the poses of all scans.

use crate::{Conflict, Proposal, Surfaces};
use congruent_multiway::{Candidate, Fate, Reconstruction, Settings, reconstruct};

/// What a list of proposals comes to.
#[derive(Clone, Debug)]
pub struct Solved {
    /// The proposals in their order, each with its fate.
    pub proposals: Vec<Judged>,
    /// The poses of all scans; its fates are those of the proposals that are candidates.
    pub result: Reconstruction,
    /// Scans of a component that contradict each other under their poses, the largest contradiction first.
    pub conflicts: Vec<Conflict>,
}

/// A proposal, and what became of it.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The proposal as it was made.
    pub proposal: Proposal,
    /// What the solution did with it; `None` if it is no candidate, because the surfaces do not touch.
    pub fate: Option<Fate>,
}

impl Solved {
    /// Solves for the poses of all scans, with the usual settings.
    ///
    /// # Panics
    /// If a candidate refers to a scan that does not exist.
    #[must_use]
    pub fn new(proposals: Vec<Proposal>, surfaces: &Surfaces) -> Solved {
        let candidates: Vec<Candidate> = proposals.iter().filter_map(|p| p.candidate.clone()).collect();
        let result = reconstruct(&surfaces.nodes(), &candidates, surfaces, &Settings::new(surfaces.pr()));
        let conflicts = surfaces.conflicts(&result);
        Solved { proposals: judged(proposals, &result.fates), result, conflicts }
    }
}

/// Gives each proposal with a candidate the next fate.
fn judged(proposals: Vec<Proposal>, fates: &[Fate]) -> Vec<Judged> {
    let mut fates = fates.iter();
    let judge = |proposal: Proposal| {
        let fate = proposal.candidate.as_ref().and_then(|_| fates.next()).copied();
        Judged { proposal, fate }
    };
    proposals.into_iter().map(judge).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::RigidTransform;
    use congruent_multiway::{Belief, Touch};
    use nalgebra::Matrix6;

    #[test]
    fn a_proposal_without_contact_takes_no_fate_from_the_others() {
        let touch = Touch { information: Matrix6::identity(), support: 1.0, residual: 0.1 };
        let candidate = Candidate {
            source: 1,
            target: 0,
            target_from_source: RigidTransform::identity(),
            touch,
            confidence: 0.5,
            belief: Belief::Believed,
        };
        let proposal =
            |touches: bool| Proposal { pair: 0, confidence: 0.5, candidate: touches.then(|| candidate.clone()) };
        let judged = judged([true, false, true].map(proposal).to_vec(), &[Fate::Outvoted, Fate::Kept]);
        let fates: Vec<Option<Fate>> = judged.iter().map(|judged| judged.fate).collect();
        assert_eq!(fates, [Some(Fate::Outvoted), None, Some(Fate::Kept)]);
    }
}
