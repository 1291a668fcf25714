//! Colours. Those on the picture hold on bright and dark pictures; the rest follow the theme.

use egui::{Color32, Context, Stroke, Theme, Visuals, ecolor::Hsva};

/// What is right.
pub(super) const GREEN: Color32 = Color32::from_rgb(60, 210, 90);
/// What is on its way.
pub(super) const AMBER: Color32 = Color32::from_rgb(255, 180, 30);
/// What is wrong.
pub(super) const RED: Color32 = Color32::from_rgb(240, 80, 60);
/// What is only there.
pub(super) const GREY: Color32 = Color32::from_rgb(190, 190, 190);
/// What was measured in this frame.
pub(super) const LIVE: Color32 = Color32::from_rgb(70, 200, 255);
/// Behind words on the picture.
pub(super) const SHADE: Color32 = Color32::from_rgba_premultiplied(0, 0, 0, 170);

/// One colour per direction of a line: opposed views share it.
pub(super) fn direction(slot_rad: f64) -> Color32 {
    let hue = (slot_rad / std::f64::consts::PI).rem_euclid(1.0);
    // From blue to pink: green, amber and red mean something.
    Hsva::new((0.55 + 0.4 * hue) as f32, 0.55, 1.0, 1.0).into()
}

/// From grey over amber to green as `share` goes from 0 to 1.
pub(super) fn approach(share: f32) -> Color32 {
    let share = share.clamp(0.0, 1.0);
    if share < 0.5 {
        GREY.lerp_to_gamma(AMBER, 2.0 * share)
    } else {
        AMBER.lerp_to_gamma(GREEN, 2.0 * share - 1.0)
    }
}

/// A line that is seen on any picture: dark below, `color` above.
pub(super) fn strokes(width: f32, color: Color32, opacity: f32) -> [Stroke; 2] {
    [
        Stroke::new(width + 2.0, Color32::from_black_alpha(140).gamma_multiply(opacity)),
        Stroke::new(width, color.gamma_multiply(opacity)),
    ]
}

/// What is seen where no panel stands.
pub(super) fn background(visuals: &Visuals) -> [f32; 4] {
    visuals.panel_fill.to_normalized_gamma_f32()
}

/// Sets what differs from the toolkit's own style: words that are read from farther away.
pub fn apply(ctx: &Context) {
    for (theme, words) in [(Theme::Dark, 215), (Theme::Light, 25)] {
        ctx.style_mut_of(theme, |style| {
            style.visuals.widgets.noninteractive.fg_stroke.color = Color32::from_gray(words);
            style.visuals.weak_text_alpha = 0.75;
        });
    }
}
