use egui::{RichText, Ui};

use super::super::theme;
use crate::app::host::UserError;

/// An error with its next action.
pub(super) fn error_lines(ui: &mut Ui, error: &UserError) {
    ui.colored_label(theme::RED, RichText::new(&error.what).size(18.0));
    if let Some(action) = &error.action {
        ui.label(RichText::new(action).size(16.0));
    }
}
