//! Every page at every kind of moment, in five sizes and two palettes, as pictures for inspection:
//! `BORESIGHT_MATRIX=FOLDER cargo test --release --test window matrix`. Also measures the size of
//! letters from afar.

use std::path::{Path, PathBuf};

use boresight::{
    detection::OtherBoard,
    frame::{CaptureTime, Frame, FrameId, FrameKind},
    session::{Prompt, Snapshot},
};
use egui::{Theme, Vec2, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use image::{GrayImage, Luma, RgbaImage};
use nalgebra::{Matrix3, Point2, SMatrix, SVector, Vector3};

use crate::{
    Page, Table,
    fixtures::{Moment, moments},
    harness_at,
};

/// Width and height in points, and pixels of a point.
pub(crate) const SIZES: [(f32, f32, f32); 6] = [
    (1024.0, 640.0, 1.0),
    (1366.0, 768.0, 1.0),
    (1366.0, 768.0, 2.0),
    (1280.0, 720.0, 3.0),
    (1920.0, 1080.0, 1.0),
    (3840.0, 2160.0, 1.0),
];

/// Moments of the matrix: name, and fixture.
const MOMENTS: [(&str, &str); 15] = [
    ("first run", "fresh"),
    ("no camera", "fresh"),
    ("searching", "searching"),
    ("approaching", "refused: TooFlat"),
    ("holding", "holding"),
    ("taken", "accepted"),
    ("partner", "partner wanted"),
    ("camera lost", "camera lost"),
    ("focus moved", "focus moved"),
    ("different board", "other board"),
    ("done good", "done good"),
    ("done care", "done care"),
    ("unfinished", "partner wanted"),
    ("done untrustworthy", "done untrustworthy"),
    ("paused", "paused"),
];

/// Maps the unit square's corners, in order around the square, to `to`.
pub(crate) fn square_to(to: [Point2<f64>; 4]) -> Option<Matrix3<f64>> {
    let from = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let mut rows = SMatrix::<f64, 8, 8>::zeros();
    let mut right = SVector::<f64, 8>::zeros();
    for (i, ((x, y), px)) in from.into_iter().zip(to).enumerate() {
        let (u, v) = (px.x, px.y);
        rows.set_row(2 * i, &[x, y, 1.0, 0.0, 0.0, 0.0, -u * x, -u * y].into());
        rows.set_row(2 * i + 1, &[0.0, 0.0, 0.0, x, y, 1.0, -v * x, -v * y].into());
        (right[2 * i], right[2 * i + 1]) = (u, v);
    }
    let h = rows.lu().solve(&right)?;
    Some(Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0))
}

/// A room with the board of the moment, as large as the camera's picture, or reduced by a factor.
pub(crate) fn picture(snapshot: &Snapshot, smaller: u32) -> GrayImage {
    let board = &snapshot.setup.board;
    let (columns, rows) = (board.columns(), board.rows());
    let size = snapshot.setup.image_size;
    let corners = snapshot.live.as_ref().and_then(|live| live.corners_px.as_ref().ok());
    let image_from_unit = corners.and_then(|corners| {
        let last = corners.len().checked_sub(1)?;
        square_to([corners[0], corners[columns - 1], corners[last], corners[last + 1 - columns]])
    });
    let unit_from_image = image_from_unit.and_then(Matrix3::try_inverse);
    GrayImage::from_fn(size.width_px / smaller, size.height_px / smaller, |x, y| {
        let (x, y) = (x * smaller, y * smaller);
        let room = 70 + 60 * x / size.width_px + 40 * ((x / 160 + y / 120) % 2);
        let seen = unit_from_image.and_then(|matrix| {
            let p = matrix * Vector3::new(f64::from(x), f64::from(y), 1.0);
            (p.z.abs() > 1e-9).then(|| (p.x / p.z, p.y / p.z))
        });
        let (across, down) = (columns as f64 - 1.0, rows as f64 - 1.0);
        let level = match seen.map(|(u, v)| (u * across, v * down)) {
            Some((u, v)) if within(u, across, 1.0) && within(v, down, 1.0) => {
                if (u.floor() + v.floor()).rem_euclid(2.0) < 0.5 { 35 } else { 215 }
            }
            Some((u, v)) if within(u, across, 2.0) && within(v, down, 2.0) => 215,
            _ => room as u8,
        };
        Luma([level])
    })
}

fn within(value: f64, most: f64, beyond: f64) -> bool {
    value > -beyond && value < most + beyond
}

pub(crate) fn moment_of(all: &[Moment], name: &str) -> Moment {
    let found = all.iter().find(|moment| moment.name.starts_with(name));
    let base = found.or_else(|| all.iter().find(|moment| moment.name == "searching"));
    let base = base.expect("a moment");
    let mut moment = Moment {
        name: name.into(),
        snapshot: base.snapshot.clone(),
        sentence: base.sentence.clone(),
        taken: base.taken,
    };
    if name == "other board" {
        moment.snapshot.shown.prompt =
            Prompt::OtherBoard(OtherBoard::Plain { columns: 7, rows: 5 });
    }
    moment
}

