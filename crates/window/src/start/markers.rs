//! Extra choices of a ChArUco board and an AprilGrid: markers or tags.

use egui::{ComboBox, DragValue, RichText, Ui};

use super::{super::theme, start_page::StartPage};
use boresight_geometry::{
    boards::{MarkerSide, Pattern},
    markers::{Dictionary, InvalidMarkers, Tags},
};
use boresight_present::text::start as words;

/// Choice of the kind of board.
pub(super) fn kind(ui: &mut Ui, page: &mut StartPage) {
    ui.horizontal_wrapped(|ui| {
        for (kind, words) in words::KINDS.iter().enumerate() {
            let ([name, tip], is_chosen) = (words.name, page.draft.pattern.kind_index() == kind);
            if ui.radio(is_chosen, name).on_hover_text(tip).clicked() {
                page.choose_kind(kind);
            }
        }
    });
}

/// Dictionary and size of the markers of a ChArUco board, or spacing and first number of tags.
pub(super) fn choice(ui: &mut Ui, page: &mut StartPage) {
    let square_m = page.draft.square_m;
    match &mut page.draft.pattern {
        Pattern::AprilGrid(tags) => tags_choice(ui, tags),
        Pattern::Charuco { dictionary, side } => markers_choice(ui, dictionary, side, square_m),
        _ => {}
    }
    if let Some(trouble) = page.board_trouble() {
        let (what, action) = words::impossible(&trouble, square_m);
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

fn markers_choice(ui: &mut Ui, chosen: &mut Dictionary, side: &mut MarkerSide, square_m: f64) {
    ui.horizontal(|ui| {
        let name = ui.label(words::DICTIONARY).on_hover_text(words::DICTIONARY_TIP);
        let list = ComboBox::from_id_salt("dictionary")
            .selected_text(words::dictionary(*chosen))
            .truncate()
            .width(ui.available_width());
        let list = list.show_ui(ui, |ui| {
            for dictionary in Dictionary::all() {
                let label = words::dictionary(dictionary);
                ui.selectable_value(chosen, dictionary, label);
            }
        });
        list.response.labelled_by(name.id).on_hover_text(words::DICTIONARY_TIP);
    });
    ui.horizontal(|ui| {
        let name = ui.label(words::MARKER).on_hover_text(words::MARKER_TIP);
        let usual_m = square_m * MarkerSide::Usual.in_squares_of(square_m);
        let mut side_m = if let MarkerSide::Metres(side_m) = *side { side_m } else { usual_m };
        let field = DragValue::new(&mut side_m)
            .range(0.0001..=9.9)
            .speed(0.0005)
            .custom_formatter(|length_m, _| words::square(length_m))
            .custom_parser(words::parsed_millimetres);
        let response = ui.add(field).labelled_by(name.id).on_hover_text(words::MARKER_TIP);
        if response.changed() {
            // The usual size stays usual if the square changes.
            let is_other = (side_m - usual_m).abs() > 1e-6;
            *side = if is_other { MarkerSide::Metres(side_m) } else { MarkerSide::Usual };
        }
    });
}
