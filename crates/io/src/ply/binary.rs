//! Binary bodies, both byte orders.

use super::body::{Numbers, Row, Stop};
use super::header::Property;
use crate::gathered::{Gathered, Precision};
use crate::window::Window;
use ply_rs::ply::{PropertyType, ScalarType};

/// A binary body, most significant byte first where `BIG_ENDIAN`.
pub(super) struct Binary<'a, const BIG_ENDIAN: bool> {
    body: &'a mut Window,
}

impl<'a, const BIG_ENDIAN: bool> Binary<'a, BIG_ENDIAN> {
    pub(super) fn new(body: &'a mut Window) -> Self {
        Binary { body }
    }

    /// Hands over whole records of so many bytes, at most `n`; how many there were.
    fn blocks(&mut self, stride: usize, n: usize, mut visit: impl FnMut(&[u8])) -> usize {
        let mut held = 0;
        while held < n && self.body.reach(stride) {
            let n_bytes = stride * (self.body.bytes().len() / stride).min(n - held);
            visit(&self.body.bytes()[..n_bytes]);
            self.body.pass(n_bytes);
            held += n_bytes / stride;
        }
        held
    }

    /// Reads points that lie in the file as they do in memory, at most `n`; how many there were.
    fn as_in_memory(&mut self, n: usize, points: &mut Vec<[f32; 3]>) -> usize {
        let first = points.len();
        let n_left = usize::try_from(self.body.left()).unwrap_or(usize::MAX) / size_of::<[f32; 3]>();
        points.resize(first + n.min(n_left), [0.0; 3]);
        let held = self.body.copy_to(bytemuck::cast_slice_mut(&mut points[first..])) / size_of::<[f32; 3]>();
        points.truncate(first + held);
        held
    }

    /// Reads points from records that have three numbers of `N` bytes from `at` on, at most `n`; how many there were.
    fn coordinates<const N: usize>(
        &mut self,
        stride: usize,
        at: usize,
        n: usize,
        points: &mut Gathered,
        number: impl Fn([u8; N]) -> f64 + Copy,
    ) -> usize {
        self.blocks(stride, n, |records| {
            if stride == 3 * N {
                // Nothing lies between the points, so that several are converted at a time.
                points.extend(records.as_chunks().0.as_chunks::<3>().0.iter().map(|point| point.map(number)));
            } else {
                points.extend(three_of_each(records, stride, at).map(|point| point.map(number)));
            }
        })
    }
}

/// The number of a type at the beginning of some bytes, if they suffice.
#[inline(always)]
fn number<const BIG_ENDIAN: bool>(bytes: &[u8], kind: &ScalarType) -> Option<f64> {
    /// The first bytes, least significant first.
    #[inline(always)]
    fn first<const BIG_ENDIAN: bool, const N: usize>(bytes: &[u8]) -> Option<[u8; N]> {
        let mut first = *bytes.first_chunk()?;
        if BIG_ENDIAN {
            first.reverse();
        }
        Some(first)
    }
    Some(match kind {
        ScalarType::Char => i8::from_le_bytes(first::<BIG_ENDIAN, 1>(bytes)?).into(),
        ScalarType::UChar => u8::from_le_bytes(first::<BIG_ENDIAN, 1>(bytes)?).into(),
        ScalarType::Short => i16::from_le_bytes(first::<BIG_ENDIAN, 2>(bytes)?).into(),
        ScalarType::UShort => u16::from_le_bytes(first::<BIG_ENDIAN, 2>(bytes)?).into(),
        ScalarType::Int => i32::from_le_bytes(first::<BIG_ENDIAN, 4>(bytes)?).into(),
        ScalarType::UInt => u32::from_le_bytes(first::<BIG_ENDIAN, 4>(bytes)?).into(),
        ScalarType::Float => f32::from_le_bytes(first::<BIG_ENDIAN, 4>(bytes)?).into(),
        ScalarType::Double => f64::from_le_bytes(first::<BIG_ENDIAN, 8>(bytes)?),
    })
}

