//! Binary bodies, both byte orders.

use super::body::{Numbers, Row, Stop};
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

    fn points(
        &mut self,
        properties: &[Property],
        columns: &[Option<usize>],
        n: usize,
        points: &mut Vec<[f64; 3]>,
    ) -> usize {
        let Some(layout) = Layout::of(properties, columns) else { return 0 };
        let Some(at) = layout.floats_in_a_row() else { return 0 };
        let records = self.left.chunks_exact(layout.stride).take(n);
        let read = records.len();
        points.extend(records.map(|record| {
            let [x, y, z] = *record[at..].as_chunks::<4>().0.first_chunk().expect("a record holds its coordinates");
            [x, y, z].map(|float| if BIG_ENDIAN { f32::from_be_bytes(float) } else { f32::from_le_bytes(float) }.into())
        }));
        self.left = &self.left[read * layout.stride..];
        read
    }

    fn records(
        &mut self,
        properties: &[Property],
        columns: &[Option<usize>],
        n: usize,
        mut visit: impl FnMut(Row),
    ) -> usize {
        let Some(layout) = Layout::of(properties, columns) else { return 0 };
        let records = self.left.chunks_exact(layout.stride).take(n);
        let read = records.len();
        let number = |record: &[u8], at: usize, kind: &ScalarType| {
            Binary::<BIG_ENDIAN>::new(&record[at..]).number(kind).expect("a record holds all its numbers")
        };
        for record in records {
            let mut row = Row::default();
            layout.numbers.iter().for_each(|(at, kind, column)| row[*column] = number(record, *at, kind));
            visit(row);
        }
        self.left = &self.left[read * layout.stride..];
        read
    }

    fn room(&self, properties: &[Property]) -> usize {
        let least = |p: &Property| match &p.kind {
            PropertyType::Scalar(kind) | PropertyType::List(kind, _) => size(kind),
        };
        self.left.len() / properties.iter().map(least).sum::<usize>().max(1)
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

    /// Where the coordinates are, if they are all that is wanted, and floats next to each other: as in most files.
    fn floats_in_a_row(&self) -> Option<usize> {
        let first = self.numbers.first()?.0;
        let is_next = |(i, (at, kind, column)): (usize, &(usize, ScalarType, usize))| {
            *kind == ScalarType::Float && *column == i && *at == first + 4 * i
        };
        (self.numbers.len() == 3 && self.numbers.iter().enumerate().all(is_next)).then_some(first)
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
