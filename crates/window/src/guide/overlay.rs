//! Drawing over the live picture. Comes from an older frame than the picture and fades with age.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2};
use nalgebra::{Matrix2, Point2, SymmetricEigen, Vector2};

use super::{
    super::{picture::Placed, screen::Screen, theme},
    ghost,
};
use boresight_geometry::{
    BoardOutline, Camera, GRID_COLUMNS, GRID_ROWS, PrincipalLine, cell_centres_px,
};
use boresight_guide::session::Snapshot;
use boresight_present::{
    instruction::{Instruction, Moment},
    text::{self, Trouble},
};

/// Age up to which the drawing counts as the picture's own.
const FRESH_SECS: f64 = 0.12;
/// Age of an almost invisible drawing.
const OLD_SECS: f64 = 0.7;
/// Duration of the flash after a view, in seconds.
pub(crate) const FLASH_SECS: f64 = 0.45;

/// Draws everything on the picture: the instruction, and optional marks for engineers.
pub(super) fn paint(
    painter: &Painter,
    placed: &Placed,
    screen: &Screen,
    (instruction, doubts): (Option<&Instruction>, &[Trouble]),
) {
    let (Some(snapshot), Some(instruction)) = (&screen.snapshot, instruction) else { return };
    let marks = screen.preferences.lines && instruction.moment != Moment::Taken;
    if marks {
        coverage(painter, placed, snapshot);
        views(painter, placed, snapshot);
    }
    ghost::paint(painter, placed, instruction);
    if marks {
        live(painter, placed, snapshot, opacity(screen.overlay_age_secs()));
        principal_point(painter, placed, snapshot);
    }
    let mut at = placed.rect.left_top() + Vec2::splat(1.5 * theme::UNIT);
    let size = (0.028 * placed.rect.height()).max(theme::BODY);
    for told in said_of_pictures(screen, doubts) {
        shaded_text(painter, at, Align2::LEFT_TOP, told, size);
        at.y += 1.8 * size;
    }
    if let Some(since) = screen.since_taken_secs().filter(|since| *since < FLASH_SECS) {
        let strength = (1.0 - since / FLASH_SECS) as f32;
        painter.rect_filled(placed.rect, 0.0, Color32::WHITE.gamma_multiply(0.75 * strength));
        painter.rect_stroke(
            placed.rect.shrink(6.0),
            0.0,
            Stroke::new(12.0, theme::GREEN.gamma_multiply(strength)),
            egui::StrokeKind::Middle,
        );
    }
}

/// Hints on the next action, above the sentence `said`.
pub(super) fn hints_above(
    painter: &Painter,
    said: Rect,
    screen: &Screen,
    instruction: Option<&Instruction>,
) {
    let Some(instruction) = instruction else { return };
    let size = (0.28 * said.height()).clamp(theme::BODY, 28.0);
    let mut at = said.left_top() - Vec2::new(0.0, theme::UNIT);
    for told in hints(screen, instruction) {
        shaded_text(painter, at, Align2::LEFT_BOTTOM, told, size);
        at.y -= 1.8 * size;
    }
}

/// Words on the picture, for a screen reader.
pub(super) fn told(screen: &Screen, instruction: &Instruction, doubts: &[Trouble]) -> String {
    let views = screen.snapshot.as_ref().map(text::window::views);
    let lines = said_of_pictures(screen, doubts).into_iter().chain(hints(screen, instruction));
    let lines = lines.chain(views.as_deref());
    lines.map(|line| format!("{}.", line.trim_end_matches('.'))).collect::<Vec<_>>().join(" ")
}

/// Future findings on the pictures, independent of the board.
fn said_of_pictures<'a>(screen: &Screen, doubts: &'a [Trouble]) -> Vec<&'a str> {
    let simulated = text::is_simulated(&screen.source);
    let simulated = simulated.then_some(text::window::SIMULATED_CAMERA);
    simulated.into_iter().chain(doubts.iter().map(|doubt| doubt.what.as_str())).collect()
}

