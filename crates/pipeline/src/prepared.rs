//! Both surfaces of a pair, and the side to which their normals point.

use crate::{Pair, Signs};
use congruent_geometry::{Oriented, Surface, ViewKind};
use nalgebra::Vector3;

/// Surfaces, and how their normals were oriented.
#[derive(Clone)]
pub(crate) struct PreparedPair {
    pub(crate) surfaces: Pair<Surface>,
    /// How the normals were oriented.
    pub(crate) oriented: Pair<Oriented>,
}

impl PreparedPair {
    /// Turns the normals as an attempt asks; `None` if there are no uncertain signs to turn.
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
    /// Returns on which scan the normals are turned; `None` if there are no uncertain signs to turn.
    pub(crate) fn turned(self, oriented: &Pair<Oriented>) -> Option<Pair<bool>> {
        let kept = oriented.zip(Pair { source: oriented.target, target: oriented.source }).map(is_model_of);
        match self {
            Signs::Kept => Some(kept),
            Signs::Other if oriented.source.sure && oriented.target.sure => None,
            // Turning one scan is enough: what counts is whether the two agree.
            Signs::Other if oriented.source.sure => Some(Pair { target: !kept.target, ..kept }),
            Signs::Other => Some(Pair { source: !kept.source, ..kept }),
        }
    }
}

/// Returns whether a scan that seems to have been seen from within is a closed model, because the other scan shows an
/// object from one side: the normals of the model then point inwards and have to be turned.
fn is_model_of((scan, other): (Oriented, Oriented)) -> bool {
    scan.kind == Some(ViewKind::Within) && other.kind == Some(ViewKind::OneSide) && other.sure
}
