//! The sentence over the picture, in letters of constant size, with a sign of the movement.

use egui::{
    Color32, Id, Rect, Sense, Ui, Vec2, WidgetInfo, accesskit::Role, pos2, text::LayoutJob,
};

use super::{
    super::{aloud, screen::Screen, theme},
    icon,
};
use boresight_guide::session::Gravity;
use boresight_present::{
    instruction::{Instruction, Movement},
    text::window as words,
};

/// Size of letters as a share of the page's height, and of a line's width.
const LETTERS: [f32; 2] = [1.0 / 9.0, 1.0 / 16.0];
/// Distance of the sentence from the page's edges, as a share of the page's height.
const MARGIN: f32 = 0.05;
/// Height of a line as a share of the letters' size.
const LINE: f32 = 1.1;
/// Side of the sign as a share of the letters' size.
const SIGN: f32 = 1.25;
/// Gap between the sign and the words as a share of the letters' size.
const GAP: f32 = 0.3;

/// Sentence and colour.
fn words(instruction: Option<&Instruction>, mirrored: bool) -> (String, Color32) {
    instruction.map_or((words::STARTING.into(), theme::GREY), |instruction| {
        (instruction.sentence(mirrored), color(instruction.gravity()))
    })
}

pub(crate) fn color(gravity: Gravity) -> Color32 {
    match gravity {
        Gravity::Bad => theme::RED,
        Gravity::Good => theme::GREEN,
        Gravity::Careful => theme::AMBER,
        Gravity::Plain => Color32::WHITE,
    }
}

/// Shows the sentence in the lower left of `page`. Returns its rectangle.
pub(super) fn show(
    ui: &Ui,
    page: Rect,
    screen: &Screen,
    instruction: Option<&Instruction>,
) -> Rect {
    let mirrored = screen.preferences.mirrored;
    let sign = instruction.and_then(|instruction| instruction.movement(mirrored));
    say(ui, page, (&words(instruction, mirrored), sign), 1.0)
}

/// Shows words with a colour and a sign in the lower left of `page`, in letters `scale` times as
/// large as usual. Returns their rectangle.
pub(crate) fn say(
    ui: &Ui,
    page: Rect,
    ((words, color), sign): (&(String, Color32), Option<Movement>),
    scale: f32,
) -> Rect {
    let (words, color) = (words, *color);
    let margin = MARGIN * page.height();
    // One font size: resizing would draw the eye for nothing. A long sentence has two lines.
    let room = page.width() - 2.0 * margin;
    let size = (scale * (LETTERS[0] * page.height()).min(LETTERS[1] * room)).floor();
    let side = if sign.is_some() { (SIGN + GAP) * size } else { 0.0 };
    let font = theme::headline(size);
    let mut job = LayoutJob::simple(words.clone(), font, color, room - side);
    for section in &mut job.sections {
        section.format.line_height = Some(LINE * size);
    }
    let galley = ui.painter().layout_job(job);
    let text = Vec2::new(side + galley.size().x, galley.size().y);
    let rect = Rect::from_min_size(page.left_bottom() + Vec2::new(margin, -margin - text.y), text);
    // The same name under any banner: a screen reader reads the news.
    let response = ui.interact(rect, Id::unique("sentence"), Sense::hover());
    if let Some(sign) = sign {
        let middle = pos2(rect.left() + 0.5 * SIGN * size, rect.center().y);
        let place = Rect::from_center_size(middle, Vec2::splat(SIGN * size)).shrink(0.15 * size);
        icon::paint(ui.painter(), place, sign, color);
    }
    ui.painter().galley(rect.min + Vec2::new(side, 0.0), galley, color);
    response.widget_info(|| WidgetInfo::labeled(Role::Status, true, words));
    aloud::read_now(&response);
    rect
}
