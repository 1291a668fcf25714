//! A recording, decision by decision: what was seen, and why it was taken or not.

mod picker;
mod recording_browser;
mod replayed;
mod strip;

pub use picker::{Picker, pick};
pub(super) use recording_browser::RecordingBrowser;
pub use replayed::Replayed;

use egui::{Button, Panel, RichText, Slider, Ui};

use super::{guide, theme};
use crate::text::replay as words;

/// Shows the page.
pub fn show(ui: &mut Ui, replayed: &mut Replayed) {
    replayed.obey_keys(ui);
    replayed.follow(ui);
    replayed.bring(ui);
    Panel::bottom("replay").show(ui, |ui| {
        let step = &replayed.steps[replayed.at];
        ui.label(RichText::new(words::why(step)).size(theme::VERDICT).strong());
        ui.horizontal(|ui| {
            let frame = step.decision.frame;
            let (at, steps) = (replayed.at, replayed.steps.len());
            ui.label(words::place(at, steps, frame, replayed.secs[at]));
            if replayed.differs[at] {
                ui.label(
                    RichText::new(words::DIFFERS).color(theme::palette(ui.visuals()).bad).strong(),
                );
            } else if frame.is_some() && replayed.screen.picture.texture().is_none() {
                ui.label(RichText::new(words::NO_PICTURE).weak());
            }
        });
        if let Some(to) = strip::show(ui, replayed) {
            replayed.go(to);
        }
        ui.horizontal(|ui| {
            let clicked = |ui: &mut Ui, (label, key, tip): words::Step, on: bool| {
                ui.add(Button::selectable(on, label))
                    .on_hover_text(format!("{tip} ({key})"))
                    .clicked()
            };
            if clicked(ui, words::VIEW_BACK, false) {
                replayed.view_before();
            }
            if clicked(ui, words::BACK, false) {
                replayed.go(replayed.at.saturating_sub(1));
            }
            if clicked(ui, words::PLAY, replayed.playing_from_secs.is_some()) {
                replayed.play(ui);
            }
            if clicked(ui, words::ON, false) {
                replayed.go(replayed.at + 1);
            }
            if clicked(ui, words::VIEW_ON, false) {
                replayed.next_view();
            }
            ui.spacing_mut().slider_width = (ui.available_width() - 140.0).max(80.0);
            let mut at = replayed.at;
            let last = replayed.steps.len() - 1;
            if ui.add(Slider::new(&mut at, 0..=last).text(words::SCRUBBER)).changed() {
                replayed.go(at);
            }
        });
    });
    // Nothing can be changed in a recording.
    guide::show(ui, &replayed.screen, &mut Vec::new());
}
