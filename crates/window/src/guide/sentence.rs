//! Sentence in letters of constant size, with a sign of the movement.

use egui::{
    Align2, Color32, FontId, Id, Rect, Response, Sense, Ui, Vec2, WidgetInfo, accesskit::Role,
    pos2, text::LayoutJob,
};

use super::{
    super::{aloud, screen::Screen, theme},
    icon,
};
use boresight_guide::session::Gravity;
use boresight_present::{instruction::Instruction, text::window as words};

/// Size of the letters, the same for every sentence.
struct Size {
    /// Height of the band as a share of the window's.
    band: f32,
    /// Size of letters as a share of the band's height.
    letters: f32,
    /// Maximum size of letters as a share of the width of a line of the longest sentence.
    across: f32,
    /// Height of a line as a share of the letters' size.
    line: f32,
}

/// Size at the computer: one line.
const NEAR: Size = Size { band: 0.14, letters: 0.6, across: 1.0 / 17.5, line: 1.15 };
/// Size from afar: up to two lines, close to each other.
const FAR: Size = Size { band: 0.22, letters: 0.47, across: 1.0 / 9.5, line: 1.05 };

/// Side of the sign as a share of the band's height.
const SIGN: f32 = 0.8;

/// Sentence and colour.
fn words(instruction: Option<&Instruction>, mirrored: bool) -> (String, Color32) {
    instruction.map_or((words::STARTING.into(), theme::GREY), |instruction| {
        (instruction.sentence(mirrored), color(instruction.gravity()))
    })
}

fn color(gravity: Gravity) -> Color32 {
    match gravity {
        Gravity::Bad => theme::RED,
        Gravity::Good => theme::GREEN,
        Gravity::Careful => theme::AMBER,
        Gravity::Plain => Color32::WHITE,
    }
}

fn size(screen: &Screen) -> Size {
    if screen.distance { FAR } else { NEAR }
}

pub(super) fn height(ui: &Ui, screen: &Screen) -> f32 {
    (size(screen).band * ui.ctx().content_rect().height()).max(64.0)
}

/// Shows the sentence over the full width.
pub(super) fn show(ui: &mut Ui, screen: &Screen, instruction: Option<&Instruction>) -> Response {
    let mirrored = screen.preferences.mirrored;
    let (words, color) = words(instruction, mirrored);
    let width = ui.available_width();
    let Size { letters, across, line, .. } = size(screen);
    let high = height(ui, screen);
    let (_, rect) = ui.allocate_space(Vec2::new(width, high));
    // The same name under any banner: a screen reader reads the news.
    let response = ui.interact(rect, Id::unique("sentence"), Sense::hover());
    let painter = ui.painter_at(rect);
    theme::band(ui, rect);
    let sign = instruction.and_then(|instruction| instruction.movement(mirrored));
    let side = if sign.is_some() { SIGN * high } else { 0.0 };
    // One font size: resizing would draw the eye for nothing.
    let room = width - SIGN * high - 3.0 * theme::UNIT;
    let size = (letters * high).min(across * room).floor();
    let wrap = if screen.distance { room } else { f32::INFINITY };
    let laid_out = |size: f32, wrap: f32| {
        let mut job = LayoutJob::simple(words.clone(), FontId::proportional(size), color, wrap);
        for section in &mut job.sections {
            section.format.line_height = Some(line * size);
        }
        painter.layout_job(job)
    };
    let mut galley = laid_out(size, wrap);
    let fits = (room / galley.size().x).min(high / galley.size().y);
    if fits < 1.0 {
        // Longer than any sentence of a session.
        galley = laid_out((size * fits).floor().max(1.0), room);
    }
    let gap = if sign.is_some() { theme::UNIT } else { 0.0 };
    let both = Vec2::new(side + gap + galley.size().x, galley.size().y);
    let at = Align2::CENTER_CENTER.anchor_size(rect.center(), both);
    if let Some(sign) = sign {
        let middle = pos2(at.left() + 0.5 * side, rect.center().y);
        let place = Rect::from_center_size(middle, Vec2::splat(side));
        icon::paint(&painter, place.shrink(0.12 * side), sign, color);
    }
    painter.galley(pos2(at.left() + side + gap, at.top()), galley, color);
    response.widget_info(|| WidgetInfo::labeled(Role::Status, true, &words));
    aloud::read_now(&response);
    response
}
