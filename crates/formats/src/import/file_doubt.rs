//! What a calibration's file shows without pictures: no proof, but worth a look.

use nalgebra::{Matrix3, Vector2};

use super::OldCalibration;
use boresight_calibrate::{LensFamily, LensFlaw, LensModel, WrongPart};
use boresight_geometry::{Camera, Distortion, frame::ImageSize};

/// Pixels that are off square by more than this, or a projection from its lens.
const STRETCHED: f64 = 0.01;
/// Distance of a principal point from the middle, in widths of the picture, that few cameras have.
const PP_FAR: f64 = 0.08;
/// Relative distance within which both coordinates of a principal point fit one other size.
const SAME_SIZE: f64 = 0.06;
/// Ratio of sizes above which a principal point is one for another size.
const OTHER_SIZE: f64 = 1.3;
/// Tangential coefficient of a lens that would visibly be mounted askew.
const TANGENTIAL: f64 = 0.01;
/// Displacement by one term of a polynomial at the picture's nearest edge, in radii: others then
/// cancel it.
const CANCELLED: f64 = 0.5;
/// Error of a rotation in a file of few digits.
const ROTATION_ERROR: f64 = 1e-3;
/// Focal lengths of rectified pictures, in those of the lens.
const POSSIBLE_ZOOM: std::ops::Range<f64> = 0.2..5.0;
/// Largest coordinate of a principal point stated as a fraction of the picture.
const MOST_FRACTION: f64 = 1.5;
/// Diagonal of 35 mm film, in millimetres.
const FILM_DIAGONAL_MM: f64 = 43.27;
/// Ratio of focal lengths that rounding, pictures of another shape, and a crop against shake don't
/// explain.
const OTHER_FIELD: f64 = 1.3;
const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Doubt about a calibration from its file alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FileDoubt {
    /// The principal point is the exact middle of the picture, which no measurement gives.
    PpAssumed,
    /// The principal point is for pictures of another size.
    OtherSize {
        /// The size that it would fit.
        fits: ImageSize,
    },
    /// The principal point is unusually far from the middle.
    PpFar {
        /// Distance in widths of the picture.
        widths: f64,
    },
    /// Pixels aren't square.
    Stretched {
        /// `fy/fx`.
        ratio: f64,
        /// The ratio as whole numbers, if it's that of common shapes of pictures.
        exactly: Option<(u32, u32)>,
    },
    /// A focal length or principal point isn't in pixels.
    Units,
    /// A tangential coefficient is larger than any lens needs.
    Tangential {
        /// The coefficient.
        largest: f64,
    },
    /// Large radial terms cancel each other within the picture.
    Cancelling {
        /// Displacement by the largest at the nearest edge of the picture, in radii.
        share: f64,
    },
    /// Too few views for the stated coefficients.
    FewViews {
        /// Views behind the file.
        views: usize,
        /// Coefficients that aren't zero.
        terms: usize,
    },
    /// The rectifying rotation is none.
    NoRotation,
    /// The projection can't be that of this lens's rectified pictures.
    Projection,
    /// The focal length isn't that in the pictures' EXIF data.
    NotOfExif {
        /// Focal length on 35 mm film, in millimetres.
        film_mm: f64,
        /// The same in the EXIF data.
        exif_mm: f64,
    },
}

/// Every check of numbers in pixels, one kind of doubt each.
const CHECKS: [fn(&OldCalibration) -> Option<FileDoubt>; 7] =
    [pp, stretched, tangential, cancelling, few_views, no_rotation, projection];

impl FileDoubt {
    /// Doubts about `file`.
    pub fn of(file: &OldCalibration) -> Vec<Self> {
        let in_pixels = || CHECKS.iter().filter_map(|check| check(file)).collect();
        units(file).map_or_else(in_pixels, |units| vec![units])
    }

    /// Doubt about `file` by the focal length on 35 mm film in its pictures' EXIF data.
    pub fn by_exif(file: &OldCalibration, exif_mm: f64) -> Option<Self> {
        let film_mm = FILM_DIAGONAL_MM * file.camera.f_px.x / sides(file).norm();
        let ratio = film_mm / exif_mm;
        (ratio.max(ratio.recip()) > OTHER_FIELD).then_some(Self::NotOfExif { film_mm, exif_mm })
    }

    /// True for a doubt about the principal point.
    pub fn is_pp(&self) -> bool {
        matches!(self, Self::PpAssumed | Self::PpFar { .. } | Self::OtherSize { .. })
    }

