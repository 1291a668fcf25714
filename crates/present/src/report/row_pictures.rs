//! A pair's pictures of one moment, as taken and rectified, with lines across both.

use std::fmt::Write;

use image::{GrayImage, Luma, imageops::interpolate_bilinear};
use nalgebra::{Point2, Point3, Vector3};

use super::thumbnail::Thumbnail;
use crate::{chart::escaped, text::rig as words};
use boresight_formats::{RigFile, RigPairEntry};
use boresight_geometry::{Camera, Rectified, Rig, frame::ImageSize};

/// Longer side of a picture on the page.
const LONGEST_PX: u32 = 480;
/// Lines across both pictures.
const LINES: u32 = 9;
/// Space between the pictures.
const GAP_PX: f64 = 8.0;

/// Pictures of two cameras at one moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RowPictures {
    names: [String; 2],
    taken: [Thumbnail; 2],
    rectified: [Thumbnail; 2],
    /// True for cameras above each other, whose columns agree.
    is_vertical: bool,
}

impl RowPictures {
    /// Pictures of the pair with the least certain rows, at the first instant of which `picture`,
    /// by the camera's name and the instant's number, has both. `None` if no pair has rows.
    pub fn of(rig: &RigFile, picture: &dyn Fn(&str, u64) -> Option<GrayImage>) -> Option<Self> {
        let sd_px = |pair: &&RigPairEntry| pair.row_sd_px.unwrap_or(f64::INFINITY);
        let pairs = rig.pairs.iter().filter(|pair| pair.row_rms_px.is_some());
        let pair = pairs.max_by(|a, b| sd_px(a).total_cmp(&sd_px(b)))?;
        let names = pair.of.clone();
        let of_both = rig
            .instants
            .iter()
            .filter(|instant| names.iter().all(|name| instant.residual_px.contains_key(name)));
        let taken = of_both
            .filter_map(|instant| {
                let [one, other] = names.each_ref().map(|name| picture(name, instant.number));
                Some([one?, other?])
            })
            .next()?;
        let [one, other] =
            names.each_ref().map(|name| rig.cameras.iter().find(|camera| camera.name == *name));
        let cameras = [one?.lens.camera(), other?.lens.camera()];
        let pose = pair.second_from_first.pose()?;
        let places = vec![nalgebra::Isometry3::identity(), pose];
        let whole = Rig { cameras: cameras.to_vec(), cam_from_rig: places };
        let found = whole.rectified(0, 1)?;
        let sizes = taken.each_ref().map(ImageSize::of);
        let f_px = cameras[0].f_px.y.min(cameras[1].f_px.y);
        let centre_px = found.centre_px([(&cameras[0], sizes[0]), (&cameras[1], sizes[1])], f_px);
        let common = Camera::pinhole(f_px, centre_px);
        let rectified =
            [0, 1].map(|index| warped(&taken[index], (&cameras[index], &found, index), &common));
        let small = |picture: &GrayImage| Thumbnail::within(picture, LONGEST_PX);
        let both = |[one, other]: [Option<Thumbnail>; 2]| Some([one?, other?]);
        Some(Self {
            names,
            taken: both(taken.each_ref().map(small))?,
            rectified: both(rectified.each_ref().map(small))?,
            is_vertical: found.is_vertical,
        })
    }

    /// The pictures as taken, and rectified.
    pub(super) fn drawings(&self) -> String {
        let [taken, rectified] = [&self.taken, &self.rectified].map(|pair| self.drawing(pair));
        format!(
            "<p>{}</p>\n{taken}<p>{}</p>\n{rectified}<p class=\"note\">{}</p>\n",
            words::AS_TAKEN,
            words::RECTIFIED,
            words::ROWS_NOTE
        )
    }

