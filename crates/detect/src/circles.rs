//! Finds a grid of circles: the images of the circles' centres, which differ from the ellipses'
//! centres.
//!
//! The image of a circle is an ellipse, but its centre isn't the image of the circle's centre:
//! perspective moves it by some tenths of a pixel, computed from the map from the board to the
//! picture. The map is the plane through all centres, bent with the lens, plus a cubic surface
//! through their residuals.

use image::GrayImage;
use nalgebra::{Matrix2, Point2, SMatrix, SVector, Vector2};

use super::{
    circle_blobs::{Blob, BlobFinder, TILES_PX},
    circle_grid::{CircleGrower, longest, place_circles, whole_grid},
    disc_model::{self, DiscFit},
    disc_pixels::Pixels,
    explain::{GridOutcome, WeighedGrid},
    lattice::axes,
    outcome::{Detection, Miss, OtherBoard, Quality},
    params::DetectorParams,
    plane::Plane,
    reduce::Halved,
    refine::{LOST_SHARE, LOST_SHARE_OF_PART},
    track::Expected,
};
use boresight_geometry::{
    Corner, boards::Board, boards::Circles, expect_unseen, frame::ImageSize, markers::CircleRows,
    seen_count,
};

/// Most ellipses considered in a picture.
const MOST_BLOBS: usize = 3000;
/// Least number of circles.
const LEAST_CIRCLES: usize = 9;
/// Largest difference between an ellipse and the image of the circle, as a share of the axes:
/// beyond, the circle is covered, or isn't one.
const UNLIKE: f64 = 0.3;
/// Largest fourth harmonic of the outlines, in radii: that of squares is 0.15.
const MOST_SQUARE: f64 = 0.05;
/// Most outlines measured in a grid that isn't the board.
const MOST_OUTLINES: usize = 12;
/// Rounds of matching the map and the centres.
const ROUNDS: usize = 3;
/// Number of coefficients of a cubic surface, and regularisation of the sums of squares, so that
/// few circles give a flat surface.
const TERMS: usize = 10;
const LEAST_SQUARES: f64 = 1e-6;
/// Number of points on a circle's outline.
const OUTLINE: usize = 16;

/// Expected corners, the grids weighed, and the circles of the closest grid.
type Notes<'a> = (&'a Expected, &'a mut Option<Vec<WeighedGrid>>, &'a mut Vec<[f64; 2]>);

/// Finds circles. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct CircleSearch {
    finder: BlobFinder,
    blobs: Vec<Blob>,
    grower: CircleGrower,
    corners: Vec<Option<[f32; 2]>>,
    pixels: Pixels,
}

