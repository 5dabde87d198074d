//! PLY, the Polygon File Format (Turk, 1994).
//!
//! `ply_rs` parses the header; the bodies are read here, because its own readers refuse numbers that common writers
//! produce (`nan`, `.5`, `1.`) and take ten times as long.

mod ascii;
mod binary;
mod body;
mod fault;
mod header;
#[cfg(test)]
mod tests;
mod write;

pub use fault::PlyFault;
pub(crate) use write::encode;
pub use write::{write_coloured_ply, write_ply};

use crate::gathered::Keep;
use crate::window::Window;
use ascii::Ascii;
use binary::Binary;
use congruent_geometry::RawScan;
use header::Header;
use ply_rs::ply::Encoding;

/// Whether a file begins as every PLY file does: with the word `ply`.
pub(crate) fn is_ply(bytes: &[u8]) -> bool {
    bytes.strip_prefix(b"ply").is_some_and(|rest| rest.first().is_none_or(u8::is_ascii_whitespace))
}

/// The scan in a PLY file.
pub(crate) fn read(file: &mut Window, keep: Keep) -> Result<RawScan, PlyFault> {
    let header = Header::parse(file)?;
    match header.encoding {
        Encoding::Ascii => body::read(&header, &mut Ascii::new(file, header.n_lines), keep),
        Encoding::BinaryLittleEndian => body::read(&header, &mut Binary::<false>::new(file), keep),
        Encoding::BinaryBigEndian => body::read(&header, &mut Binary::<true>::new(file), keep),
    }
}
