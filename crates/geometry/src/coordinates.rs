//! Coordinates of a scan, in the precision of their source.

/// Coordinates of points, file frame and units, in the precision of their source: most files hold `f32`, which takes
/// 12 bytes a point instead of 24. They are read as `f64`, which holds both exactly, and are equal if their values are.
///
/// # Examples
/// ```
/// use congruent_geometry::Coordinates;
/// let mut points = Coordinates::from(vec![[0.5f32, 1.0, 2.0]]);
/// assert_eq!(points, vec![[0.5f64, 1.0, 2.0]]);
/// points.edited().push([0.1, 0.2, 0.3]);
/// assert_eq!((points.len(), points.at(1)), (2, [0.1, 0.2, 0.3]));
/// ```
#[derive(Clone, Debug)]
pub enum Coordinates {
    /// In `f32`.
    Single(Vec<[f32; 3]>),
    /// In `f64`.
    Double(Vec<[f64; 3]>),
}

impl Coordinates {
    /// Returns the number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Coordinates::Single(points) => points.len(),
            Coordinates::Double(points) => points.len(),
        }
    }

    /// Returns whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns a point.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline]
    #[must_use]
    pub fn at(&self, index: usize) -> [f64; 3] {
        match self {
            Coordinates::Single(points) => points[index].map(f64::from),
            Coordinates::Double(points) => points[index],
        }
    }

    /// Returns a point, or `None` if there is no such point.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<[f64; 3]> {
        (index < self.len()).then(|| self.at(index))
    }

    /// Returns all points, in the order of the source.
    #[inline]
    pub fn iter(&self) -> impl ExactSizeIterator<Item = [f64; 3]> + Clone + '_ {
        (0..self.len()).map(|index| self.at(index))
    }

    /// Returns all points in `f64`.
    #[must_use]
    pub fn to_vec(&self) -> Vec<[f64; 3]> {
        match self {
            Coordinates::Single(points) => points.iter().map(|point| point.map(f64::from)).collect(),
            Coordinates::Double(points) => points.clone(),
        }
    }

    /// Returns all points in `f64`, to be changed in place.
    pub fn edited(&mut self) -> &mut Vec<[f64; 3]> {
        if let Coordinates::Single(_) = self {
            *self = Coordinates::Double(self.to_vec());
        }
        match self {
            Coordinates::Double(points) => points,
            Coordinates::Single(_) => unreachable!("single precision was widened"),
        }
    }
}

impl Default for Coordinates {
    fn default() -> Self {
        Coordinates::Double(Vec::new())
    }
}

impl PartialEq for Coordinates {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && self.iter().eq(other.iter())
    }
}

impl<T: AsRef<[[f64; 3]]>> PartialEq<T> for Coordinates {
    fn eq(&self, other: &T) -> bool {
        self.iter().eq(other.as_ref().iter().copied())
    }
}

impl From<Vec<[f32; 3]>> for Coordinates {
    fn from(points: Vec<[f32; 3]>) -> Self {
        Coordinates::Single(points)
    }
}

impl From<Vec<[f64; 3]>> for Coordinates {
    fn from(points: Vec<[f64; 3]>) -> Self {
        Coordinates::Double(points)
    }
}

impl IntoIterator for Coordinates {
    type Item = [f64; 3];
    type IntoIter = std::vec::IntoIter<[f64; 3]>;

    fn into_iter(mut self) -> Self::IntoIter {
        std::mem::take(self.edited()).into_iter()
    }
}

impl FromIterator<[f64; 3]> for Coordinates {
    fn from_iter<I: IntoIterator<Item = [f64; 3]>>(points: I) -> Self {
        Coordinates::Double(points.into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_precisions_are_read_alike() {
        let single = Coordinates::from(vec![[0.1f32, -2.0, 3.5], [1.0, 0.0, f32::MAX]]);
        let double: Coordinates = single.iter().collect();
        assert!(matches!(double, Coordinates::Double(_)));
        assert_eq!(single, double);
        assert_eq!(single, double.to_vec());
        assert_eq!((single.at(0)[0], double.at(0)[0]), (f64::from(0.1f32), f64::from(0.1f32)));
        assert_eq!((single.get(1), single.get(2)), (double.get(1), None));
        assert_ne!(single, Coordinates::from(vec![[0.1f64, -2.0, 3.5], [1.0, 0.0, f64::from(f32::MAX)]]));
        assert_ne!(single, Coordinates::default());
        assert!(Coordinates::default().is_empty());
    }

    #[test]
    fn editing_widens_once() {
        let mut points = Coordinates::from(vec![[0.25f32; 3]; 2]);
        points.edited()[0] = [1e300; 3];
        points.edited().push([0.5; 3]);
        assert_eq!(points, [[1e300; 3], [0.25; 3], [0.5; 3]]);
    }
}
