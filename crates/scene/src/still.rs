//! Scale of the scene behind the board, picture by picture: a witness of the focal length.

use boresight_geometry::{
    frame::{ImageSize, SceneScale},
    parallel,
};
use image::GrayImage;
use nalgebra::Point2;

use crate::{
    level::View,
    measure::{Measured, credible},
    reference::Reference,
    turn::Lens,
};

/// Factor on the board's outline about its middle: hides the board's rim and what holds it.
const HIDDEN: f64 = 1.45;
/// Largest shift of the scene between pictures of a camera that stands still, as a share of the
/// picture's width.
const STILL: f64 = 0.02;
/// Number of pictures tried as reference, evenly over all.
const REFERENCES: usize = 5;

/// Picture with the points of the board in it.
pub type WithBoard = (GrayImage, Vec<Point2<f64>>);

/// Focal lengths of `count` pictures relative to one of them, by the scene behind the board.
///
/// `load` gives a picture with the seen points of its board, in pixels. `None` for a picture that
/// isn't available, shows too little of the scene, or was taken by a camera that had moved. The
/// reference is the one of five pictures, evenly over all, with which most others agree. Uses up to
/// `threads` threads.
pub fn scene_scales(
    lens: &Lens,
    count: usize,
    threads: usize,
    load: impl Fn(usize) -> Option<WithBoard> + Sync,
) -> Vec<Option<SceneScale>> {
    let look = |index: usize| {
        let (image, board_px) = load(index)?;
        let hidden = Hidden::by(&board_px)?;
        (ImageSize::of(&image) == lens.image_size).then(|| (View::of(image), hidden))
    };
    let last = count.saturating_sub(1);
    let mut candidates: Vec<usize> = (0..REFERENCES).map(|i| i * last / (REFERENCES - 1)).collect();
    candidates.dedup();
    let references: Vec<Reference> = candidates
        .into_iter()
        .filter(|index| *index < count)
        .filter_map(|index| {
            let (view, hidden) = look(index)?;
            let is_hidden =
                |x: u32, y: u32| hidden.covers(&Point2::new(f64::from(x), f64::from(y)));
            Some(Reference::of(&view, 0.0, lens, is_hidden))
        })
        .collect();
    let of_picture = |index: usize| match look(index) {
        Some((view, hidden)) => {
            references.iter().map(|reference| scale(lens, reference, &view, &hidden)).collect()
        }
        None => vec![None; references.len()],
    };
    let scales: Vec<Vec<Option<SceneScale>>> = parallel::map(threads, count, of_picture);
    let usable = |place: &usize| scales.iter().filter(|of| of[*place].is_some()).count();
    let Some(best) = (0..references.len()).rev().max_by_key(usable) else {
        return vec![None; count];
    };
    scales.into_iter().map(|of| of[best]).collect()
}

/// Scale of the scene in `view` since `reference`, outside the `hidden` part of both.
fn scale(lens: &Lens, reference: &Reference, view: &View, hidden: &Hidden) -> Option<SceneScale> {
    let turn = reference.locate(view, lens);
    let found = reference.find(view, lens, &turn);
    let behind = found.into_iter().filter(|(_, sighting)| !hidden.covers(&sighting.px));
    let tagged = behind.map(|(index, sighting)| ((0, index), sighting));
    let measured = Measured::of(lens, reference.landmarks.len(), tagged);
    let measured = credible(measured, reference.landmarks.len()).ok()?;
    let px = [measured.turn.pan_rad, measured.turn.tilt_rad].map(|rad| rad * lens.camera.f_px.x);
    let most_px = STILL * f64::from(lens.image_size.width_px);
    let is_still = libm::hypot(px[0], px[1]) < most_px;
    is_still.then(|| SceneScale {
        log_focal: measured.turn.log_focal,
        sd: measured.covariance[(3, 3)].sqrt(),
    })
}

/// Part of a picture hidden by the board and by what holds it: the points' hull, grown.
struct Hidden {
    hull_px: Vec<Point2<f64>>,
}

