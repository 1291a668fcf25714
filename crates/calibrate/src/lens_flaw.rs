//! Lenses that can't be right, whatever a camera shows.

use nalgebra::Point2;

use boresight_geometry::{BoardOutline, Camera, cell_centres_px, frame::ImageSize};

/// Possible focal lengths, in widths of the picture: fields of view from 169° to 0.06°.
const POSSIBLE_F: std::ops::Range<f64> = 0.05..1000.0;
/// Margin around the scales of a fisheye lens and of a pinhole.
const SCALE_MARGIN: f64 = 2.0;
/// Largest share of the calibrated part of the picture with impossible scales. A lens that is right
/// where its boards were may fold over in the corners.
const MAX_IMPOSSIBLE_FRACTION: f64 = 0.25;

/// Reason why a stated lens can't be right in pictures of its size.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LensFlaw {
    /// The focal length is far from that of any lens.
    #[error("a focal length of {widths} widths of the picture")]
    FocalLength {
        /// Focal length along x, in widths of the picture.
        widths: f64,
    },
    /// The distortion folds over, has a pole, or stretches the picture as no lens does.
    #[error("an impossible distortion in {:.0} % of the picture", 100.0 * share)]
    Distortion {
        /// Share of the part of the picture where the boards were; of the whole if that is unknown.
        share: f64,
    },
}

impl LensFlaw {
    /// Flaw of `camera` in pictures of `image_size`, calibrated with boards at `outlines`,
    /// which are empty if unknown. `None` for a lens that may be right.
    pub fn of(camera: &Camera, image_size: ImageSize, outlines: &[BoardOutline]) -> Option<Self> {
        let widths = camera.f_px / f64::from(image_size.width_px);
        if !widths.iter().all(|widths| POSSIBLE_F.contains(widths)) {
            return Some(Self::FocalLength { widths: widths.x });
        }
        let is_calibrated =
            |px: &_| outlines.is_empty() || outlines.iter().any(|outline| outline.covers(px));
        let (mut seen, mut impossible) = (0_usize, 0_usize);
        for px in cell_centres_px(image_size).filter(is_calibrated) {
            seen += 1;
            let is_open = camera.is_outside_field(&px);
            impossible += usize::from(!is_open && !is_possible(camera, &px));
        }
        let share = impossible as f64 / seen.max(1) as f64;
        (share > MAX_IMPOSSIBLE_FRACTION).then_some(Self::Distortion { share })
    }
}

/// True if the scale at a pixel, in pixels per radian, is about that of a lens: at the angle θ from
/// the axis, between `f cos θ` of an orthographic fisheye lens and `f/cos² θ` of a pinhole.
fn is_possible(camera: &Camera, px: &Point2<f64>) -> bool {
    let scales = || {
        let ray = camera.ray_from_px(px)?.normalize();
        let scales = camera.project_ray(&ray)?.jac_rotation.singular_values();
        let least_px = camera.f_px.min() * ray.z.max(0.0) / SCALE_MARGIN;
        let most_px = camera.f_px.max() * SCALE_MARGIN / ray.z.max(0.0).powi(2);
        Some(scales.min() >= least_px && scales.max() <= most_px)
    };
    scales().unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use boresight_geometry::{Distortion, LensKind};

    use super::*;

    const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };

    fn flaw(f_px: f64, distortion: Distortion) -> Option<LensFlaw> {
        let camera = Camera { distortion, ..Camera::pinhole(f_px, SIZE.centre_px()) };
        LensFlaw::of(&camera, SIZE, &[])
    }

    #[test]
    fn ordinary_lenses_may_be_right() {
        let none = Distortion::default();
        assert_eq!(flaw(900.0, none), None);
        assert_eq!(flaw(900.0, Distortion { k1: -0.3, k2: 0.1, ..none }), None);
        // Folds over in the corners only.
        assert_eq!(flaw(900.0, Distortion { k1: -0.3, ..none }), None);
        // A round picture inside the frame.
        let fisheye = Distortion { kind: LensKind::Fisheye, k1: -0.02, ..none };
        assert_eq!(flaw(180.0, fisheye), None);
    }

    #[test]
    fn no_lens_folds_over_in_the_middle_or_has_no_field_of_view() {
        let none = Distortion::default();
        // As overfitted in the field: it grows ever faster; a fold; a pole.
        for distortion in [
            Distortion { k1: 16.0, k2: -4242.0, k3: 294_239.0, ..none },
            Distortion { k1: -3.0, ..none },
            Distortion { k4: -9.0, ..none },
        ] {
            let found = flaw(900.0, distortion);
            assert!(
                matches!(found, Some(LensFlaw::Distortion { .. })),
                "{distortion:?}: {found:?}"
            );
        }
        let far = flaw(4_119_863.0, Distortion::default());
        assert!(matches!(far, Some(LensFlaw::FocalLength { .. })));
        assert!(flaw(f64::NAN, Distortion::default()).is_some());
    }

    #[test]
    fn a_lens_is_judged_where_its_boards_were() {
        let fold = Distortion { k1: -1.0, ..Distortion::default() };
        let camera = Camera { distortion: fold, ..Camera::pinhole(900.0, SIZE.centre_px()) };
        let middle = [[500.0, 260.0], [780.0, 260.0], [780.0, 460.0], [500.0, 460.0]];
        let middle = BoardOutline::around(middle.map(Into::into)).expect("numbers");
        assert!(LensFlaw::of(&camera, SIZE, &[]).is_some());
        assert_eq!(LensFlaw::of(&camera, SIZE, &[middle]), None);
    }
}
