//! A covariance matrix that names its rows.

use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

use boresight_geometry::LENS_PARAMETERS;

/// Covariance of all lens parameters, in the order of [`LENS_PARAMETERS`].
pub type LensCovariance = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// Names of the lens parameters in that order.
pub(super) const LENS_PARAMETER_NAMES: [&str; LENS_PARAMETERS] =
    ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];
/// One focal length for both axes.
const COMMON_FOCAL_LENGTH: &str = "f";

/// Covariance of the lens parameters that `order` names, in px for `f`, `fx`, `fy`, `cx` and `cy`.
///
/// `f` stands for both `fx` and `fy`, which are then one parameter. Parameters that are not named are held
/// fixed: their rows and columns are zero.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct NamedCovariance {
    /// Name of each row and column.
    pub order: Vec<String>,
    /// The matrix, row by row; null stands for an entry that is not finite.
    pub matrix: Vec<Vec<Option<f64>>>,
}

impl NamedCovariance {
    /// The rows and columns of `covariance` whose indices satisfy `keep`. With `square_pixels`, fx and fy are
    /// one row, `f`.
    pub(super) fn of(
        covariance: &LensCovariance,
        square_pixels: bool,
        keep: impl Fn(usize) -> bool,
    ) -> Self {
        let kept: Vec<usize> =
            (0..LENS_PARAMETERS).filter(|&i| keep(i) && !(square_pixels && i == 1)).collect();
        let name = |&i: &usize| {
            if square_pixels && i == 0 { COMMON_FOCAL_LENGTH } else { LENS_PARAMETER_NAMES[i] }
        };
        let row = |&i: &usize| kept.iter().map(|&j| Some(covariance[(i, j)])).collect();
        Self {
            order: kept.iter().map(|i| name(i).to_owned()).collect(),
            matrix: kept.iter().map(row).collect(),
        }
    }

    /// The full matrix.
    ///
    /// `None` if it is no covariance: no row, an unknown name, a missing or infinite entry, or a negative
    /// variance.
    pub fn full(&self) -> Option<LensCovariance> {
        let indices: Vec<&[usize]> =
            self.order.iter().map(|name| indices(name)).collect::<Option<_>>()?;
        let mut covariance = LensCovariance::zeros();
        for (row, rows) in indices.iter().enumerate() {
            for (column, columns) in indices.iter().enumerate() {
                let entry = (*self.matrix.get(row)?.get(column)?)?;
                if !entry.is_finite() {
                    return None;
                }
                for i in *rows {
                    for j in *columns {
                        covariance[(*i, *j)] = entry;
                    }
                }
            }
        }
        let is_usable =
            !indices.is_empty() && covariance.diagonal().iter().all(|variance| *variance >= 0.0);
        is_usable.then_some(covariance)
    }
}

fn indices(name: &str) -> Option<&'static [usize]> {
    const EACH: [usize; LENS_PARAMETERS] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
    if name == COMMON_FOCAL_LENGTH {
        return Some(&EACH[..2]);
    }
    let index = LENS_PARAMETER_NAMES.iter().position(|known| *known == name)?;
    EACH.get(index..=index)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covariance(f_px2: f64) -> LensCovariance {
        let mut covariance = LensCovariance::identity();
        covariance.fixed_view_mut::<2, 2>(0, 0).fill(f_px2);
        covariance[(2, 4)] = 0.5;
        covariance[(4, 2)] = 0.5;
        covariance
    }

    #[test]
    fn the_full_matrix_comes_back_from_its_named_rows() {
        let all = covariance(4.0);
        let named = NamedCovariance::of(&all, true, |_| true);
        assert_eq!(named.order, ["f", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]);
        assert_eq!(named.full(), Some(all));
        let two = NamedCovariance::of(&all, false, |i| i < 2);
        assert_eq!(two.order, ["fx", "fy"]);
        assert_eq!(two.full().map(|full| (full[(0, 1)], full[(2, 2)])), Some((4.0, 0.0)));
    }

    #[test]
    fn what_is_no_covariance_is_none() {
        let named = NamedCovariance::of(&covariance(4.0), true, |i| i < 4);
        let with = |change: &dyn Fn(&mut NamedCovariance)| {
            let mut named = named.clone();
            change(&mut named);
            named.full()
        };
        assert_ne!(with(&|_| ()), None);
        assert_eq!(with(&|named| named.order[1] = "width".into()), None);
        assert_eq!(with(&|named| named.matrix[1].truncate(2)), None);
        assert_eq!(with(&|named| named.matrix.truncate(2)), None);
        assert_eq!(with(&|named| named.matrix[0][0] = Some(-1.0)), None);
        assert_eq!(with(&|named| named.matrix[0][1] = Some(f64::NAN)), None);
        assert_eq!(with(&|named| named.matrix[0][1] = None), None);
        assert_eq!(NamedCovariance { order: Vec::new(), matrix: Vec::new() }.full(), None);
    }
}
