//! Markers of a ChArUco board, chosen and drawn.

use egui::{Color32, ComboBox, DragValue, Painter, Pos2, Rect, RichText, Ui};

use super::{
    super::{keys::UiAction, theme},
    start_page::StartPage,
};
use boresight_geometry::markers::{Dictionary, Layout, MarkerChoice, Markers};
use boresight_present::text::{explore, start as words};

/// Choice of the kind of board.
pub(super) fn kind(ui: &mut Ui, page: &mut StartPage) {
    let is_marked = page.draft.markers.is_some();
    ui.horizontal_wrapped(|ui| {
        for (marked, (name, tip)) in [false, true].into_iter().zip(words::KINDS) {
            if ui.radio(is_marked == marked, name).on_hover_text(tip).clicked() {
                page.choose_kind(marked);
            }
        }
    });
}

/// Dictionary and size of the markers of a ChArUco board.
pub(super) fn choice(ui: &mut Ui, page: &mut StartPage) {
    let Some(mut chosen) = page.draft.markers else { return };
    ui.horizontal(|ui| {
        let name = ui.label(words::DICTIONARY).on_hover_text(words::DICTIONARY_TIP);
        let list = ComboBox::from_id_salt("dictionary")
            .selected_text(words::dictionary(chosen.dictionary))
            .truncate()
            .width(ui.available_width());
        let list = list.show_ui(ui, |ui| {
            for dictionary in Dictionary::all() {
                let label = words::dictionary(dictionary);
                ui.selectable_value(&mut chosen.dictionary, dictionary, label);
            }
        });
        list.response.labelled_by(name.id).on_hover_text(words::DICTIONARY_TIP);
    });
    ui.horizontal(|ui| {
        let name = ui.label(words::MARKER).on_hover_text(words::MARKER_TIP);
        let usual_m = usual_side_m(chosen, page.draft.square_m);
        let mut side_m = chosen.side_m.unwrap_or(usual_m);
        let field = DragValue::new(&mut side_m)
            .range(0.0001..=9.9)
            .speed(0.0005)
            .custom_formatter(|length_m, _| words::square(length_m))
            .custom_parser(explore::parsed_millimetres);
        let response = ui.add(field).labelled_by(name.id).on_hover_text(words::MARKER_TIP);
        if response.changed() {
            // The usual size stays usual if the square changes.
            chosen.side_m = Some(side_m).filter(|side_m| (side_m - usual_m).abs() > 1e-6);
        }
    });
    page.draft.markers = Some(chosen);
    if let Some(trouble) = page.board_trouble() {
        let (what, action) = words::impossible(&trouble, page.draft.square_m);
        ui.label(RichText::new(what).color(theme::palette(ui.visuals()).bad));
        ui.label(action);
    }
}

fn usual_side_m(chosen: MarkerChoice, square_m: f64) -> f64 {
    square_m * MarkerChoice { side_m: None, ..chosen }.in_squares_of(square_m).side_squares
}

/// The action that prints the chosen board.
pub(super) fn print(page: &StartPage) -> UiAction {
    let draft = &page.draft;
    let markers = draft.markers.map(|chosen| chosen.in_squares_of(draft.square_m));
    UiAction::Print { board: draft.board, markers, paper: page.paper }
}

/// Draws the markers of a board of `columns` × `rows` inner corners whose top-left square begins at `first` and has sides
/// of `side` points.
pub(super) fn draw(
    painter: &Painter,
    (first, side): (Pos2, f32),
    [columns, rows]: [u16; 2],
    markers: Markers,
) {
    let squares = [usize::from(columns) + 1, usize::from(rows) + 1];
    let cells = markers.dictionary.side_cells() + 2;
    let gap = markers.gap_squares() as f32;
    let cell_squares = markers.side_squares as f32 / cells as f32;
    // Whole pixels, so that cells are sharp.
    let per_point = painter.pixels_per_point();
    let edge = |start: f32, square: usize, cell: usize| {
        let at = start + side * (square as f32 + gap + cell_squares * cell as f32);
        (at * per_point).round() / per_point
    };
    let area = |[column, row]: [usize; 2], from: [usize; 2], to: [usize; 2]| {
        let corner =
            |at: [usize; 2]| Pos2::new(edge(first.x, column, at[0]), edge(first.y, row, at[1]));
        Rect::from_min_max(corner(from), corner(to))
    };
    let places =
        |[across, down]: [usize; 2]| (0..down).flat_map(move |y| (0..across).map(move |x| [x, y]));
    for square in places(squares) {
        let Some(number) = Layout::Present.marker_at(square, squares) else { continue };
        // Without enough markers in the dictionary, draw none: the page says so.
        if markers.dictionary.code(number).is_none() {
            continue;
        }
        painter.rect_filled(area(square, [0, 0], [cells, cells]), 0.0, Color32::BLACK);
        for [x, y] in places([cells, cells]) {
            if markers.dictionary.is_black(number, [x, y]) == Some(false) {
                let cell = area(square, [x, y], [x + 1, y + 1]);
                painter.rect_filled(cell, 0.0, Color32::WHITE);
            }
        }
    }
}
