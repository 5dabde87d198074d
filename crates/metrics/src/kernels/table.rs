//! A tabulated function on [0, 1], for gains that are slow to compute.

/// Number of intervals of linear interpolation; its error is below 1e-5 for the gains here.
const STEPS: usize = 1024;

/// Values at `i / STEPS`; zero from 1 on.
#[derive(Clone, Debug)]
pub(super) struct Table(Box<[f32; STEPS + 2]>);

impl Table {
    pub(super) fn new(value: impl Fn(f64) -> f64) -> Self {
        let at = |i: usize| if i < STEPS { value(i as f64 / STEPS as f64) as f32 } else { 0.0 };
        Table(Box::new(std::array::from_fn(at)))
    }

    /// Returns the value at `x`, which must not be negative.
    #[inline(always)]
    pub(super) fn at(&self, x: f32) -> f32 {
        let place = x.min(1.0) * STEPS as f32;
        let step = (place as usize).min(STEPS);
        let (low, high) = (self.0[step], self.0[step + 1]);
        low + (high - low) * (place - step as f32)
    }
}
