//! Colours. Those on the picture suit bright and dark pictures; the rest follow the theme.

use std::sync::Arc;

use egui::{
    Color32, Context, FontData, FontDefinitions, FontFamily, FontId, Frame, Rect, Stroke,
    TextStyle, Theme, ThemePreference, Ui, Vec2, Visuals, ecolor::Hsva,
};

/// Good.
pub const GREEN: Color32 = Color32::from_rgb(61, 220, 151);
/// Approaching.
pub const AMBER: Color32 = Color32::from_rgb(255, 182, 39);
/// Wrong.
pub const RED: Color32 = Color32::from_rgb(255, 122, 107);
/// Inactive.
pub const GREY: Color32 = Color32::from_rgb(190, 190, 190);
/// Measured in the present frame.
pub const LIVE: Color32 = Color32::from_rgb(108, 184, 255);
/// Colour behind words about an error, on a picture.
pub const ALARM: Color32 = Color32::from_rgb(170, 28, 18);
/// Colour of the main button.
pub const ACCENT: Color32 = Color32::from_rgb(20, 120, 200);
/// Colour of words on [`ACCENT`].
pub const ON_ACCENT: Color32 = Color32::WHITE;
/// Size of letters in details.
pub const SMALL: f32 = 11.0;
/// Size of letters in text.
pub const BODY: f32 = 14.0;
/// Size of letters in headings.
pub const TITLE: f32 = 18.0;
/// Size of letters in the verdict.
pub const VERDICT: f32 = 24.0;
/// Unit of spacing.
pub const UNIT: f32 = 8.0;
/// Smallest window without cut-off contents. A smaller one is scaled down.
pub const SMALLEST: Vec2 = Vec2::new(1024.0, 640.0);
/// Largest window without scaling. A larger one is scaled up.
pub const LARGEST: Vec2 = Vec2::new(1920.0, 1200.0);
/// Colour behind the sentence and around the picture.
pub const BAND: Color32 = Color32::from_rgb(11, 14, 17);
/// Colour of the area covered by boards.
pub const COVERED: Color32 = Color32::from_rgba_premultiplied(8, 26, 12, 30);
/// Colour behind words on the picture.
pub const SHADE: Color32 = Color32::from_rgba_premultiplied(0, 0, 0, 170);

/// Colour of a line's direction: opposed views share it.
pub fn direction(slot_rad: f64) -> Color32 {
    let hue = (slot_rad / std::f64::consts::PI).rem_euclid(1.0);
    // From blue to pink: green, amber and red mean something.
    Hsva::new((0.55 + 0.4 * hue) as f32, 0.55, 1.0, 1.0).into()
}

/// Colour from amber to green as `share` goes from 0 to 1.
pub fn approach(share: f32) -> Color32 {
    AMBER.lerp_to_gamma(GREEN, share.clamp(0.0, 1.0))
}

/// A line visible on any picture: dark below, `color` above.
pub fn strokes(width: f32, color: Color32, opacity: f32) -> [Stroke; 2] {
    [
        Stroke::new(width + 2.0, Color32::from_black_alpha(140).gamma_multiply(opacity)),
        Stroke::new(width, color.gamma_multiply(opacity)),
    ]
}

/// A line in contrast to any picture, covering neighbours: black below, `color` above.
pub(super) fn outline(width: f32, color: Color32) -> [Stroke; 2] {
    [Stroke::new(width + 4.0, Color32::BLACK), Stroke::new(width, color)]
}

/// Colours of words on a page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Palette {
    pub(super) good: Color32,
    pub(super) care: Color32,
    pub(super) bad: Color32,
    pub(super) info: Color32,
}

const ON_DARK: Palette =
    Palette { good: GREEN, care: AMBER, bad: RED, info: Color32::from_rgb(170, 181, 191) };
