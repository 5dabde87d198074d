//! What the user knows about a pose beforehand.

use super::align::coordinates;
use clap::Args as ClapArgs;
use congruent_geometry::Length;
use std::path::PathBuf;

#[derive(Debug, Default, ClapArgs)]
pub(crate) struct PriorArgs {
    /// An approximate pose that maps SOURCE into the frame of TARGET: a file with a 4x4 matrix, a JSON result of align,
    /// or the word identity. It is refined and competes with the poses found
    #[arg(long, value_name = "POSE")]
    pub(crate) init: Option<PathBuf>,
    /// Only poses rotated by at most DEG degrees relative to --init
    #[arg(long, value_name = "DEG", value_parser = degrees, requires = "init")]
    pub(crate) max_rotation: Option<f64>,
    /// Only poses that move the centre of the source's bounding box by at most LENGTH from where --init puts it (5u, 20pr;
    /// 1pr is the mean resolution of the scans as provided)
    #[arg(long, value_name = "LENGTH", value_parser = length, requires = "init")]
    pub(crate) max_translation: Option<Length>,
    #[command(flatten)]
    pub(crate) level: LevelArgs,
}

#[derive(Debug, Default, ClapArgs)]
pub(crate) struct LevelArgs {
    /// Both scans are level: only rotations about the up axis, and translations
    #[arg(long)]
    pub(crate) yaw_only: bool,
    /// The up axis of both scans; 0,0,1 if not given
    #[arg(long, value_name = "X,Y,Z", value_parser = direction, allow_hyphen_values = true, requires = "yaw_only")]
    pub(crate) up: Option<[f64; 3]>,
}

fn degrees(text: &str) -> Result<f64, String> {
    let angle: Option<f64> = text.parse().ok();
    angle.filter(|v| *v >= 0.0 && *v <= 180.0).ok_or_else(|| "write an angle of 0 to 180 degrees, e.g. 15".to_owned())
}

fn length(text: &str) -> Result<Length, String> {
    text.parse().map_err(|error| format!("{error}"))
}

fn direction(text: &str) -> Result<[f64; 3], String> {
    let axis = coordinates(text)?;
    let long = axis.iter().map(|v| v * v).sum::<f64>();
    if long > 0.0 && long.is_finite() { Ok(axis) } else { Err("an axis must have a direction, e.g. 0,0,1".to_owned()) }
}
