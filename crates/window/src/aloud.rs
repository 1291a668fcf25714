//! Announcements of a screen reader.

use egui::{Context, Response, accesskit::Live};

/// Announces new words of `response` after the present announcement.
pub(super) fn read_next(response: &Response) {
    read(response, Live::Polite);
}

/// Announces the words at once: the present announcement may be outdated.
pub(super) fn read_now(response: &Response) {
    read(response, Live::Assertive);
}

/// Names the window, for people with a screen reader.
pub(super) fn name_window(ctx: &Context, title: &str) {
    ctx.accesskit_node_builder(egui::accesskit_root_id(), |node| node.set_label(title));
}

fn read(response: &Response, live: Live) {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_live(live));
}
