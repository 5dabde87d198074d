//! Binary bodies, both byte orders.

use super::body::{Numbers, Stop};
use super::header::Property;
use ply_rs::ply::{PropertyType, ScalarType};

/// A binary body, most significant byte first where `BIG_ENDIAN`.
pub(super) struct Binary<'a, const BIG_ENDIAN: bool> {
    left: &'a [u8],
}

impl<'a, const BIG_ENDIAN: bool> Binary<'a, BIG_ENDIAN> {
    pub(super) fn new(body: &'a [u8]) -> Self {
        Binary { left: body }
    }

    /// The next bytes, least significant first.
    #[inline(always)]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Stop> {
        let (head, left) = self.left.split_first_chunk::<N>().ok_or(Stop::End)?;
        self.left = left;
        let mut head = *head;
        if BIG_ENDIAN {
            head.reverse();
        }
        Ok(head)
    }
}

impl<const BIG_ENDIAN: bool> Numbers for Binary<'_, BIG_ENDIAN> {
    #[inline]
    fn number(&mut self, kind: &ScalarType) -> Result<f64, Stop> {
        Ok(match kind {
            ScalarType::Char => i8::from_le_bytes(self.take()?).into(),
            ScalarType::UChar => u8::from_le_bytes(self.take()?).into(),
            ScalarType::Short => i16::from_le_bytes(self.take()?).into(),
            ScalarType::UShort => u16::from_le_bytes(self.take()?).into(),
            ScalarType::Int => i32::from_le_bytes(self.take()?).into(),
            ScalarType::UInt => u32::from_le_bytes(self.take()?).into(),
            ScalarType::Float => f32::from_le_bytes(self.take()?).into(),
            ScalarType::Double => f64::from_le_bytes(self.take()?),
        })
    }

    #[inline]
    fn skip(&mut self, kind: &ScalarType, n: usize) -> Result<(), Stop> {
        let n_bytes = n.checked_mul(size(kind)).ok_or(Stop::End)?;
        self.left = self.left.get(n_bytes..).ok_or(Stop::End)?;
        Ok(())
    }

    fn room(&self, properties: &[Property]) -> usize {
        let least = |p: &Property| match &p.kind {
            PropertyType::Scalar(kind) | PropertyType::List(kind, _) => size(kind),
        };
        self.left.len() / properties.iter().map(least).sum::<usize>().max(1)
    }
}

/// Bytes of a number.
fn size(kind: &ScalarType) -> usize {
    match kind {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}
