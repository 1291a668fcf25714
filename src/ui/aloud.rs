//! What a screen reader says without being asked.

use egui::{Context, Response, accesskit::Live};

/// Has `response`'s words read when they come or change, after what is being read.
pub(super) fn read_next(response: &Response) {
    read(response, Live::Polite);
}

/// Has them read at once: what is being read may not be true any more.
pub(super) fn read_now(response: &Response) {
    read(response, Live::Assertive);
}

/// Names the window, which has a title only for those who see it.
pub(super) fn name_window(ctx: &Context, title: &str) {
    ctx.accesskit_node_builder(egui::accesskit_root_id(), |node| node.set_label(title));
}

fn read(response: &Response, live: Live) {
    response.ctx.accesskit_node_builder(response.id, |node| node.set_live(live));
}
