//! Lens parameters by name, and the corresponding parts of vectors and matrices.

use nalgebra::{DMatrix, Matrix2, SMatrix};

use super::{
    coded::coded,
    distortion::{BROWN_PARAMETERS, LENS_PARAMETERS},
};

/// Covariance or information of all lens parameters, rows and columns in the order of
/// [`LENS_PARAMETERS`]. Its parts are read through [`LensParts`].
pub type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// Number of distortion coefficients.
pub const DISTORTION_PARAMETERS: usize = LENS_PARAMETERS - 4;

coded! {
    /// Lens parameter, in the order of [`LENS_PARAMETERS`].
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum LensParameter {
        /// Focal length along x, in pixels; with square pixels, also along y.
        Fx = "fx",
        /// Focal length along y, in pixels.
        Fy = "fy",
        /// Principal point along x, in pixels.
        Cx = "cx",
        /// Principal point along y, in pixels.
        Cy = "cy",
        /// Radial, r² or θ³.
        K1 = "k1",
        /// Radial, r⁴ or θ⁵.
        K2 = "k2",
        /// Tangential, vertical decentring.
        P1 = "p1",
        /// Tangential, horizontal decentring.
        P2 = "p2",
        /// Radial, r⁶ or θ⁷.
        K3 = "k3",
        /// r² of a rational lens's denominator, or θ⁹.
        K4 = "k4",
        /// r⁴ of a rational lens's denominator.
        K5 = "k5",
        /// r⁶ of a rational lens's denominator.
        K6 = "k6",
    }
    /// All parameters, in order.
    ALL
    /// Stable name in files.
    name
}

impl LensParameter {
    /// Focal length along both axes.
    pub const F: [Self; 2] = [Self::Fx, Self::Fy];
    /// Principal point along both axes.
    pub const PP: [Self; 2] = [Self::Cx, Self::Cy];
    /// Parameters of a pinhole, in order.
    pub const F_THEN_PP: [Self; 4] = [Self::Fx, Self::Fy, Self::Cx, Self::Cy];
    /// Distortion coefficients, in OpenCV's order.
    pub const DISTORTION: [Self; DISTORTION_PARAMETERS] =
        [Self::K1, Self::K2, Self::P1, Self::P2, Self::K3, Self::K4, Self::K5, Self::K6];
    /// Parameters of a pinhole with square pixels.
    pub const F_AND_PP: [Self; 3] = [Self::Fx, Self::Cx, Self::Cy];

    /// Index in vectors and matrices of [`LENS_PARAMETERS`].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// True if Brown's model has the parameter.
    pub const fn is_browns(self) -> bool {
        self.index() < BROWN_PARAMETERS
    }

    /// True for a distortion coefficient.
    pub const fn is_distortion(self) -> bool {
        !matches!(self, Self::Fx | Self::Fy | Self::Cx | Self::Cy)
    }

    /// True for a distortion coefficient that moves points across the radius, too.
    pub const fn is_tangential(self) -> bool {
        matches!(self, Self::P1 | Self::P2)
    }
}

/// Values of all lens parameters, in the order of [`LENS_PARAMETERS`], read by name.
pub trait LensValues {
    /// Values of `parameters`.
    fn of<const N: usize>(&self, parameters: [LensParameter; N]) -> [f64; N];
}

impl LensValues for [f64; LENS_PARAMETERS] {
    fn of<const N: usize>(&self, parameters: [LensParameter; N]) -> [f64; N] {
        parameters.map(|parameter| self[parameter.index()])
    }
}

/// Parts of a [`LensMatrix`] by parameter.
pub trait LensParts {
    /// Block of the given rows and columns.
    fn block<const R: usize, const C: usize>(
        &self,
        rows: [LensParameter; R],
        columns: [LensParameter; C],
    ) -> SMatrix<f64, R, C>;

    /// [`Self::block`] for a variable number of parameters.
    fn part(&self, rows: &[LensParameter], columns: &[LensParameter]) -> DMatrix<f64>;

    /// Replaces the block of the given rows and columns.
    fn set_block<const R: usize, const C: usize>(
        &mut self,
        rows: [LensParameter; R],
        columns: [LensParameter; C],
        block: &SMatrix<f64, R, C>,
    );

    /// Variance of a parameter.
    fn variance_of(&self, parameter: LensParameter) -> f64 {
        self.block([parameter], [parameter]).x
    }

    /// Block of the focal lengths, px².
    fn f(&self) -> Matrix2<f64> {
        self.block(LensParameter::F, LensParameter::F)
    }

    /// Block of the principal point, px².
    fn pp(&self) -> Matrix2<f64> {
        self.block(LensParameter::PP, LensParameter::PP)
    }

    /// Block of the distortion coefficients, which have no unit. Zero for fixed coefficients.
    fn distortion(&self) -> SMatrix<f64, DISTORTION_PARAMETERS, DISTORTION_PARAMETERS> {
        self.block(LensParameter::DISTORTION, LensParameter::DISTORTION)
    }
}

impl LensParts for LensMatrix {
    fn block<const R: usize, const C: usize>(
        &self,
        rows: [LensParameter; R],
        columns: [LensParameter; C],
    ) -> SMatrix<f64, R, C> {
        SMatrix::from_fn(|i, j| self[(rows[i].index(), columns[j].index())])
    }

    fn set_block<const R: usize, const C: usize>(
        &mut self,
        rows: [LensParameter; R],
        columns: [LensParameter; C],
        block: &SMatrix<f64, R, C>,
    ) {
        for (i, row) in rows.into_iter().enumerate() {
            for (j, column) in columns.into_iter().enumerate() {
                self[(row.index(), column.index())] = block[(i, j)];
            }
        }
    }

    fn part(&self, rows: &[LensParameter], columns: &[LensParameter]) -> DMatrix<f64> {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
            self[(rows[i].index(), columns[j].index())]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_read_by_name() {
        for (place, parameter) in LensParameter::ALL.into_iter().enumerate() {
            assert_eq!(parameter.index(), place, "{parameter:?}");
        }
        let parts = LensParameter::F_THEN_PP.into_iter().chain(LensParameter::DISTORTION);
        assert!(parts.eq(LensParameter::ALL));
        assert!(LensParameter::DISTORTION.into_iter().all(LensParameter::is_distortion));
        let matrix = LensMatrix::from_fn(|i, j| (100 * i + j) as f64);
        let of = |a: LensParameter, b: LensParameter| matrix[(a.index(), b.index())];
        assert_eq!(matrix.f()[(0, 1)], of(LensParameter::Fx, LensParameter::Fy));
        assert_eq!(matrix.pp()[(1, 0)], of(LensParameter::Cy, LensParameter::Cx));
        let distortion = matrix.distortion();
        assert_eq!(distortion[(0, 7)], of(LensParameter::K1, LensParameter::K6));
        assert_eq!(distortion[(4, 2)], of(LensParameter::K3, LensParameter::P1));
        let values: [f64; LENS_PARAMETERS] = std::array::from_fn(|i| i as f64);
        assert_eq!(values.of([LensParameter::Cy, LensParameter::K1]), [3.0, 4.0]);
    }
}
