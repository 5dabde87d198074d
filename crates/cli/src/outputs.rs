//! Where results may be written: not over an input, not twice to the same file, and not into a folder that does not
//! exist.

use anyhow::{Context, Result, bail};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Refuses, before any work is done, outputs that could not be written or would destroy something.
pub(crate) fn check(inputs: &[&Path], outputs: &[&Path]) -> Result<()> {
    let inputs: BTreeSet<PathBuf> = inputs.iter().filter_map(|input| input.canonicalize().ok()).collect();
    let mut taken = BTreeSet::new();
    for output in outputs {
        let shown = output.display();
        if output.is_dir() {
            bail!("{shown}: is a directory; give a file name");
        }
        // Devices and pipes can be written to more than once, and have no content to lose.
        if output.exists() && !output.is_file() {
            continue;
        }
        let Some(place) = place(output) else {
            bail!("{shown}: cannot be written, because its folder does not exist; create it");
        };
        if inputs.contains(&place) {
            bail!("{shown}: is also an input, and would be replaced by the result; choose another name");
        }
        if !taken.insert(place) {
            bail!("{shown}: two results would be written to it; choose another name for one of them");
        }
    }
    Ok(())
}

/// Makes a folder for results, unless it exists.
pub(crate) fn create_folder(folder: &Path) -> Result<()> {
    if folder.is_file() {
        bail!("{}: is a file; give a folder", folder.display());
    }
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot be created", folder.display()))
}

/// Returns one name for all paths that lead to the same file; `None` if its folder does not exist.
fn place(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok().or_else(|| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_and_what_is_written_are_kept_apart() {
        let folder = tempfile::tempdir().unwrap();
        let [scan, other, new] = ["scan.ply", "other.ply", "new.ply"].map(|name| folder.path().join(name));
        [&scan, &other].iter().for_each(|path| std::fs::write(path, "ply").unwrap());
        let detour = folder.path().join("..").join(folder.path().file_name().unwrap()).join("scan.ply");
        let nowhere = folder.path().join("no").join("x.json");
        let said = |inputs: &[&Path], outputs: &[&Path]| check(inputs, outputs).err().map(|error| error.to_string());
        assert_eq!(said(&[&scan], &[&other, &new]), None);
        assert!(said(&[&scan, &other], &[&detour]).unwrap().contains("is also an input"));
        assert!(said(&[&scan], &[&new, &new]).unwrap().contains("two results"));
        assert!(said(&[&scan], &[&nowhere]).unwrap().contains("does not exist"));
        assert!(said(&[&scan], &[folder.path()]).unwrap().contains("is a directory"));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_takes_all() {
        let null = Path::new("/dev/null");
        assert!(check(&[null], &[null, null]).is_ok());
    }
}
