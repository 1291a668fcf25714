//! Extra choices of a ChArUco board and an AprilGrid: markers or tags.

use egui::{ComboBox, DragValue, RichText, Ui};

use super::{
    super::{keys::UiAction, theme},
    start_page::StartPage,
};
use boresight_geometry::markers::{Dictionary, InvalidMarkers, MarkerChoice, Tags};
use boresight_present::text::start as words;

/// Choice of the kind of board.
pub(super) fn kind(ui: &mut Ui, page: &mut StartPage) {
    ui.horizontal_wrapped(|ui| {
        for (kind, (name, tip)) in words::KINDS.into_iter().enumerate() {
            if ui.radio(page.kind() == kind, name).on_hover_text(tip).clicked() {
                page.choose_kind(kind);
            }
        }
    });
}

/// Dictionary and size of the markers of a ChArUco board, or spacing and first number of tags.
pub(super) fn choice(ui: &mut Ui, page: &mut StartPage) {
    let Some(mut chosen) = page.draft.markers else { return };
    match &mut chosen.tags {
        Some(tags) => tags_choice(ui, tags),
        None if chosen.circles.is_some() => {}
        None => markers_choice(ui, &mut chosen, page.draft.square_m),
    }
    page.draft.markers = Some(chosen);
    if let Some(trouble) = page.board_trouble() {
        let (what, action) = words::impossible(&trouble, page.draft.square_m);
        ui.label(RichText::new(what).color(theme::palette(ui.visuals()).bad));
        ui.label(action);
    }
}

fn tags_choice(ui: &mut Ui, tags: &mut Tags) {
    ui.horizontal(|ui| {
        let name = ui.label(words::SPACING).on_hover_text(words::SPACING_TIP);
        let [least, most] = InvalidMarkers::SPACINGS;
        let field = DragValue::new(&mut tags.spacing).range(least..=most).speed(0.01);
        ui.add(field).labelled_by(name.id).on_hover_text(words::SPACING_TIP);
    });
    ui.horizontal(|ui| {
        let name = ui.label(words::FIRST_TAG).on_hover_text(words::FIRST_TAG_TIP);
        let field = DragValue::new(&mut tags.first).range(0..=586);
        ui.add(field).labelled_by(name.id).on_hover_text(words::FIRST_TAG_TIP);
    });
}

fn markers_choice(ui: &mut Ui, chosen: &mut MarkerChoice, square_m: f64) {
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
        let usual_m = usual_side_m(*chosen, square_m);
        let mut side_m = chosen.side_m.unwrap_or(usual_m);
        let field = DragValue::new(&mut side_m)
            .range(0.0001..=9.9)
            .speed(0.0005)
            .custom_formatter(|length_m, _| words::square(length_m))
            .custom_parser(words::parsed_millimetres);
        let response = ui.add(field).labelled_by(name.id).on_hover_text(words::MARKER_TIP);
        if response.changed() {
            // The usual size stays usual if the square changes.
            chosen.side_m = Some(side_m).filter(|side_m| (side_m - usual_m).abs() > 1e-6);
        }
    });
}

fn usual_side_m(chosen: MarkerChoice, square_m: f64) -> f64 {
    square_m * MarkerChoice { side_m: None, ..chosen }.in_squares_of(square_m).side_squares
}

/// Action to print the chosen board.
pub(super) fn print(page: &StartPage) -> UiAction {
    let draft = &page.draft;
    let markers = draft.markers.map(|chosen| chosen.in_squares_of(draft.square_m));
    UiAction::Print { board: draft.board, markers, paper: page.paper }
}
