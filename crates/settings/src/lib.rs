//! From TOML texts and single assignments to the configuration of the pipeline.
//!
//! [`Layers`] are texts, the later of which replace sections of the earlier ones, and assignments such as
//! `metric.mse.threshold=5pr`, each of which changes one setting. [`Layers::resolve`] combines them and remembers where each
//! setting comes from. Errors name the text with line and column, and the nearest valid name.
//!
//! Nothing here opens a file.

mod assignment;
mod layers;
mod text;
mod words;

pub use assignment::FAMILIES;
pub use layers::{Assignment, Layered, Layers, Text, all_settings};
pub use text::{parse, preset};

/// Why texts or assignments are no configuration, in words for the user.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SettingsError(pub(crate) String);