impl<const BIG_ENDIAN: bool> Numbers for Binary<'_, BIG_ENDIAN> {
    #[inline]
    fn number(&mut self, kind: &ScalarType) -> Result<f64, Stop> {
        if !self.body.reach(size(kind)) {
            return Err(Stop::End);
        }
        let number = number::<BIG_ENDIAN>(self.body.bytes(), kind).ok_or(Stop::End)?;
        self.body.pass(size(kind));
        Ok(number)
    }

    #[inline]
    fn skip(&mut self, kind: &ScalarType, n: usize) -> Result<(), Stop> {
        let mut left = n.checked_mul(size(kind)).ok_or(Stop::End)?;
        while left > self.body.bytes().len() {
            left -= self.body.bytes().len();
            self.body.pass(self.body.bytes().len());
            if !self.body.more() {
                return Err(Stop::End);
            }
        }
        self.body.pass(left);
        Ok(())
    }

    fn points(&mut self, properties: &[Property], columns: &[Option<usize>], n: usize, points: &mut Gathered) -> usize {
        let Some(layout) = Layout::of(properties, columns) else { return 0 };
        let is_of_machine = BIG_ENDIAN == cfg!(target_endian = "big");
        let is_alone = layout.stride == size_of::<[f32; 3]>();
        match (layout.in_a_row(), points.plain()) {
            (Some((0, ScalarType::Float)), Some(plain)) if is_of_machine && is_alone => self.as_in_memory(n, plain),
            (Some((at, ScalarType::Float)), _) => self.coordinates(layout.stride, at, n, points, |bytes| {
                if BIG_ENDIAN { f32::from_be_bytes(bytes) } else { f32::from_le_bytes(bytes) }.into()
            }),
            (Some((at, ScalarType::Double)), _) => self.coordinates(layout.stride, at, n, points, |bytes| {
                if BIG_ENDIAN { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) }
            }),
            _ => 0,
        }
    }

    fn records(
        &mut self,
        properties: &[Property],
        columns: &[Option<usize>],
        n: usize,
        mut visit: impl FnMut(Row),
    ) -> usize {
        let Some(layout) = Layout::of(properties, columns) else { return 0 };
        let number = |record: &[u8], at: usize, kind: &ScalarType| {
            number::<BIG_ENDIAN>(&record[at..], kind).expect("a record holds all its numbers")
        };
        self.blocks(layout.stride, n, |records| {
            for record in records.chunks_exact(layout.stride) {
                let mut row = Row::default();
                layout.numbers.iter().for_each(|(at, kind, column)| row[*column] = number(record, *at, kind));
                visit(row);
            }
        })
    }

    fn precision(&self, kind: &ScalarType) -> Precision {
        match kind {
            ScalarType::Int | ScalarType::UInt | ScalarType::Double => Precision::Double,
            _ => Precision::Single,
        }
    }

    fn room(&self, properties: &[Property]) -> usize {
        let least = |p: &Property| match &p.kind {
            PropertyType::Scalar(kind) | PropertyType::List(kind, _) => size(kind),
        };
        let left = usize::try_from(self.body.left()).unwrap_or(usize::MAX);
        left / properties.iter().map(least).sum::<usize>().max(1)
    }
}

/// Where in each record the wanted numbers are, if all records are alike.
struct Layout {
    stride: usize,
    /// Offset, type and column.
    numbers: Vec<(usize, ScalarType, usize)>,
}

impl Layout {
    /// Nothing where records have lists, or nothing at all.
    fn of(properties: &[Property], columns: &[Option<usize>]) -> Option<Layout> {
        let mut layout = Layout { stride: 0, numbers: Vec::new() };
        for (property, column) in properties.iter().zip(columns) {
            let PropertyType::Scalar(kind) = &property.kind else { return None };
            layout.numbers.extend(column.map(|column| (layout.stride, kind.clone(), column)));
            layout.stride += size(kind);
        }
        (layout.stride > 0).then_some(layout)
    }

    /// Where the coordinates are and what type they have, if they are all that is wanted, of one type, and next to each other:
    /// as in most files.
    fn in_a_row(&self) -> Option<(usize, &ScalarType)> {
        let (first, kind, _) = self.numbers.first()?;
        let is_next = |(i, (at, its_kind, column)): (usize, &(usize, ScalarType, usize))| {
            its_kind == kind && *column == i && *at == first + i * size(kind)
        };
        (self.numbers.len() == 3 && self.numbers.iter().enumerate().all(is_next)).then_some((*first, kind))
    }
}

/// The bytes of three numbers in each record, from `at` on.
#[inline(always)]
fn three_of_each<const N: usize>(records: &[u8], stride: usize, at: usize) -> impl Iterator<Item = [[u8; N]; 3]> {
    records
        .chunks_exact(stride)
        .map(move |record| *record[at..].as_chunks::<N>().0.first_chunk().expect("a record holds its coordinates"))
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
