//! A lens: points to pixels, pixels to rays, and how certain both are.

use boresight::{
    calibration::{ProjectionJacobian, import, projection_jacobian},
    geometry::{Camera, LensMatrix, RayProjection},
};
use nalgebra::{Matrix3, Point2, Point3, SMatrix, Vector3};
use numpy::{
    IntoPyArray, PyArray2, PyArray3, PyReadonlyArray2,
    ndarray::{Array2, Array3, ArrayView1},
};
use pyo3::prelude::*;

use crate::error::{raised, wrong};

/// The lens of a calibration file of any program that is known.
#[pyclass(frozen)]
pub(crate) struct Lens {
    camera: Camera,
    certainty: Option<(LensMatrix, ProjectionJacobian)>,
}

/// Two maps for `cv2.remap`.
type Maps<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>);

fn pixel(row: ArrayView1<'_, f64>) -> Point2<f64> {
    Point2::new(row[0], row[1])
}

fn columns(array: &PyReadonlyArray2<'_, f64>, count: usize) -> PyResult<()> {
    let is_right = array.as_array().ncols() == count;
    is_right.then_some(()).ok_or_else(|| wrong(format!("points are an array of N x {count}")))
}

impl Lens {
    /// Covariance of the image of the ray that is seen at a pixel, the camera's turn compensated;
    /// and its derivatives.
    fn certainty_at(
        &self,
        px: &Point2<f64>,
    ) -> Option<(SMatrix<f64, 2, 2>, RayProjection, Vector3<f64>)> {
        let (covariance, jacobian) = self.certainty.as_ref()?;
        let ray = self.camera.ray_from_px(px)?.normalize();
        let at = self.camera.project_ray(&ray)?;
        let by_lens = jacobian.at(&at);
        Some((by_lens * covariance * by_lens.transpose(), at, ray))
    }
}

#[pymethods]
impl Lens {
    /// The lens in `text`, a calibration file.
    #[new]
    fn new(text: &str) -> PyResult<Self> {
        let old = import::read(text).map_err(|err| raised(&err.into()))?;
        let camera = old.camera;
        let covers = |px: &Point2<f64>| old.outlines.iter().any(|outline| outline.covers(px));
        let certainty = old.covariance.and_then(|covariance| {
            let whole = projection_jacobian(&camera, old.image_size)?;
            // The turn that the file's own map has; of the whole picture if the file doesn't say
            // where boards were.
            Some((covariance, whole.turned_over(covers).unwrap_or(whole)))
        });
        Ok(Self { camera, certainty })
    }

    /// Whether the file states its uncertainty.
    #[getter]
    fn is_certain(&self) -> bool {
        self.certainty.is_some()
    }

    /// Pixels of N x 3 points in the camera's frame; NaN outside its field.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        columns(&points, 3)?;
        let points = points.as_array();
        let mut px = Array2::from_elem((points.nrows(), 2), f64::NAN);
        for (point, mut px) in points.rows().into_iter().zip(px.rows_mut()) {
            if let Some(at) = self.camera.project(&Point3::new(point[0], point[1], point[2])) {
                (px[0], px[1]) = (at.x, at.y);
            }
        }
        Ok(px.into_pyarray(py))
    }

    /// Unit vectors towards what is seen at N x 2 pixels; NaN outside the field.
    fn unproject<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        columns(&pixels, 2)?;
        let pixels = pixels.as_array();
        let mut rays = Array2::from_elem((pixels.nrows(), 3), f64::NAN);
        for (px, mut ray) in pixels.rows().into_iter().zip(rays.rows_mut()) {
            if let Some(seen) = self.camera.ray_from_px(&pixel(px)) {
                let seen = seen.normalize();
                (ray[0], ray[1], ray[2]) = (seen.x, seen.y, seen.z);
            }
        }
        Ok(rays.into_pyarray(py))
    }

    /// For each pixel of a picture of `size`, width and height, where this camera sees the ray
    /// `ray_from_px` (u, v, 1).
    fn undistort_map<'py>(
        &self,
        py: Python<'py>,
        ray_from_px: [[f64; 3]; 3],
        size: (usize, usize),
    ) -> Maps<'py> {
        let ray_from_px = Matrix3::from_fn(|row, column| ray_from_px[row][column]);
        let (width, height) = size;
        let (x, y) = py.detach(|| {
            let mut maps = [Array2::zeros((height, width)), Array2::zeros((height, width))];
            for row in 0..height {
                for column in 0..width {
                    let ray = ray_from_px * Vector3::new(column as f64, row as f64, 1.0);
                    let flat = Point2::new(ray.x / ray.z, ray.y / ray.z);
                    let px = self.camera.px_from_normalized(&flat);
                    // A map is float32, as OpenCV's remap wants it.
                    maps[0][[row, column]] = px.x as f32;
                    maps[1][[row, column]] = px.y as f32;
                }
            }
            let [x, y] = maps;
            (x, y)
        });
        (x.into_pyarray(py), y.into_pyarray(py))
    }

    /// Covariances of projection at N x 2 pixels, N x 2 x 2; NaN outside the field.
    fn covariance_at<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        columns(&pixels, 2)?;
        let pixels = pixels.as_array();
        let mut all = Array3::from_elem((pixels.nrows(), 2, 2), f64::NAN);
        for (px, mut entries) in pixels.rows().into_iter().zip(all.outer_iter_mut()) {
            if let Some((covariance, ..)) = self.certainty_at(&pixel(px)) {
                entries.indexed_iter_mut().for_each(|(at, entry)| *entry = covariance[at]);
            }
        }
        Ok(all.into_pyarray(py))
    }

    /// Covariances of the unit vectors of [`Lens::unproject`], N x 3 x 3; NaN outside the field.
    fn bearing_covariance<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        columns(&pixels, 2)?;
        let pixels = pixels.as_array();
        let mut all = Array3::from_elem((pixels.nrows(), 3, 3), f64::NAN);
        for (px, mut entries) in pixels.rows().into_iter().zip(all.outer_iter_mut()) {
            let Some((covariance, at, ray)) = self.certainty_at(&pixel(px)) else { continue };
            // Of a unit ray r: d px / d r, whose rows are at right angles to r, and its
            // pseudo-inverse.
            let px_by_ray = at.jac_rotation * ray.cross_matrix();
            let Some(inverse) = (px_by_ray * px_by_ray.transpose()).try_inverse() else { continue };
            let ray_by_px = px_by_ray.transpose() * inverse;
            let covariance = ray_by_px * covariance * ray_by_px.transpose();
            entries.indexed_iter_mut().for_each(|(at, entry)| *entry = covariance[at]);
        }
        Ok(all.into_pyarray(py))
    }
}
