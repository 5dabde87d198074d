//! Joins the parts of a batch that was run with `--shard`.

use super::results::{CONFIGURATION, ROWS, put};
use super::row::Row;
use super::run::Run;
use crate::args::MergeArgs;
use crate::journal::read_rows;
use crate::output;
use anyhow::{Context, Result, bail};
use congruent_io::write_file;
use std::collections::HashSet;
use std::process::ExitCode;

/// Joins the folders of shards into one. Nothing is written unless all pairs are there.
pub(crate) fn merge(args: &MergeArgs) -> Result<ExitCode> {
    let mut whole = Run::read(&args.parts[0])?.whole();
    let (mut rows, mut ids) = (Vec::new(), HashSet::new());
    for part in &args.parts {
        let run = Run::read(part)?;
        if let Some(difference) = whole.other_pairs(&run).or_else(|| whole.difference(&run)) {
            bail!("{}: is not part of the same run as {}: {difference}", part.display(), args.parts[0].display());
        }
        whole = whole.completed(&run);
        for row in read_rows::<Row>(&part.join(ROWS))? {
            if !ids.insert(row.id.clone()) {
                bail!("{}: the pair `{}` is in two parts; name each shard once", part.display(), row.id);
            }
            rows.push(row);
        }
    }
    if ids.len() < whole.pairs {
        let (there, all) = (ids.len(), whole.pairs);
        bail!("only {there} of {all} pairs are present; name the other shards too, or finish them with --resume");
    }
    let folder = &args.output;
    if folder.join(ROWS).exists() {
        bail!("{}: already contains results; choose another folder", folder.display());
    }
    let settings = args.parts[0].join(CONFIGURATION);
    let text = std::fs::read(&settings).with_context(|| format!("{}: cannot be read", settings.display()))?;
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot be created", folder.display()))?;
    write_file(&folder.join(CONFIGURATION), &text)?;
    whole.write(folder)?;
    let summary = put(folder, rows)?;
    output::remark(&summary.text(folder));
    Ok(ExitCode::from(u8::from(summary.errors > 0)))
}
