//! Times every stage of the chain separately: `cargo bench -p congruent-pipeline --bench stages [NAME]`.
//!
//! The input is a simulated scan of about 40 000 points, or the file that `SCAN` names. `RAYON_NUM_THREADS` sets the
//! number of threads.

mod work;

use std::path::Path;
use std::sync::LazyLock;
use work::{Inputs, STAGES, Stage};

static INPUTS: LazyLock<Inputs> = LazyLock::new(|| {
    let scan = std::env::var_os("SCAN");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    Inputs::new(scan.as_deref().map(Path::new), folder).expect("a scan that can be worked on")
});

fn main() {
    divan::main();
}

#[divan::bench(args = STAGES, sample_count = 10, sample_size = 1)]
fn stages(bencher: divan::Bencher<'_, '_>, stage: &Stage) {
    let inputs = &*INPUTS;
    bencher.bench(|| (stage.run)(inputs));
}
