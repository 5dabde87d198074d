//! Visual results: HTML pages of one file each that open without a network.
//!
//! A [`Page`] is a title and blocks: text, facts, tables, figures (SVG), and interactive 3D views. A [`Scene`] is the
//! content of such a view: layers of points and of lines on bodies that rigid motions put in place. [`pair_page`] shows
//! one registration, [`experiment_page`] and [`evaluation_page`] many. Nothing here opens a file or prints.

mod evaluation;
mod experiment;
mod figures;
mod numbers;
mod page;
mod pair;
mod palette;
mod picture;
mod printed;
mod scene;

pub use evaluation::{evaluation_figures, evaluation_page};
pub use experiment::{ExperimentReport, Figure, experiment_figures, experiment_page};
pub use numbers::{decimals, digits, pose_rows};
pub use page::{Block, Cell, Page, Table, Tone, escaped};
pub use pair::{PairReport, comparison_page, pair_page};
pub use palette::{SCANS, SOURCE, TARGET, scan_colour};
pub use picture::before_and_after;
pub use scene::{Errors, Layer, Lines, Points, Scene, State};