/// Hints on the next action, from the lower edge up.
fn hints<'a>(screen: &'a Screen, instruction: &Instruction) -> Vec<&'a str> {
    let has_card = instruction.card.is_some();
    let hint = (has_card && screen.preferences.hint).then_some(text::window::HINT);
    let is_new = screen.snapshot.as_ref().is_some_and(|snapshot| snapshot.views.is_empty());
    let note = screen.opening_note.as_deref().filter(|_| has_card && is_new);
    // From afar, no button tells how to continue.
    let rests = screen.distance && instruction.moment == Moment::Rest;
    hint.into_iter().chain(note).chain(rests.then_some(text::window::RESUME)).collect()
}

/// Opacity of a drawing by age, 0.15 to 1.
fn opacity(age_secs: Option<f64>) -> f32 {
    let age_secs = age_secs.unwrap_or(0.0);
    (1.0 - (age_secs - FRESH_SECS) / (OLD_SECS - FRESH_SECS)).clamp(0.15, 1.0) as f32
}

/// Area of the picture covered by boards.
fn coverage(painter: &Painter, placed: &Placed, snapshot: &Snapshot) {
    let size = snapshot.setup.image_size;
    let outlines: Vec<BoardOutline> =
        snapshot.views.iter().filter_map(|view| view.outline).collect();
    let half_px = Vector2::new(
        0.5 * f64::from(size.width_px) / f64::from(GRID_COLUMNS),
        0.5 * f64::from(size.height_px) / f64::from(GRID_ROWS),
    );
    for centre_px in cell_centres_px(size) {
        if outlines.iter().any(|outline| outline.covers(&centre_px)) {
            let corners = [centre_px - half_px, centre_px + half_px].map(|px| placed.pos(&px));
            let cell = Rect::from_two_pos(corners[0], corners[1]);
            painter.rect_filled(cell, 0.0, theme::COVERED);
        }
    }
}

/// Principal lines of the accepted views: thin, one colour per direction.
fn views(painter: &Painter, placed: &Placed, snapshot: &Snapshot) {
    for view in snapshot.views.iter() {
        let line = line_on_screen(placed, snapshot, &view.line);
        for stroke in theme::strokes(1.5, theme::direction(view.tilt_azimuth_rad), 0.8) {
            painter.add(Shape::line(line.clone(), stroke));
        }
    }
}

/// Corners and bold line of the present frame.
fn live(painter: &Painter, placed: &Placed, snapshot: &Snapshot, opacity: f32) {
    let Some(live) = &snapshot.live else { return };
    let Ok(corners_px) = &live.corners_px else { return };
    let radius = (0.0025 * placed.rect.width()).clamp(2.0, 5.0);
    let seen = corners_px.iter().enumerate().filter(|(i, _)| !live.unseen.contains(i));
    for (_, px) in seen {
        let at = placed.pos(px);
        painter.circle_filled(
            at,
            radius + 1.0,
            Color32::from_black_alpha(110).gamma_multiply(opacity),
        );
        painter.circle_filled(at, radius, theme::LIVE.gamma_multiply(opacity));
    }
    if let Some(measured) = &live.measured {
        let line = line_on_screen(placed, snapshot, &measured.line);
        for stroke in theme::strokes(4.0, theme::LIVE, opacity) {
            painter.add(Shape::line(line.clone(), stroke));
        }
    }
}

/// Centre of the sensor, and the principal point with an ellipse of two standard deviations.
fn principal_point(painter: &Painter, placed: &Placed, snapshot: &Snapshot) {
    let centre = placed.pos(&snapshot.setup.image_size.centre_px());
    cross(painter, centre, 7.0, theme::GREY);
    let Some(covariance) = &snapshot.pp_covariance_px2 else { return };
    let outline: Vec<Pos2> =
        ellipse_px(&snapshot.pp_px, covariance, 2.0).iter().map(|px| placed.pos(px)).collect();
    for stroke in theme::strokes(2.0, theme::AMBER, 1.0) {
        painter.add(Shape::closed_line(outline.clone(), stroke));
    }
    cross(painter, placed.pos(&snapshot.pp_px), 10.0, theme::AMBER);
}