const ON_LIGHT: Palette = Palette {
    good: Color32::from_rgb(0, 112, 74),
    care: Color32::from_rgb(143, 86, 0),
    bad: Color32::from_rgb(179, 38, 30),
    info: Color32::from_rgb(85, 85, 85),
};
/// Colours for a screen in sunlight.
const IN_SUNLIGHT: Palette = Palette {
    good: Color32::from_rgb(0, 65, 20),
    care: Color32::from_rgb(90, 45, 0),
    bad: Color32::from_rgb(130, 0, 0),
    info: Color32::BLACK,
};

pub(super) fn palette(visuals: &Visuals) -> Palette {
    match (visuals.dark_mode, is_sunlit(visuals)) {
        (true, _) => ON_DARK,
        (false, false) => ON_LIGHT,
        (false, true) => IN_SUNLIGHT,
    }
}

/// Rims of fields, radio buttons, switches and buttons, dark and light: 3 : 1 to every surface. In
/// place of the toolkit's, which have none.
const RIM: [Color32; 2] = [Color32::from_rgb(119, 131, 142), Color32::from_rgb(111, 123, 134)];

/// Clear colour of the window and ground of all panelswithout a ground of their own: painting a
/// pixel twice costs twice, most of all without a graphics card.
pub fn ground(visuals: &Visuals) -> Color32 {
    match (visuals.dark_mode, is_sunlit(visuals)) {
        (true, _) => BAND,
        (false, false) => Color32::from_rgb(245, 246, 248),
        (false, true) => Color32::WHITE,
    }
}

/// Ground as RGBA from 0 to 1.
pub fn background(visuals: &Visuals) -> [f32; 4] {
    ground(visuals).to_normalized_gamma_f32()
}

/// Makes `rect` a part of the band behind the sentence and around the picture.
pub fn band(ui: &Ui, rect: Rect) {
    if ground(ui.visuals()) != BAND {
        ui.painter().rect_filled(rect, 0.0, BAND);
    }
}

fn is_sunlit(visuals: &Visuals) -> bool {
    !visuals.dark_mode && visuals.window_fill == Color32::WHITE
}

/// Letters of headlines and of the one number of a result.
pub(super) fn headline(size: f32) -> FontId {
    FontId::new(size, FontFamily::Name(HEADLINE.into()))
}

/// Name of the family of [`headline`].
const HEADLINE: &str = "headline";

/// Inter before the toolkit's fonts, which hold the signs that Inter's Latin part lacks.
fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::default();
    let text = FontData::from_static(include_bytes!("../fonts/Inter-Regular.otf"));
    let display = FontData::from_static(include_bytes!("../fonts/InterDisplay-SemiBold.otf"));
    let others = fonts.families.get(&FontFamily::Proportional).cloned().unwrap_or_default();
    for (family, name, data) in [
        (FontFamily::Proportional, "Inter", text),
        (FontFamily::Name(HEADLINE.into()), "Inter Display", display),
    ] {
        fonts.font_data.insert(name.into(), Arc::new(data));
        let all = std::iter::once(name.to_owned()).chain(others.iter().cloned()).collect();
        fonts.families.insert(family, all);
    }
    fonts
}

/// Sets the differences from the toolkit's style: fonts, larger words of four sizes, one unit of
/// spacing, calmer surfaces.
pub fn apply(ctx: &Context) {
    ctx.set_fonts(fonts());
    for theme in [Theme::Dark, Theme::Light] {
        ctx.style_mut_of(theme, |style| {
            let dark = theme == Theme::Dark;
            style.visuals = theme.default_visuals();
            let visuals = &mut style.visuals;
            let words = Color32::from_gray(if dark { 225 } else { 20 });
            visuals.widgets.noninteractive.fg_stroke.color = words;
            visuals.widgets.inactive.fg_stroke.color = words;
            visuals.weak_text_alpha = 0.8;
            visuals.disabled_alpha = 0.7;
            visuals.hyperlink_color = if dark { LIVE } else { Color32::from_rgb(11, 92, 173) };
            visuals.panel_fill = Color32::TRANSPARENT;
            visuals.faint_bg_color = Color32::from_gray(if dark { 34 } else { 255 });
            // A field is seen on a card, too.
            visuals.extreme_bg_color = Color32::from_gray(if dark { 10 } else { 232 });
            visuals.widgets.noninteractive.bg_stroke.color =
                Color32::from_gray(if dark { 52 } else { 208 });
            // Fields, switches and buttons are told from their ground by their rims.
            visuals.widgets.inactive.bg_stroke =
                Stroke::new(1.0, if dark { RIM[0] } else { RIM[1] });
            for (style_name, size) in [
                (TextStyle::Small, SMALL),
                (TextStyle::Body, BODY),
                (TextStyle::Button, BODY),
                (TextStyle::Heading, TITLE),
            ] {
                style.text_styles.insert(style_name, FontId::proportional(size));
            }
            style.spacing.item_spacing = Vec2::new(UNIT, 0.5 * UNIT);
        });
    }
}

