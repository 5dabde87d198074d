//! Lengths as users write them: in units of the cloud's resolution or of the data.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;
use std::str::FromStr;

/// A positive length: `"7.5pr"` (times the resolution) or `"0.05u"` (data units). A bare number is rejected.
///
/// ```
/// use congruent_geometry::Length;
/// let length: Length = "7.5pr".parse()?;
/// assert_eq!(length.resolve(0.6), 4.5);
/// assert!("7.5".parse::<Length>().is_err());
/// # Ok::<(), congruent_geometry::LengthError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// Multiples of the cloud resolution.
    Resolutions(f64),
    /// Units of the data, whatever they are.
    Units(f64),
}

/// The error for a text that is not a length.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "'{text}' is not a length: write a number above zero with its unit, \"7.5pr\" (times the cloud's resolution) or \
     \"0.05u\" (data units)"
)]
pub struct LengthError {
    text: String,
}

impl Length {
    /// Returns the length in data units for a cloud of this resolution.
    #[must_use]
    pub fn resolve(self, resolution: f64) -> f64 {
        match self {
            Length::Resolutions(times) => times * resolution,
            Length::Units(units) => units,
        }
    }
}

impl FromStr for Length {
    type Err = LengthError;

    fn from_str(text: &str) -> Result<Self, LengthError> {
        let refused = || LengthError { text: text.to_owned() };
        let text = text.trim();
        let (number, unit): (_, fn(f64) -> Length) = if let Some(number) = text.strip_suffix("pr") {
            (number, Length::Resolutions)
        } else if let Some(number) = text.strip_suffix('u') {
            (number, Length::Units)
        } else {
            return Err(refused());
        };
        let value: f64 = number.trim().parse().map_err(|_| refused())?;
        if value.is_finite() && value > 0.0 { Ok(unit(value)) } else { Err(refused()) }
    }
}

impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Length::Resolutions(times) => write!(f, "{times}pr"),
            Length::Units(units) => write!(f, "{units}u"),
        }
    }
}

impl Serialize for Length {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Length {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = Length;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "a length with its unit, \"7.5pr\" (times the cloud's resolution) or \"0.05u\" (data units)",
                )
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Length, E> {
                text.parse().map_err(E::custom)
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_and_written_back() {
        for (text, expected) in
            [("7.5pr", Length::Resolutions(7.5)), (" 0.05 u", Length::Units(0.05)), ("1e-3u", Length::Units(0.001))]
        {
            let length: Length = text.parse().unwrap();
            assert_eq!(length, expected);
            assert_eq!(length.to_string().parse::<Length>().unwrap(), expected);
        }
    }

    #[test]
    fn nonsense_is_refused_with_the_way_out() {
        for text in ["7.5", "", "pr", "-1pr", "0u", "nanpr", "infu", "5 mm"] {
            let message = text.parse::<Length>().unwrap_err().to_string();
            assert!(message.contains("7.5pr") && message.contains(text.trim()), "{message}");
        }
    }
}
