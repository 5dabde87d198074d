//! `congruent convert`: the same scan in another format.

use super::Reading;
use crate::args::ConvertArgs;
use crate::{output, outputs};
use anyhow::Result;
use congruent_geometry::RawScan;
use congruent_io::Written;
use std::path::Path;
use std::process::ExitCode;

pub(super) fn run(args: &ConvertArgs) -> Result<ExitCode> {
    outputs::check(&[&args.from], &[&args.to])?;
    let scan = Reading::new(args.reading).raw(&args.from)?;
    let written = congruent_io::write_scan(&args.to, &scan)?;
    warn_of_losses(&args.to, &scan, &written);
    let to = args.to.display();
    let (format, points) = (written.format, written.points);
    output::data(&format!(
        "{to}: {format}, {points} points, {} faces, {} normals",
        written.triangles, written.normals
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// Warns about data of a scan that its file does not hold.
pub(super) fn warn_of_losses(path: &Path, scan: &RawScan, written: &Written) {
    if !scan.unread.is_empty() {
        output::remark(&format!("warning: {}: without {}", path.display(), scan.unread.join(", ")));
    }
    for loss in &written.lost {
        output::remark(&format!("warning: {}: {} does not hold {loss}", path.display(), written.format));
    }
}