/// Shows everything smaller in a too small window, as on a laptop with doubled pixels, and larger
/// in a very large window, as on a screen of 3840×2160 undoubled pixels. `fitted` is the scale on
/// top of the person's choice, 1 at first.
pub(super) fn fit(ctx: &Context, fitted: &mut f32) {
    let zoom = ctx.zoom_factor();
    let size = ctx.content_rect().size() * zoom;
    let times = |other: Vec2| (size / other).min_elem();
    let scale = times(SMALLEST).min(1.0).max(times(LARGEST));
    if (scale - *fitted).abs() > 1e-3 {
        ctx.set_zoom_factor(zoom / *fitted * scale);
        *fitted = scale;
    }
}

/// Names of the palettes, as remembered.
const NAMES: [&str; 3] = ["dark", "light", "sunlight"];

/// Name of the palette in use.
pub(super) fn name(ctx: &Context) -> &'static str {
    let visuals = &ctx.style_of(ctx.theme()).visuals;
    let [dark, light, sunlight] = NAMES;
    match (visuals.dark_mode, is_sunlit(visuals)) {
        (true, _) => dark,
        (false, false) => light,
        (false, true) => sunlight,
    }
}

/// Uses the named palette; any other name leaves the choice to the system.
pub(super) fn choose(ctx: &Context, name: &str) {
    if NAMES.contains(&name) {
        for _ in NAMES {
            if self::name(ctx) != name {
                switch(ctx);
            }
        }
    }
}

/// The next of dark, light and sunlight.
pub(super) fn switch(ctx: &Context) {
    let visuals = ctx.style_of(ctx.theme()).visuals.clone();
    let sunlit = is_sunlit(&visuals);
    apply(ctx);
    if visuals.dark_mode {
        ctx.set_theme(ThemePreference::Light);
    } else if sunlit {
        ctx.set_theme(ThemePreference::Dark);
    } else {
        ctx.style_mut_of(Theme::Light, |style| sunlight(&mut style.visuals));
    }
}

/// Black on white, to read in sunlight.
fn sunlight(visuals: &mut Visuals) {
    visuals.window_fill = Color32::WHITE;
    visuals.faint_bg_color = Color32::WHITE;
    visuals.override_text_color = Some(Color32::BLACK);
    visuals.weak_text_alpha = 1.0;
    visuals.widgets.noninteractive.bg_stroke.color = Color32::BLACK;
}

