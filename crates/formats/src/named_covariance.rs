//! A covariance matrix with named rows.

use serde::{Deserialize, Serialize};

use boresight_geometry::{LensMatrix, LensParameter, LensParts};

/// Covariance of all lens parameters.
pub type LensCovariance = LensMatrix;

/// Name of the focal length common to both axes.
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
    /// The rows and columns of `covariance` with parameters satisfying `keep`. With
    /// `square_pixels`, fx and fy are a single row, `f`.
    pub(super) fn of(
        covariance: &LensCovariance,
        square_pixels: bool,
        keep: impl Fn(LensParameter) -> bool,
    ) -> Self {
        let kept: Vec<LensParameter> = LensParameter::ALL
            .into_iter()
            .filter(|&of| keep(of) && !(square_pixels && of == LensParameter::Fy))
            .collect();
        let name = |of: &LensParameter| match of {
            LensParameter::Fx if square_pixels => COMMON_FOCAL_LENGTH,
            other => other.name(),
        };
        let entries = covariance.part(&kept, &kept);
        Self {
            order: kept.iter().map(|of| name(of).to_owned()).collect(),
            matrix: entries.row_iter().map(|row| row.iter().copied().map(Some).collect()).collect(),
        }
    }

    /// The full matrix.
    ///
    /// `None` for an invalid covariance: no row, an unknown name, a missing or infinite entry, or a
    /// negative variance.
    pub fn full(&self) -> Option<LensCovariance> {
        let named: Vec<Vec<LensParameter>> =
            self.order.iter().map(|name| parameters(name)).collect::<Option<_>>()?;
        let mut covariance = LensCovariance::zeros();
        for (row, rows) in named.iter().enumerate() {
            for (column, columns) in named.iter().enumerate() {
                let entry = (*self.matrix.get(row)?.get(column)?)?;
                if !entry.is_finite() {
                    return None;
                }
                for i in rows {
                    for j in columns {
                        covariance[(i.index(), j.index())] = entry;
                    }
                }
            }
        }
        let is_usable =
            !named.is_empty() && covariance.diagonal().iter().all(|variance| *variance >= 0.0);
        is_usable.then_some(covariance)
    }
}

fn parameters(name: &str) -> Option<Vec<LensParameter>> {
    if name == COMMON_FOCAL_LENGTH {
        return Some(LensParameter::F.to_vec());
    }
    LensParameter::ALL.into_iter().find(|of| of.name() == name).map(|of| vec![of])
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
        let two = NamedCovariance::of(&all, false, |of| LensParameter::F.contains(&of));
        assert_eq!(two.order, ["fx", "fy"]);
        assert_eq!(two.full().map(|full| (full[(0, 1)], full[(2, 2)])), Some((4.0, 0.0)));
    }

    #[test]
    fn what_is_no_covariance_is_none() {
        let named = NamedCovariance::of(&covariance(4.0), true, |of| !of.is_distortion());
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