    /// Stable name, for files and programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::PpAssumed => "PP-ASSUMED",
            Self::OtherSize { .. } => "PP-OF-OTHER-SIZE",
            Self::PpFar { .. } => "PP-FAR",
            Self::Units => "UNITS",
            Self::Stretched { .. } => "STRETCHED",
            Self::Tangential { .. } => "TANGENTIAL",
            Self::Cancelling { .. } => "TERMS-CANCEL",
            Self::FewViews { .. } => "FEW-VIEWS",
            Self::NoRotation => "R-NO-ROTATION",
            Self::Projection => "P-NOT-OF-K",
            Self::NotOfExif { .. } => "F-NOT-OF-EXIF",
        }
    }
}

/// Width and height of the pictures of `file`.
fn sides(file: &OldCalibration) -> Vector2<f64> {
    let size = file.image_size;
    Vector2::new(size.width_px, size.height_px).map(f64::from)
}

fn pp(file: &OldCalibration) -> Option<FileDoubt> {
    let (pp_px, sides) = (file.camera.pp_px.coords, sides(file));
    // Pixels are counted from the centre of the first, or from its edge.
    let is_middle = |from: f64| from < 1e-6 || (from - 0.5).abs() < 1e-6;
    let off_px = pp_px - file.image_size.centre_px().coords;
    if off_px.iter().all(|off| is_middle(off.abs())) {
        return Some(FileDoubt::PpAssumed);
    }
    let fits = 2.0 * pp_px;
    let fits_better = |of: Vector2<f64>| {
        let ratio = fits.component_div(&of);
        (ratio.x / ratio.y - 1.0).abs() < SAME_SIZE && pp_px.min() > 1.0
    };
    let scale = fits.x / sides.x;
    let is_other = scale.max(scale.recip()) > OTHER_SIZE && fits_better(sides);
    let is_turned = (sides.x / sides.y).max(sides.y / sides.x) > OTHER_SIZE
        && (fits.x / sides.y - 1.0).abs() < SAME_SIZE
        && fits_better(sides.yx());
    if is_other || is_turned {
        let [width_px, height_px] = [fits.x, fits.y].map(|side| side.round() as u32);
        return Some(FileDoubt::OtherSize { fits: ImageSize { width_px, height_px } });
    }
    let widths = off_px.amax() / sides.x;
    (widths > PP_FAR).then_some(FileDoubt::PpFar { widths })
}

fn units(file: &OldCalibration) -> Option<FileDoubt> {
    let flaw = LensFlaw::of(&file.camera, file.image_size, &file.outlines);
    let is_short = matches!(flaw, Some(LensFlaw::FocalLength { widths }) if widths < 1.0);
    (is_short || file.camera.pp_px.coords.amax() <= MOST_FRACTION).then_some(FileDoubt::Units)
}

fn stretched(file: &OldCalibration) -> Option<FileDoubt> {
    let ratio = file.camera.f_px.y / file.camera.f_px.x;
    let exactly = WrongPart::whole_ratio(ratio);
    ((ratio - 1.0).abs() > STRETCHED).then_some(FileDoubt::Stretched { ratio, exactly })
}

fn tangential(file: &OldCalibration) -> Option<FileDoubt> {
    let Distortion { p1, p2, .. } = file.camera.distortion;
    let largest = if p1.abs() > p2.abs() { p1 } else { p2 };
    (largest.abs() > TANGENTIAL).then_some(FileDoubt::Tangential { largest })
}

fn cancelling(file: &OldCalibration) -> Option<FileDoubt> {
    let Distortion { k1, k2, k3, .. } = file.camera.distortion;
    let nearest = sides(file).component_div(&(2.0 * file.camera.f_px)).min();
    let terms = [(k1, 2), (k2, 4), (k3, 6)].map(|(k, power)| (k * nearest.powi(power)).abs());
    let share = terms.into_iter().fold(0.0, f64::max);
    let is_polynomial = LensModel::simplest_with(&file.camera).family() == LensFamily::Brown;
    (is_polynomial && share > CANCELLED).then_some(FileDoubt::Cancelling { share })
}

fn few_views(file: &OldCalibration) -> Option<FileDoubt> {
    let (views, stated) = (file.views?, LensModel::simplest_with(&file.camera));
    let terms = stated.coefficients();
    let most = stated.family().richest_of(views).coefficients();
    (terms > most).then_some(FileDoubt::FewViews { views, terms })
}

fn no_rotation(file: &OldCalibration) -> Option<FileDoubt> {
    let rotation = Matrix3::from_row_slice(&file.rectification?);
    let error = (rotation * rotation.transpose() - Matrix3::identity()).amax();
    (error > ROTATION_ERROR || rotation.determinant() < 0.0).then_some(FileDoubt::NoRotation)
}

