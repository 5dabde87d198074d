//! `congruent convert`: the same scan in another format.

use crate::args::ConvertArgs;
use crate::output;
use anyhow::Result;
use std::process::ExitCode;

pub(super) fn run(args: &ConvertArgs) -> Result<ExitCode> {
    let scan = congruent_io::read_scan(&args.from)?;
    let written = congruent_io::write_scan(&args.to, &scan)?;
    let to = args.to.display();
    for loss in &written.lost {
        output::remark(&format!("warning: {to}: {} does not hold {loss}", written.format));
    }
    let (format, points) = (written.format, written.points);
    output::data(&format!("{to}: {format}, {points} points, {} faces, {} normals", written.triangles, written.normals));
    Ok(ExitCode::SUCCESS)
}
