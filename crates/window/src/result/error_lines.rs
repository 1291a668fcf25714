use egui::{RichText, Ui};

use super::super::theme;
use boresight_app::explain::UserError;

/// An error with next action.
pub(super) fn error_lines(ui: &mut Ui, error: &UserError) {
    let bad = theme::palette(ui.visuals()).bad;
    ui.colored_label(bad, RichText::new(&error.what).size(theme::TITLE));
    if let Some(action) = &error.action {
        ui.label(RichText::new(action).size(theme::BODY));
    }
}