fn projection(file: &OldCalibration) -> Option<FileDoubt> {
    let [fx, _, cx, _, m10, fy, cy, _, m20, m21, m22, _] = file.projection?;
    let Camera { f_px, pp_px, distortion, .. } = file.camera;
    let of_lens = [f_px.x, f_px.y];
    let possible = |(f, of): (f64, f64)| POSSIBLE_ZOOM.contains(&(f / of));
    let possible = [fx, fy].into_iter().zip(of_lens).all(possible);
    let is_turned = file.rectification.is_some_and(|r| r != IDENTITY);
    // Nothing to rectify: the pictures stay as they are.
    let stays = distortion.is_none() && !is_turned;
    let near = |(a, b): (f64, f64)| (a - b).abs() <= STRETCHED * of_lens[0];
    let differs = ![fx, fy, cx, cy].into_iter().zip([f_px.x, f_px.y, pp_px.x, pp_px.y]).all(near);
    let is_camera = [m10, m20, m21, m22] == [0.0, 0.0, 0.0, 1.0];
    (!is_camera || !possible || (stays && differs)).then_some(FileDoubt::Projection)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::read;

    const ROS: &str = "image_width: 1280
image_height: 720
camera_matrix: {rows: 3, cols: 3, data: [902.1, 0, 651.3, 0, 903.4, 349.8, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.29, 0.11, 0.0007, -0.0004, -0.02]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [760.2, 0, 655.0, 0, 0, 811.0, 347.1, 0, 0, 0, 1, 0]}
";

    /// Doubts about a sound file with `of` replaced by `by`.
    fn codes(of: &str, by: &str) -> Vec<&'static str> {
        assert!(ROS.contains(of), "{of}");
        let file = read(&ROS.replace(of, by)).expect("a calibration");
        FileDoubt::of(&file).iter().map(FileDoubt::code).collect()
    }

    #[test]
    fn each_mistake_of_a_file_is_shown_and_a_sound_file_shows_none() {
        assert_eq!(codes("", ""), Vec::<&str>::new());
        for (of, by, code) in [
            ("651.3, 0, 903.4, 349.8", "639.5, 0, 903.4, 359.5", "PP-ASSUMED"),
            ("651.3, 0, 903.4, 349.8", "640, 0, 903.4, 360", "PP-ASSUMED"),
            ("651.3, 0, 903.4, 349.8", "325.6, 0, 903.4, 174.9", "PP-OF-OTHER-SIZE"),
            ("651.3, 0, 903.4, 349.8", "349.8, 0, 903.4, 651.3", "PP-OF-OTHER-SIZE"),
            ("651.3, 0, 903.4, 349.8", "651.3, 0, 903.4, 479.8", "PP-FAR"),
            ("902.1, 0, 651.3, 0, 903.4", "3.6, 0, 651.3, 0, 3.6", "UNITS"),
            ("651.3, 0, 903.4, 349.8", "0.51, 0, 903.4, 0.49", "UNITS"),
            ("0, 903.4, 349.8", "0, 1203.4, 349.8", "STRETCHED"),
            ("0.0007", "-0.017", "TANGENTIAL"),
            ("-0.29, 0.11, 0.0007, -0.0004, -0.02", "4.1, -24.1, 0, 0, 45.2", "TERMS-CANCEL"),
            ("image_width", "nframes: 1\nimage_width", "FEW-VIEWS"),
            ("[1, 0, 0, 0, 1, 0, 0, 0, 1]", "[1, 0, 0, 0, 1, 0, 0, 0, -1]", "R-NO-ROTATION"),
            ("[1, 0, 0, 0, 1, 0, 0, 0, 1]", "[0, 0, 0, 0, 0, 0, 0, 0, 0]", "R-NO-ROTATION"),
            ("760.2, 0, 655.0", "0, 0, 655.0", "P-NOT-OF-K"),
            ("655.0, 0, 0, 811.0", "655.0, 0, 811.0, 0", "P-NOT-OF-K"),
            ("-0.29, 0.11, 0.0007, -0.0004, -0.02", "0, 0, 0, 0, 0", "P-NOT-OF-K"),
        ] {
            assert_eq!(codes(of, by), [code], "{by}");
        }
        // As wide as a lens of 26.6 mm on film.
        let file = read(ROS).expect("a calibration");
        for (exif_mm, is_doubtful) in [(52.0, true), (36.0, true), (28.0, false), (24.0, false)] {
            let doubt = FileDoubt::by_exif(&file, exif_mm);
            assert_eq!(doubt.map(|doubt| doubt.code()), is_doubtful.then_some("F-NOT-OF-EXIF"));
        }
        let ratio = FileDoubt::of(&read(&ROS.replace("903.4", "1202.8")).expect("read"));
        assert!(matches!(ratio[..], [FileDoubt::Stretched { exactly: Some((4, 3)), .. }]));
    }
}