fn cross(painter: &Painter, at: Pos2, arm: f32, color: Color32) {
    for stroke in theme::strokes(1.5, color, 1.0) {
        painter.line_segment([at - Vec2::new(arm, 0.0), at + Vec2::new(arm, 0.0)], stroke);
        painter.line_segment([at - Vec2::new(0.0, arm), at + Vec2::new(0.0, arm)], stroke);
    }
}

/// Line as imaged by the lens: straight lines of the ideal picture are bent in the real one.
fn line_on_screen(placed: &Placed, snapshot: &Snapshot, line: &PrincipalLine) -> Vec<Pos2> {
    let size = snapshot.setup.image_size;
    let reach_px = f64::from(size.width_px) + f64::from(size.height_px);
    let foot = line.origin_px + line.normal() * line.c_px;
    (-40..=40)
        .map(|i| foot + line.direction() * (reach_px * f64::from(i) / 60.0))
        .filter_map(|px| through_lens(&snapshot.lens, &px))
        .map(|px| placed.pos(&px))
        .collect()
}

/// Pixel of the distorted picture for an undistorted pixel. `None` far outside, where lens models
/// fold back.
fn through_lens(lens: &Camera, px: &Point2<f64>) -> Option<Point2<f64>> {
    let ideal = Point2::from((px - lens.pp_px).component_div(&lens.f_px));
    let seen = lens.px_from_normalized(&ideal);
    let back = lens.undistort_px(&seen)?;
    ((back - px).norm() < 1.0).then_some(seen)
}

/// Points on the ellipse of `sigmas` standard deviations.
pub(in super::super) fn ellipse_px(
    centre: &Point2<f64>,
    covariance_px2: &Matrix2<f64>,
    sigmas: f64,
) -> Vec<Point2<f64>> {
    let eigen = SymmetricEigen::new(*covariance_px2);
    let axes = [0, 1]
        .map(|i| eigen.eigenvectors.column(i) * (sigmas * eigen.eigenvalues[i].max(0.0).sqrt()));
    (0..48)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 48.0).sin_cos();
            centre + axes[0] * cos + axes[1] * sin
        })
        .collect()
}

/// Words on the picture.
pub fn shaded_text(painter: &Painter, at: Pos2, align: Align2, words: &str, size: f32) {
    let galley = painter.layout_no_wrap(words.into(), FontId::proportional(size), Color32::WHITE);
    let rect = align.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand2(Vec2::new(5.0, 2.0)), 3.0, theme::SHADE);
    painter.galley(pos2(rect.min.x, rect.min.y), galley, Color32::WHITE);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_reaches_as_far_as_its_standard_deviations() {
        let covariance = Matrix2::new(4.0, 0.0, 0.0, 9.0);
        let points = ellipse_px(&Point2::new(10.0, 20.0), &covariance, 2.0);
        let reach = |get: fn(&Point2<f64>) -> f64| {
            points.iter().map(get).fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)))
        };
        let (left, right) = reach(|p| p.x);
        let (top, bottom) = reach(|p| p.y);
        assert!((right - left - 8.0).abs() < 0.1, "{left} {right}");
        assert!((bottom - top - 12.0).abs() < 0.1, "{top} {bottom}");
    }

    #[test]
    fn what_is_old_is_faint() {
        assert!((opacity(Some(0.05)) - 1.0).abs() < 1e-6);
        assert!(opacity(Some(0.4)) < 0.7);
        assert!((opacity(Some(5.0)) - 0.15).abs() < 1e-6);
    }
}