impl Hidden {
    /// `None` without an area.
    fn by(points_px: &[Point2<f64>]) -> Option<Self> {
        let mut points = points_px.to_vec();
        points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
        let mut hull_px: Vec<Point2<f64>> = Vec::new();
        // The lower chain, then the upper one (Andrew 1979).
        for chain in [points.clone(), points.into_iter().rev().collect()] {
            let start = hull_px.len();
            for point in chain {
                while hull_px.len() >= start + 2
                    && !turns_left(&hull_px[hull_px.len() - 2], &hull_px[hull_px.len() - 1], &point)
                {
                    hull_px.pop();
                }
                hull_px.push(point);
            }
            hull_px.pop();
        }
        let count = hull_px.len() as f64;
        let middle =
            Point2::from(hull_px.iter().map(|p| p.coords).sum::<nalgebra::Vector2<f64>>() / count);
        hull_px.iter_mut().for_each(|p| *p = middle + (*p - middle) * HIDDEN);
        (hull_px.len() >= 3).then_some(Self { hull_px })
    }

    fn covers(&self, px: &Point2<f64>) -> bool {
        let next = self.hull_px.iter().cycle().skip(1);
        self.hull_px.iter().zip(next).all(|(from, to)| turns_left(from, to, px))
    }
}

/// True if the way over three points turns from x towards y.
fn turns_left(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> bool {
    (b - a).perp(&(c - a)) > 0.0
}

#[cfg(test)]
mod tests {
    use boresight_geometry::Camera;

    use super::*;

    const SIZE: ImageSize = ImageSize { width_px: 640, height_px: 480 };

    /// A wall of patches with random levels, enlarged about the middle, behind a dark board whose
    /// place depends on the view; and the board's corners.
    fn picture(view: usize, enlarged: f64, room: u32) -> WithBoard {
        let middle = SIZE.centre_px();
        let board_px = Point2::new(180.0 + 35.0 * view as f64, 230.0);
        let image = GrayImage::from_fn(SIZE.width_px, SIZE.height_px, |x, y| {
            let px = Point2::new(f64::from(x), f64::from(y));
            let off = px - board_px;
            if off.x.abs() < 90.0 && off.y.abs() < 70.0 {
                return image::Luma([20]);
            }
            let at = middle + (px - middle) / enlarged;
            let level = |x: f64, y: f64| {
                let cell = (x / 11.0).floor() as u32 ^ ((y / 11.0).floor() as u32) << 9;
                let mixed = (cell ^ room).wrapping_mul(0x9E37_79B1);
                f64::from(mixed >> 24) * 0.7 + 40.0
            };
            // The mean of nine places in the pixel, as a sensor sees it.
            let places = [-1.0 / 3.0, 0.0, 1.0 / 3.0];
            let all = places.iter().flat_map(|u| places.iter().map(move |v| (*u, *v)));
            let sum: f64 = all.map(|(u, v)| level(at.x + u, at.y + v)).sum();
            image::Luma([(sum / 9.0) as u8])
        });
        let corner = |x: f64, y: f64| Point2::new(board_px.x + x, board_px.y + y);
        let corners =
            [corner(-75.0, -55.0), corner(75.0, -55.0), corner(75.0, 55.0), corner(-75.0, 55.0)];
        (image, corners.to_vec())
    }

    fn scales(of: impl Fn(usize) -> Option<WithBoard> + Sync) -> Vec<Option<SceneScale>> {
        let lens = Lens::new(Camera::pinhole(600.0, SIZE.centre_px()), None, SIZE);
        scene_scales(&lens, 8, 2, of)
    }

    #[test]
    fn the_scene_tells_an_enlarged_picture_from_a_moved_board() {
        let found = scales(|view| Some(picture(view, if view < 4 { 1.0 } else { 1.01 }, 7)));
        let of = |view: usize| found[view].expect("a wall is behind the board");
        for view in 1..8 {
            let off = of(view).log_focal - of(0).log_focal;
            let truth = if view < 4 { 0.0 } else { libm::log(1.01) };
            assert!((off - truth).abs() < 4.0 * of(view).sd, "{view}: {off}");
            assert!(of(view).sd < 1e-3, "{}", of(view).sd);
        }
    }

    #[test]
    fn another_room_and_a_missing_picture_tell_nothing() {
        let found = scales(|view| match view {
            3 => None,
            6 => Some(picture(view, 1.0, 99)),
            _ => Some(picture(view, 1.0, 7)),
        });
        let known: Vec<bool> = found.iter().map(Option::is_some).collect();
        assert_eq!(known, [true, true, true, false, true, true, false, true]);
    }
}
