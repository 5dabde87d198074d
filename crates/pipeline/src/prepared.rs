//! Both surfaces of a pair, and which way their normals point.

use crate::{Pair, Signs};
use congruent_geometry::{Oriented, Surface, ViewKind};
use nalgebra::Vector3;

/// Surfaces and what they came from.
#[derive(Clone)]
pub(crate) struct PreparedPair {
    pub(crate) surfaces: Pair<Surface>,
    /// How their normals were oriented.
    pub(crate) oriented: Pair<Oriented>,
}

impl PreparedPair {
    /// With the signs that an attempt asks for; nothing where there is nothing to turn.
    pub(crate) fn with_signs(self, signs: Signs) -> Option<Self> {
        let turned = signs.turned(&self.oriented)?;
        let turn = |(surface, turned): (Surface, bool)| if turned { surface.flipped() } else { surface };
        Some(PreparedPair { surfaces: self.surfaces.zip(turned).map(turn), ..self })
    }

    pub(crate) fn trusted_viewpoints(&self) -> Pair<Option<Vector3<f64>>> {
        self.oriented.map(|oriented| oriented.viewpoint.filter(|_| oriented.sure))
    }
}

impl Signs {
    /// On which scan the normals are turned; nothing where there is nothing to turn.
    pub(crate) fn turned(self, oriented: &Pair<Oriented>) -> Option<Pair<bool>> {
        let kept = oriented.zip(Pair { source: oriented.target, target: oriented.source }).map(is_model_of);
        match self {
            Signs::Kept => Some(kept),
            Signs::Other if oriented.source.sure && oriented.target.sure => None,
            // One scan is enough: what counts is whether the two agree.
            Signs::Other if oriented.source.sure => Some(Pair { target: !kept.target, ..kept }),
            Signs::Other => Some(Pair { source: !kept.source, ..kept }),
        }
    }
}

/// Whether what seems to have been seen from within is a closed model after all, because the other scan shows an object
/// from one side: then its normals point inwards.
fn is_model_of((scan, other): (Oriented, Oriented)) -> bool {
    scan.kind == Some(ViewKind::Within) && other.kind == Some(ViewKind::OneSide) && other.sure
}
