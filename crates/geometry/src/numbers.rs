//! Valid ranges of numbers in a configuration, for `#[serde(deserialize_with = "…")]`. NaN is never accepted.

use serde::de::{Deserialize, Deserializer, Error};

/// Deserializes a number above 0 and at most 1.
///
/// # Errors
/// Any other number.
pub fn share<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    checked(from, |v| v > 0.0 && v <= 1.0, "is not a fraction: write a number above 0 and at most 1")
}

/// Deserializes a number from 0 to 1.
///
/// # Errors
/// Any other number.
pub fn probability<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    checked(from, |v| (0.0..=1.0).contains(&v), "is out of range: write a number from 0 to 1")
}

/// Deserializes a number from 0 to below 1.
///
/// # Errors
/// Any other number.
pub fn below_one<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    checked(from, |v| (0.0..1.0).contains(&v), "is out of range: write a number from 0 to below 1, such as 0.999")
}

/// Deserializes a number from −1 to 1.
///
/// # Errors
/// Any other number.
pub fn cosine<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    checked(from, |v| (-1.0..=1.0).contains(&v), "is not a cosine: write a number from -1 to 1")
}

/// Deserializes a finite number above 0.
///
/// # Errors
/// Any other number.
pub fn positive<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    checked(from, |v| v > 0.0 && v.is_finite(), "is out of range: write a number above 0")
}

/// Deserializes a finite number of 0 or more.
///
/// # Errors
/// Any other number.
pub fn not_negative<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    checked(from, |v| v >= 0.0 && v.is_finite(), "is out of range: write 0 or a positive number")
}

/// Deserializes any finite number.
///
/// # Errors
/// Any other number.
pub fn finite<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    checked(from, f64::is_finite, "is not a finite number")
}

/// Deserializes a count of `MIN` or more.
///
/// # Errors
/// A smaller count, or a number that is not a count.
pub fn at_least<'de, const MIN: u64, T: TryFrom<u64>, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
    let count = u64::deserialize(from)?;
    let fits = T::try_from(count).ok().filter(|_| count >= MIN);
    fits.ok_or_else(|| D::Error::custom(format!("{count} is out of range: write a whole number, {MIN} or more")))
}

/// Deserializes three [`finite`] numbers.
///
/// # Errors
/// Any other number among them.
pub fn finite_place<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; 3], D::Error> {
    let place = <[f64; 3]>::deserialize(from)?;
    match place.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(D::Error::custom(format!("{v} is not a finite number"))),
        None => Ok(place),
    }
}

/// Deserializes a list of [`positive`] numbers.
///
/// # Errors
/// Any other number among them.
pub fn all_positive<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    let numbers = Vec::<f64>::deserialize(from)?;
    match numbers.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
        Some(v) => Err(D::Error::custom(format!("{v} is out of range: write numbers above 0"))),
        None => Ok(numbers),
    }
}

/// Deserializes a [`probability`] that may be omitted.
///
/// # Errors
/// Any other number.
pub fn optional_probability<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    probability(from).map(Some)
}

fn checked<'de, D: Deserializer<'de>>(from: D, is_fine: impl Fn(f64) -> bool, fault: &str) -> Result<f64, D::Error> {
    let value = f64::deserialize(from)?;
    if is_fine(value) { Ok(value) } else { Err(D::Error::custom(format!("{value} {fault}"))) }
}
