//! Numbers formatted for people, with as many digits as are significant.

/// Maximum number of decimals; more are meaningless for an `f64` of ordinary size.
const MOST: f64 = 15.0;

/// Returns the number of decimals that show a step of this size.
#[must_use]
pub fn decimals(step: f64) -> usize {
    if step > 0.0 && step.is_finite() { (-step.log10().floor()).clamp(0.0, MOST) as usize } else { 0 }
}

/// Maximum number of decimals; numbers with more are written in scientific notation.
const READABLE: usize = 9;

/// Formats a length with this many significant digits; nothing before the decimal point is cut off.
#[must_use]
pub fn digits(length: f64, n: u32) -> String {
    match decimals(length.abs() / 10f64.powi(n as i32 - 1)) {
        shown @ ..=READABLE => format!("{length:.shown$}"),
        _ => format!("{length:.0$e}", n as usize - 1),
    }
}

/// Formats the rows of a pose as precisely as a cloud of this resolution determines it at this distance from the
/// origin: to a thousandth of the resolution. Data units.
#[must_use]
pub fn pose_rows(rows: &[[f64; 4]; 4], resolution: f64, reach: f64) -> [String; 4] {
    let step = resolution / 1000.0;
    let reach = rows.iter().fold(reach, |reach, row| reach.max(row[3].abs())).max(1.0);
    let (turn, shift) = (decimals(step / reach).max(6), decimals(step).max(6));
    let width = |n: usize| n + 8;
    rows.each_ref().map(|&[x, y, z, w]| {
        let turned = [x, y, z].map(|v| format!("{v:>0$.1$}", width(turn), turn));
        format!("{} {w:>1$.2$}", turned.join(" "), width(shift), shift)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_that_count_are_shown() {
        let shown = [123.456, 1.0, 0.035_12, 6.02e-7, 1e-30, 0.0].map(|length| digits(length, 3));
        assert_eq!(shown, ["123", "1.00", "0.0351", "0.000000602", "1.00e-30", "0"]);
    }

    #[test]
    fn a_pose_is_as_exact_as_its_scans_far_from_zero_too() {
        let rows = [[0.8, -0.6, 0.0, 5_000_000.25], [0.6, 0.8, 0.0, -1.5], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let shown = pose_rows(&rows, 0.35, 10.0);
        let first: Vec<&str> = shown[0].split_whitespace().collect();
        assert_eq!(first, ["0.80000000000", "-0.60000000000", "0.00000000000", "5000000.250000"]);
        let near = pose_rows(&[[1.0, 0.0, 0.0, 2.0]; 4], 0.35, 10.0);
        assert_eq!(near[0], "      1.000000       0.000000       0.000000       2.000000");
    }
}