/// Painted page of a moment.
pub(crate) fn page_at(
    page: Page,
    moment: &Moment,
    (theme, scale): (Theme, f32),
    size: Vec2,
    distance: bool,
) -> Harness<'static, Table> {
    let mut shown = harness_at(page, moment, (theme, scale), size);
    let captured_at =
        moment.snapshot.live.as_ref().map_or(CaptureTime { nanos: 0 }, |live| live.captured_at);
    let frame = Frame {
        id: FrameId(2),
        captured_at,
        kind: FrameKind::Video,
        name: String::new(),
        image: picture(&moment.snapshot, 1),
    };
    let ctx = shown.ctx.clone();
    let screen = &mut shown.state_mut().screen;
    screen.picture.show_frame(&frame, 9.99);
    screen.source = "HD Webcam".into();
    screen.distance = distance;
    for view in moment.snapshot.views.iter() {
        screen.add_thumbnail(&ctx, view.number, &frame.image);
    }
    shown.run();
    shown
}

#[test]
fn the_matrix_of_pages_and_moments_is_painted() {
    let Some(folder) = std::env::var_os("BORESIGHT_MATRIX").map(PathBuf::from) else { return };
    let all = moments();
    std::fs::create_dir_all(&folder).expect("made");
    for (title, name) in MOMENTS {
        let moment = moment_of(&all, name);
        for (width, height, scale) in SIZES {
            for theme in [Theme::Dark, Theme::Light] {
                let size = Vec2::new(width, height);
                let pages = [
                    (Page::Guide, false),
                    (Page::Guide, true),
                    (Page::Result, false),
                    (Page::Replay, false),
                ];
                for (page, distance) in pages {
                    paint(&folder, (title, &moment), (page, distance), (theme, scale), size);
                }
                if ["first run", "no camera"].contains(&title) {
                    for page in [Page::Start, Page::Settings] {
                        paint(&folder, (title, &moment), (page, false), (theme, scale), size);
                    }
                }
            }
        }
    }
}

fn paint(
    folder: &Path,
    (title, moment): (&str, &Moment),
    (page, distance): (Page, bool),
    (theme, scale): (Theme, f32),
    size: Vec2,
) {
    let mut shown = page_at(page, moment, (theme, scale), size, distance);
    if title == "no camera" {
        shown.state_mut().choices.cameras.clear();
        shown.run();
    }
    let picture: RgbaImage = shown.render().expect("painted");
    let page = if distance { "distance".into() } else { format!("{page:?}").to_lowercase() };
    let theme = format!("{theme:?}").to_lowercase();
    let name = format!("{page}-{}-{}@{scale}-{theme}.png", title.replace(' ', "_"), size.x);
    picture.save(folder.join(name)).expect("saved");
}

/// Height of the parts lighter than the band in the first line of the sentence: capital letters and
/// ascenders.
fn letter_height_px(picture: &RgbaImage, band: egui::Rect) -> u32 {
    let is_letter = |x: u32, y: u32| picture.get_pixel(x, y).0[..3].iter().any(|l| *l > 150);
    // The sign is to the left of the words.
    let (left, right) = (band.left() + 0.3 * band.width(), band.right());
    let rows: Vec<bool> = (band.top() as u32..band.bottom() as u32)
        .map(|y| (left as u32..right as u32).any(|x| is_letter(x, y)))
        .collect();
    // The first line: down to the first empty row after it.
    let first = rows.iter().position(|row| *row).unwrap_or(0);
    rows[first..].iter().take_while(|row| **row).count() as u32
}

/// At 3 m from a laptop of 15.6 inches with 1920×1080 pixels.
#[test]
fn the_sentence_is_read_at_three_metres() {
    const PIXEL_M: f64 = 0.3454 / 1920.0;
    let all = moments();
    for name in ["holding", "searching", "refused: TooFar"] {
        let moment = moment_of(&all, name);
        let size = Vec2::new(1920.0, 1080.0);
        let mut shown = page_at(Page::Guide, &moment, (Theme::Dark, 1.0), size, true);
        let picture = shown.render().expect("painted");
        let node = shown.get_by_role(Role::Status);
        let (band, said) = (node.rect(), node.accesskit_node().label().unwrap_or_default());
        let high = letter_height_px(&picture, band);
        let minutes = (f64::from(high) * PIXEL_M / 3.0).to_degrees() * 60.0;
        println!("{said:?}: letters of {high} px, {minutes:.1} arc minutes at 3 m");
        assert!(minutes >= 16.0, "{said}: {minutes:.1}");
    }
}