/// A surface to group related items.
pub fn card(visuals: &Visuals) -> Frame {
    Frame::new()
        .fill(visuals.faint_bg_color)
        .stroke(visuals.widgets.noninteractive.bg_stroke)
        .corner_radius(UNIT)
        .inner_margin(1.5 * UNIT)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of an opaque colour, WCAG 2.1.
    fn luminance(color: Color32) -> f64 {
        let linear = |level: u8| {
            let share = f64::from(level) / 255.0;
            if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(color.r()) + 0.7152 * linear(color.g()) + 0.0722 * linear(color.b())
    }

    fn contrast(a: Color32, b: Color32) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn an_outline_contrasts_with_any_picture() {
        let approaching = (0..=20).map(|i| approach(i as f32 / 20.0));
        for color in approaching.chain([Color32::WHITE, GREEN]) {
            let [below, above] = outline(3.0, color);
            assert_eq!((below.color.a(), above.color.a()), (255, 255), "nothing shines through");
            for level in 0..=255 {
                let picture = Color32::from_gray(level);
                let best = contrast(above.color, picture).max(contrast(below.color, picture));
                assert!(best >= 3.0, "{color:?} on {level}: {best}");
            }
        }
    }

    #[test]
    fn a_verdict_is_read_in_every_palette() {
        let ctx = Context::default();
        apply(&ctx);
        let dark = ctx.style_of(Theme::Dark).visuals.clone();
        let light = ctx.style_of(Theme::Light).visuals.clone();
        let mut sunlit = light.clone();
        sunlight(&mut sunlit);
        let mut palettes = Vec::new();
        for visuals in [dark, light, sunlit] {
            let Palette { good, care, bad, info } = palette(&visuals);
            for color in [good, care, bad, info] {
                for behind in [ground(&visuals), visuals.faint_bg_color] {
                    assert!(contrast(color, behind) >= 4.5, "{color:?} on {behind:?}");
                }
            }
            palettes.push(palette(&visuals));
        }
        assert!(palettes[0] != palettes[1] && palettes[1] != palettes[2]);
    }

    #[test]
    fn a_control_is_told_from_every_surface() {
        let ctx = Context::default();
        apply(&ctx);
        for theme in [Theme::Dark, Theme::Light] {
            let visuals = ctx.style_of(theme).visuals.clone();
            let rim = visuals.widgets.inactive.bg_stroke;
            for behind in [ground(&visuals), visuals.faint_bg_color, visuals.extreme_bg_color] {
                let found = contrast(rim.color, behind);
                assert!(rim.width >= 1.0 && found >= 3.0, "{theme:?} on {behind:?}: {found}");
            }
        }
    }

    #[test]
    fn links_and_buttons_that_cannot_be_pressed_are_read_in_both_themes() {
        let ctx = Context::default();
        apply(&ctx);
        let mut lowest = [f64::INFINITY; 2];
        let mut note = |index: usize, found: f64| lowest[index] = found.min(lowest[index]);
        for theme in [Theme::Dark, Theme::Light] {
            let visuals = ctx.style_of(theme).visuals.clone();
            let faded = |color: Color32, behind: Color32| {
                behind.lerp_to_gamma(color, visuals.disabled_alpha)
            };
            for behind in [ground(&visuals), visuals.faint_bg_color] {
                note(0, contrast(visuals.hyperlink_color, behind));
                for widget in [visuals.widgets.inactive, visuals.widgets.noninteractive] {
                    let fill = faded(widget.weak_bg_fill, behind);
                    note(1, contrast(faded(widget.fg_stroke.color, fill), fill));
                }
            }
            // The start page's main button.
            let fill = faded(Color32::WHITE, BAND);
            note(1, contrast(faded(BAND, fill), fill));
        }
        println!("links {:.2}, disabled {:.2}", lowest[0], lowest[1]);
        assert!(lowest.iter().all(|lowest| *lowest >= 4.5), "{lowest:?}");
    }

    #[test]
    fn a_palette_is_found_again_by_its_name() {
        let ctx = Context::default();
        apply(&ctx);
        for wanted in NAMES.into_iter().chain(NAMES.into_iter().rev()) {
            choose(&ctx, wanted);
            assert_eq!(name(&ctx), wanted);
        }
        choose(&ctx, "plaid");
        assert_eq!(name(&ctx), "dark", "the one before stays");
    }

    #[test]
    fn the_sentence_contrasts_with_its_band() {
        assert!(contrast(Color32::WHITE, ALARM) >= 4.5 && contrast(ON_ACCENT, ACCENT) >= 4.5);
        for color in [GREEN, AMBER, RED, GREY, Color32::WHITE] {
            assert!(contrast(color, BAND) >= 4.5, "{color:?}: {}", contrast(color, BAND));
        }
    }
}