    /// Both pictures beside or above each other at one scale, with lines.
    fn drawing(&self, pictures: &[Thumbnail; 2]) -> String {
        let sizes = pictures.each_ref().map(|picture| {
            let ImageSize { width_px, height_px } = picture.small;
            [f64::from(width_px), f64::from(height_px)]
        });
        let along = usize::from(self.is_vertical);
        let across = 1 - along;
        let mut size = [0.0; 2];
        size[along] = sizes[0][along] + GAP_PX + sizes[1][along];
        size[across] = sizes[0][across].max(sizes[1][across]);
        let title = words::pair_name(&self.names[0], &self.names[1]);
        let [width, height] = size;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">\n",
            escaped(&title)
        );
        let mut at = [0.0; 2];
        for (picture, [wide, high]) in pictures.iter().zip(sizes) {
            let [x, y] = at;
            // Writing to a string cannot fail.
            let _ = writeln!(
                svg,
                "<image x=\"{x}\" y=\"{y}\" width=\"{wide}\" height=\"{high}\" href=\"{}\"/>",
                picture.data_uri()
            );
            at[along] += sizes[0][along] + GAP_PX;
        }
        for line in 1..=LINES {
            let share = f64::from(line) / f64::from(LINES + 1);
            let (mut from, mut to) = ([0.0; 2], [0.0; 2]);
            (from[across], to[across]) = (share * size[across], share * size[across]);
            to[along] = size[along];
            let _ = writeln!(
                svg,
                "<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" stroke=\"#e69f00\"/>",
                from[0], from[1], to[0], to[1]
            );
        }
        svg + "</svg>\n"
    }
}

/// `picture` as the camera `common` would see it after the rectifying turn; black where the
/// picture ends.
fn warped(
    picture: &GrayImage,
    (camera, found, index): (&Camera, &Rectified, usize),
    common: &Camera,
) -> GrayImage {
    let back = found.rotations[index].inverse();
    GrayImage::from_fn(picture.width(), picture.height(), |x, y| {
        let px = Point2::new(f64::from(x), f64::from(y));
        let ray = Vector3::new(
            (px.x - common.pp_px.x) / common.f_px.x,
            (px.y - common.pp_px.y) / common.f_px.y,
            1.0,
        );
        let seen = camera.project(&Point3::from(back * ray));
        seen.and_then(|px| interpolate_bilinear(picture, px.x as f32, px.y as f32))
            .unwrap_or(Luma([0]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean position of the light.
    fn light(picture: &GrayImage) -> [f64; 2] {
        let mut sums = [0.0; 3];
        for (x, y, Luma([value])) in picture.enumerate_pixels() {
            let value = f64::from(*value);
            sums =
                [sums[0] + value, sums[1] + value * f64::from(x), sums[2] + value * f64::from(y)];
        }
        [sums[1] / sums[0], sums[2] / sums[0]]
    }

    #[test]
    fn a_point_is_in_one_row_of_both_rectified_pictures() {
        let cameras = [(300.0, 158.0), (330.0, 170.0)]
            .map(|(f_px, x)| Camera::pinhole(f_px, Point2::new(x, 121.0)));
        let turn = Vector3::new(0.06, 0.1, 0.05);
        let place = nalgebra::Isometry3::new(Vector3::new(-0.12, 0.003, 0.01), turn);
        let places = vec![nalgebra::Isometry3::identity(), place];
        let rig = Rig { cameras: cameras.to_vec(), cam_from_rig: places };
        let found = rig.rectified(0, 1).expect("two places");
        let size = ImageSize { width_px: 320, height_px: 240 };
        let centre_px = found.centre_px([(&cameras[0], size), (&cameras[1], size)], 300.0);
        let common = Camera::pinhole(300.0, centre_px);
        for point in [Point3::new(0.1, 0.1, 0.6), Point3::new(0.05, -0.1, 0.5)] {
            let seen = [0, 1].map(|index| {
                let px = cameras[index].project(&(rig.cam_from_rig[index] * point));
                let px = px.expect("in front");
                let near = |x: u32, y: u32| {
                    let off = Point2::new(f64::from(x), f64::from(y)) - px;
                    Luma([(255.0 * (-off.norm_squared() / 8.0).exp()) as u8])
                };
                let picture = GrayImage::from_fn(320, 240, near);
                (
                    light(&picture),
                    light(&warped(&picture, (&cameras[index], &found, index), &common)),
                )
            });
            let rows = |of: fn(&([f64; 2], [f64; 2])) -> f64| (of(&seen[0]) - of(&seen[1])).abs();
            assert!(rows(|it| it.0[1]) > 5.0, "as taken: {seen:?}");
            assert!(rows(|it| it.1[1]) < 0.1, "rectified: {seen:?}");
        }
    }
}
