//! The card with the board: drawn, counted, printed, or shown on a screen.

use egui::{
    Button, Color32, ComboBox, DragValue, Painter, Rect, RichText, Sense, Stroke, StrokeKind, Ui,
    Vec2, WidgetInfo, accesskit::Role,
};

use super::{
    super::{keys::UiAction, theme},
    markers::{choice, kind},
    start_page::{Choices, StartPage},
};
use boresight_geometry::boards::{BOARD_KINDS, BoardChoice, DarkShapes, Shape};
use boresight_present::text::start as words;

/// Height of the drawing.
const HIGH: f32 = 144.0;

pub(super) fn show(ui: &mut Ui, page: &mut StartPage, choices: &Choices, asks: &mut Vec<UiAction>) {
    let (rect, response) =
        ui.allocate_exact_size(Vec2::new(ui.available_width(), HIGH), Sense::hover());
    draw(ui.painter(), rect, page.in_squares(), true);
    let what = words::board(page.choice());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &what));
    kind(ui, page);
    ui.label(&what);
    size(ui, page);
    ui.horizontal(|ui| {
        let [name, tip] = words::KINDS[page.draft.pattern.kind_index()].length;
        let name = ui.label(name).on_hover_text(tip);
        let square = DragValue::new(&mut page.draft.square_m)
            .range(0.0001..=9.9)
            .speed(0.0005)
            .custom_formatter(|length_m, _| words::square(length_m))
            .custom_parser(words::parsed_millimetres);
        let square = ui.add(square).labelled_by(name.id).on_hover_text(tip);
        page.knows_square |= square.changed();
    });
    if let Some(code) = page.code() {
        let said = words::named_board(&code.id, code.board.map(usize::from), code.square_m);
        let good = theme::palette(ui.visuals()).good;
        ui.label(RichText::new(said).strong().color(good));
    }
    choice(ui, page);
    ui.separator();
    ui.horizontal_wrapped(|ui| {
        let print = ui.add_enabled(page.board_trouble().is_none(), Button::new(words::PRINT));
        if print.on_hover_text(words::PRINT_TIP).clicked() {
            asks.push(UiAction::Print { board: page.in_squares(), paper: page.paper });
        }
        let name = choices.papers.get(page.paper).copied().unwrap_or_default();
        let list = ComboBox::from_id_salt("paper").selected_text(name).width(56.0);
        let list = list.show_ui(ui, |ui| {
            for (number, name) in choices.papers.iter().enumerate() {
                ui.selectable_value(&mut page.paper, number, *name);
            }
        });
        list.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, words::PAPER));
    });
    match &page.printed {
        Some(Ok(printed)) => {
            let link = ui.link(words::printed(&printed.file, printed.square_m));
            if link.clicked() {
                asks.push(UiAction::Show(printed.file.clone()));
            }
            for step in &printed.steps {
                ui.label(RichText::new(step).small());
            }
        }
        Some(Err(trouble)) => {
            ui.label(RichText::new(&trouble.what).color(theme::palette(ui.visuals()).bad));
            ui.label(trouble.action.as_deref().unwrap_or_default());
        }
        None => {}
    }
    let show = Button::new(words::SHOW).selected(page.shows_board);
    let show = ui.add_enabled(page.board_trouble().is_none(), show);
    if show.on_hover_text(words::SHOW_TIP).clicked() {
        page.shows_board ^= true;
    }
}

/// Number of corners of a plain board, of squares of a ChArUco board, of tags of an AprilGrid, or
/// of circles, as in other programs.
fn size(ui: &mut Ui, page: &mut StartPage) {
    let place = page.draft.pattern.kind_index();
    let (kind, [name, tip]) = (&BOARD_KINDS[place], words::KINDS[place].counts);
    let [least, most] = kind.counts;
    ui.horizontal(|ui| {
        ui.label(name).on_hover_text(tip);
        for (corners, side) in page.draft.board.iter_mut().zip(words::SIDES) {
            let mut count = (kind.counted)(*corners);
            let value = ui.add(DragValue::new(&mut count).range(least..=most));
            value.widget_info(|| WidgetInfo::labeled(Role::SpinButton, true, side));
            value.on_hover_text(format!("{side}. {tip}"));
            *corners = (kind.points)(count);
        }
    });
}

/// Draws the board as large as fits, with a white margin of a square. With `corners`, each inner
/// corner has a dot.
pub(super) fn draw(painter: &Painter, area: Rect, board: BoardChoice, corners: bool) {
    // In squares. The page reports impossible markers.
    let Some(board) = board.drawn(1.0) else { return };
    let [across, down] = board.target().size_m().map(|squares| squares as f32);
    let side = (area.width() / (across + 2.0)).min(area.height() / (down + 2.0));
    // Whole pixels make all squares alike.
    let per_point = painter.pixels_per_point();
    let side = ((side * per_point).floor() / per_point).max(1.0 / per_point);
    let sheet = Rect::from_center_size(area.center(), side * Vec2::new(across + 2.0, down + 2.0));
    let sheet = sheet
        .translate((sheet.min.to_vec2() * per_point).round() / per_point - sheet.min.to_vec2());
    painter.rect_filled(sheet, 0.0, Color32::WHITE);
    painter.rect_stroke(sheet, 0.0, Stroke::new(1.0, Color32::GRAY), StrokeKind::Outside);
    let first = sheet.min + Vec2::splat(side);
    let place = |[x, y]: [f64; 2]| {
        let at = first + side * (Vec2::new(x as f32, y as f32) + 0.5 * Vec2::new(across, down));
        // Whole pixels make cells sharp.
        ((at.to_vec2() * per_point).round() / per_point).to_pos2()
    };
    let DarkShapes { large, fine } = board.target().dark_shapes();
    for shape in large.into_iter().chain(fine) {
        match shape {
            Shape::Rectangle { low_m, high_m } => {
                let square = Rect::from_min_max(place(low_m), place(high_m));
                painter.rect_filled(square, 0.0, Color32::BLACK);
            }
            Shape::Disc { centre_m, radius_m } => {
                painter.circle_filled(place(centre_m), side * radius_m as f32, Color32::BLACK);
            }
        }
    }
    if !corners {
        return;
    }
    for point in board.corners_in_board_m() {
        let at = place(point.into());
        painter.circle_filled(at, (0.16 * side).clamp(1.0, 4.0), theme::AMBER);
    }
}