impl CircleSearch {
    /// Finds the board in `image` by way of `picture`, which is the image, `halved`. Adds the grids
    /// compared with the board to `weighed`, if present, and writes the circles of the closer miss
    /// to `closest`, in pixels of the image. If another board is seen whole, or was the `best_miss`
    /// elsewhere, circles of it aren't accepted as a part of this one.
    ///
    /// # Errors
    ///
    /// [`Miss`] without the board: the closer of this picture's and `best_miss`.
    pub(super) fn find(
        &mut self,
        (image, picture, halved): (&GrayImage, &GrayImage, Halved),
        (board, circles, mut best_miss): (&Board, &Circles, Miss),
        (expected, weighed, closest): Notes<'_>,
        params: &DetectorParams,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<Detection, Miss> {
        for tile_px in TILES_PX {
            if !keep_on() {
                return Err(Miss::OutOfTime);
            }
            self.find_blobs(picture, tile_px);
            for is_dark in [true, false] {
                self.grower.grow(&self.blobs, is_dark, longest(circles));
                if self.grower.lattice.len() < LEAST_CIRCLES {
                    continue;
                }
                if !keep_on() {
                    return Err(Miss::OutOfTime);
                }
                let lattice = &self.grower.lattice;
                let placed = place_circles(picture, lattice, circles, expected, &mut self.corners);
                let found = match placed {
                    Ok(()) => self.refine(image, halved, board, params, keep_on),
                    Err(Miss::OtherBoard(other)) => {
                        Err(self.confirm(other, (image, picture, halved), params, keep_on))
                    }
                    Err(miss) => Err(miss),
                };
                let max_residual = params.max_residual;
                let found = found.map_err(|miss| match miss {
                    Miss::PartialBoard { .. }
                        if miss.is_closer_than(best_miss)
                            && !self.are_circles(image, halved, max_residual) =>
                    {
                        Miss::NoBoard
                    }
                    miss => miss,
                });
                if let Some(weighed) = weighed {
                    let outcome = match &found {
                        Ok(found) => GridOutcome::Named(seen_count(&found.corners)),
                        Err(miss) => GridOutcome::Missed(*miss),
                    };
                    weighed.push(WeighedGrid::seen(&self.grower.lattice, outcome));
                }
                match found {
                    Err(Miss::OutOfTime) => return Err(Miss::OutOfTime),
                    Err(miss) if miss.is_closer_than(best_miss) => {
                        best_miss = miss;
                        let lattice = &self.grower.lattice;
                        let circles = lattice.nodes().iter().filter_map(|node| lattice.get(*node));
                        closest.clear();
                        closest.extend(circles.map(|at| halved.full_px(at)));
                    }
                    Err(_) => {}
                    Ok(detection) => {
                        let is_whole = seen_count(&detection.corners) == detection.corners.len();
                        if is_whole || !matches!(best_miss, Miss::OtherBoard { .. }) {
                            return Ok(detection);
                        }
                    }
                }
            }
        }
        Err(best_miss)
    }

    /// Miss by the `other` board that the grid may be: squares look like circles until their
    /// outlines are measured.
    fn confirm(
        &mut self,
        other: OtherBoard,
        (image, picture, halved): (&GrayImage, &GrayImage, Halved),
        params: &DetectorParams,
        keep_on: &dyn Fn() -> bool,
    ) -> Miss {
        let board = other.choice().and_then(|choice| choice.drawn(1.0));
        let Some((board, Board::Circles(circles))) = board.as_ref().map(|it| (it, it)) else {
            return Miss::NoBoard;
        };
        let (lattice, nowhere) = (&self.grower.lattice, &Expected::default());
        let placed = place_circles(picture, lattice, circles, nowhere, &mut self.corners);
        match placed.and_then(|()| self.refine(image, halved, board, params, keep_on)) {
            Ok(_) => Miss::OtherBoard(other),
            Err(Miss::OutOfTime) => Miss::OutOfTime,
            Err(_) => Miss::NoBoard,
        }
    }

    /// Grids of circles without gaps in `picture`, of any size up to `longest` circles a side.
    pub(super) fn whole_grids(&mut self, picture: &GrayImage, longest: usize) -> Vec<OtherBoard> {
        let mut grids = Vec::new();
        for tile_px in TILES_PX {
            self.find_blobs(picture, tile_px);
            for is_dark in [true, false] {
                self.grower.grow(&self.blobs, is_dark, longest);
                let lattice = &self.grower.lattice;
                grids.extend(CircleRows::ALL.into_iter().filter_map(|it| whole_grid(lattice, it)));
            }
        }
        grids
    }

    fn find_blobs(&mut self, picture: &GrayImage, tile_px: usize) {
        self.finder.find(picture, tile_px, &mut self.blobs);
        self.blobs.truncate(MOST_BLOBS);
        self.grower.start(&self.blobs, [picture.width(), picture.height()]);
    }

    /// Ellipse at a place of the grid, with the distance of the nearest neighbour in radii.
    fn start(&self, at: [f32; 2]) -> Option<(&Blob, f32)> {
        let blob = self.blobs.iter().find(|blob| blob.at == at)?;
        let nearest = self.corners.iter().flatten().filter(|other| **other != at).map(|other| {
            let [x, y] = blob.radii_to(*other);
            libm::hypotf(x, y)
        });
        Some((blob, nearest.min_by(f32::total_cmp)?))
    }

    fn fit(&mut self, image: &GrayImage, halved: Halved, at: [f32; 2]) -> Option<DiscFit> {
        let (blob, step) = self.start(at)?;
        let [a, b, c] = blob.to_circle().map(|it| f64::from(it) / halved.scale);
        let to_circle = Matrix2::new(a, 0.0, b, c);
        let start_px = halved.full_px(at);
        disc_model::fit(image, start_px, &to_circle, f64::from(step), &mut self.pixels)
    }

    /// True if the shapes of the grid are circles. Others look like them until their outlines are
    /// measured: squares have sides along the grid or its diagonals, and keys of a keyboard aren't
    /// as long and wide as circles seen with their grid.
    fn are_circles(&mut self, image: &GrayImage, halved: Halved, max_residual: f64) -> bool {
        let lattice = &self.grower.lattice;
        self.corners.clear();
        self.corners.extend(lattice.nodes().iter().map(|node| lattice.get(*node)));
        let (mut tried, mut alike, mut sums) = (0, 0, [0.0, 1e-9]);
        for index in 0..self.corners.len() {
            let lattice = &self.grower.lattice;
            let axes = self.corners[index]
                .and_then(|at| Some((at, axes(lattice, lattice.nodes()[index], at)?)));
            let Some((at, (u, v))) = axes.filter(|_| tried < MOST_OUTLINES) else { continue };
            let steps = Matrix2::new(u[0], v[0], u[1], v[1]).map(f64::from);
            tried += 1;
            let fit = self.fit(image, halved, at).filter(|fit| {
                let circles = (fit.to_circle() * steps).determinant().abs().sqrt();
                fit.residual < max_residual && is_like(fit, &(steps / circles))
            });
            if let Some(fit) = fit {
                alike += 1;
                fit.add_fourth_harmonic(image, &steps, &mut sums, &mut self.pixels);
            }
        }
        LOST_SHARE_OF_PART * (tried - alike) <= tried && !is_square(sums)
    }

    fn refine(
        &mut self,
        image: &GrayImage,
        halved: Halved,
        board: &Board,
        params: &DetectorParams,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<Detection, Miss> {
        let (columns, wanted) = (board.columns(), board.corner_count());
        let tried = self.corners.iter().flatten().count();
        let mut fits: Vec<Option<DiscFit>> = Vec::with_capacity(wanted);
        for index in 0..wanted {
            if index % columns == 0 && !keep_on() {
                return Err(Miss::OutOfTime);
            }
            let fit = self.corners[index].and_then(|at| self.fit(image, halved, at));
            fits.push(fit.filter(|fit| fit.residual < params.max_residual));
        }
        let partial =
            |found: usize| Miss::PartialBoard { found, wanted, size: [0; 2], cut_off_by: None };
        let points_m = board.corners_in_board_m();
        let image_size = ImageSize::of(image);
        // Partly covered circles are found by their shape, known from the others.
        let mut centres = Vec::new();
        let mut before = usize::MAX;
        let found = loop {
            let found = fits.iter().flatten().count();
            if found < LEAST_CIRCLES || LOST_SHARE * (tried - found) > tried {
                return Err(partial(found));
            }
            if found == before {
                break found;
            }
            before = found;
            centres = true_centres(&points_m, board.measured_m(), &fits, image_size)
                .ok_or(Miss::NoBoard)?;
            for (fit, centre) in fits.iter_mut().zip(&centres) {
                *fit = fit.take().filter(|fit| is_like(fit, &centre.px_from_circle));
            }
        };
        let mut sums = [0.0, 1e-9];
        for (fit, centre) in fits.iter().zip(&centres) {
            let Some(fit) = fit else { continue };
            fit.add_fourth_harmonic(image, &centre.px_from_circle, &mut sums, &mut self.pixels);
        }
        if is_square(sums) {
            return Err(Miss::NoBoard);
        }
        let median = |of: &dyn Fn(&DiscFit) -> f64| {
            let mut all: Vec<f64> = fits.iter().flatten().map(of).collect();
            all.sort_unstable_by(f64::total_cmp);
            all.get(all.len() / 2).copied().unwrap_or_default()
        };
        let noise = median(&|fit| fit.noise);
        let blur_px = median(&DiscFit::blur_px);
        let contrast = median(&|fit| fit.step().abs());
        if blur_px > params.max_blur_px {
            return Err(Miss::Blurred { blur_px, limit_px: params.max_blur_px });
        }
        if contrast < params.min_contrast {
            return Err(Miss::LowContrast { contrast, needed: params.min_contrast });
        }
        let lit = fits.iter().flatten().filter(|fit| fit.light() >= 252.0).count();
        let mut corners: Vec<Corner> = Vec::with_capacity(wanted);
        corners.extend(fits.iter().zip(&centres).map(|(fit, centre)| match fit {
            None => Corner::unseen(Point2::new(f64::NAN, f64::NAN)),
            Some(fit) => {
                let fit = fit.with_least_noise(noise);
                Corner::new(fit.centre.px - centre.bias_px, fit.centre.covariance_px2)
            }
        }));
        expect_unseen(&points_m, &mut corners);
        if corners.iter().any(|corner| !corner.px.x.is_finite()) {
            return Err(partial(found));
        }
        corners.iter_mut().for_each(|corner| *corner = corner.in_few_digits());
        let glare = lit as f64 / found as f64;
        Ok(Detection { corners, quality: Quality { blur_px, contrast, glare, motion_px: 0.0 } })
    }
}

/// True if the ellipse is the image of a circle by the map from its radii.
fn is_like(fit: &DiscFit, px_from_circle: &Matrix2<f64>) -> bool {
    let turned = fit.to_circle() * px_from_circle;
    (turned.transpose() * turned - Matrix2::identity()).amax() < UNLIKE
}

/// True if outlines with the given sums of [`DiscFit::add_fourth_harmonic`] are squares.
fn is_square([along, all]: [f64; 2]) -> bool {
    (along / all).abs() > MOST_SQUARE
}

/// Centre of a circle in the picture.
#[derive(Clone, Copy, Debug)]
struct Centre {
    /// Offset of the ellipse's centre from the image of the circle's centre.
    bias_px: Vector2<f64>,
    /// Map from offsets in radii of the circle to pixels.
    px_from_circle: Matrix2<f64>,
}

/// Centre of each circle by the map from the board to the picture through the fits. The circles'
/// radius is the best fit to the ellipses' areas. `None` if no map goes through them.
fn true_centres(
    points_m: &[Point2<f64>],
    pitch_m: f64,
    fits: &[Option<DiscFit>],
    image_size: ImageSize,
) -> Option<Vec<Centre>> {
    let mut centres =
        vec![Centre { bias_px: Vector2::zeros(), px_from_circle: Matrix2::identity() }; fits.len()];
    let mut radius_m = 0.25 * pitch_m;
    for _ in 0..ROUNDS {
        let pairs = fits.iter().enumerate().filter_map(|(index, fit)| {
            Some((points_m[index], fit.as_ref()?.centre.px - centres[index].bias_px))
        });
        let plane = Plane::through(&pairs, image_size)?;
        // Residuals of the plane, by distances of rows on the board.
        let left: Vec<(Vector2<f64>, Vector2<f64>)> = pairs
            .clone()
            .filter_map(|(point, px)| Some((point.coords / pitch_m, px - plane.px(&point)?)))
            .collect();
        let surface = Surface::through(&left);
        let mut radii = Vec::with_capacity(left.len());
        for (index, fit) in fits.iter().enumerate() {
            let map = |at: Vector2<f64>| {
                let place = points_m[index] + at;
                Some(plane.px(&place)? + surface.at(place.coords / pitch_m))
            };
            let centre = centre_of(&|at| map(at * radius_m))?;
            if let Some(fit) = fit {
                let area = (fit.to_circle() * centre.px_from_circle).determinant().abs();
                radii.push(radius_m / area.sqrt());
            }
            centres[index] = centre;
        }
        radii.sort_unstable_by(f64::total_cmp);
        radius_m = *radii.get(radii.len() / 2)?;
    }
    Some(centres)
}

/// Cubic surface through the residuals of a plane's centres, in pixels.
struct Surface {
    coefficients: [SVector<f64, TERMS>; 2],
    /// Distance from the board's middle to the ends, in row distances.
    reach: f64,
}

impl Surface {
    fn terms(at: Vector2<f64>) -> SVector<f64, TERMS> {
        let (x, y) = (at.x, at.y);
        let (xx, xy, yy) = (x * x, x * y, y * y);
        SVector::from([1.0, x, y, xx, xy, yy, xx * x, xx * y, x * yy, yy * y])
    }

    fn through(left: &[(Vector2<f64>, Vector2<f64>)]) -> Self {
        let reach = left.iter().fold(1.0, |most: f64, (at, _)| most.max(at.amax()));
        let mut squares = SMatrix::<f64, TERMS, TERMS>::identity() * LEAST_SQUARES;
        let mut pull = [SVector::<f64, TERMS>::zeros(); 2];
        for (at, off) in left {
            let terms = Self::terms(at / reach);
            squares += terms * terms.transpose();
            pull[0] += terms * off.x;
            pull[1] += terms * off.y;
        }
        let solved = squares.cholesky();
        let none = SVector::zeros();
        let coefficients =
            pull.map(|pull| solved.as_ref().map_or(none, |squares| squares.solve(&pull)));
        Self { coefficients, reach }
    }

    fn at(&self, at: Vector2<f64>) -> Vector2<f64> {
        let terms = Self::terms(at / self.reach);
        Vector2::new(self.coefficients[0].dot(&terms), self.coefficients[1].dot(&terms))
    }
}

/// Centre of a circle under `map`, from offsets in radii to pixels. The outline moves by the first
/// harmonic of its displacement along the normal, in the coordinates of the circle.
fn centre_of(map: &dyn Fn(Vector2<f64>) -> Option<Point2<f64>>) -> Option<Centre> {
    let middle = map(Vector2::zeros())?;
    let mut outline = [(Vector2::zeros(), Vector2::zeros()); OUTLINE];
    let mut px_from_circle = Matrix2::zeros();
    for (k, (way, off)) in outline.iter_mut().enumerate() {
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * k as f64 / OUTLINE as f64);
        *way = Vector2::new(cosine, sine);
        *off = map(*way)? - middle;
        px_from_circle += *off * way.transpose() * (2.0 / OUTLINE as f64);
    }
    let inverse = px_from_circle.try_inverse()?;
    let moved = outline.iter().fold(Vector2::zeros(), |sum: Vector2<f64>, (way, off)| {
        sum + way * ((inverse * off).dot(way) * 2.0 / OUTLINE as f64)
    });
    Some(Centre { bias_px: px_from_circle * moved, px_from_circle })
}

#[cfg(test)]
mod tests {
    use boresight_geometry::Homography;
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    /// The pole of the vanishing line is the image of the centre of a circle seen at 60 degrees.
    #[test]
    fn the_centre_of_an_ellipse_is_off_as_its_conic_says() {
        let h = Matrix3::new(400.0, 30.0, 300.0, 20.0, 210.0, 200.0, 0.1, 0.3, 1.0);
        let radius = 0.2;
        let plane = Homography::from_matrix(&h).expect("a map");
        let centre =
            centre_of(&|at| plane.map(&Point2::from(at * radius))).expect("in front of the camera");
        let back = h.try_inverse().expect("a map");
        let circle = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -radius * radius));
        let conic = back.transpose() * circle * back;
        let middle = conic.try_inverse().expect("an ellipse") * Vector3::z();
        let middle = Vector2::new(middle.x, middle.y) / middle.z;
        let truth = plane.map(&Point2::origin()).expect("in front").coords;
        let off_px = (middle - truth - centre.bias_px).norm();
        assert!(
            (middle - truth).norm() > 1.0 && off_px < 0.03,
            "{off_px} of {}",
            (middle - truth).norm()
        );
    }
}
