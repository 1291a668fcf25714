//! A recording, decision by decision: the frame, and the reason for taking it or not.

mod picker;
mod recording_browser;
mod replayed;
mod strip;
mod transport;

pub use picker::{Picker, pick};
pub(super) use recording_browser::RecordingBrowser;
pub use replayed::Replayed;

use egui::{Button, Panel, RichText, Slider, Ui};

use transport::{Sign, button};

use super::{guide, theme};
use boresight_present::text::replay as words;

/// Shows the page.
pub fn show(ui: &mut Ui, replayed: &mut Replayed) {
    replayed.obey_keys(ui);
    replayed.follow(ui);
    replayed.bring(ui);
    Panel::bottom("replay").show_separator_line(false).show(ui, |ui| {
        ui.add_space(0.5 * theme::UNIT);
        theme::card(ui.visuals()).show(ui, |ui| {
            ui.set_width(ui.available_width());
            decision(ui, replayed);
            if let Some(to) = strip::show(ui, replayed) {
                replayed.go(to);
            }
            ui.add_space(0.5 * theme::UNIT);
            ui.horizontal(|ui| transport(ui, replayed));
        });
        ui.add_space(0.5 * theme::UNIT);
    });
    // Recordings are read-only.
    guide::show(ui, &replayed.screen, &mut Vec::new());
}

/// Decision and position in the recording.
fn decision(ui: &mut Ui, replayed: &Replayed) {
    let step = &replayed.steps[replayed.at];
    let bad = theme::palette(ui.visuals()).bad;
    ui.label(
        RichText::new(words::why(step, replayed.screen.preferences.mirrored))
            .size(theme::TITLE)
            .strong(),
    );
    ui.horizontal(|ui| {
        let frame = step.decision.frame;
        let (at, steps) = (replayed.at, replayed.steps.len());
        ui.label(RichText::new(words::place(at, steps, frame, replayed.secs[at])).weak());
        if replayed.differs[at] {
            ui.label(RichText::new(words::DIFFERS).color(bad).strong());
        } else if frame.is_some() && replayed.screen.picture.grey().is_none() {
            ui.label(RichText::new(words::NO_PICTURE).weak());
        }
    });
}

fn transport(ui: &mut Ui, replayed: &mut Replayed) {
    if button(ui, Sign::ToViewBefore, words::VIEW_BACK) {
        replayed.view_before();
    }
    if button(ui, Sign::Back, words::BACK) {
        replayed.go(replayed.at.saturating_sub(1));
    }
    let play = if replayed.playing_from_secs.is_some() { Sign::Stop } else { Sign::Play };
    if button(ui, play, words::PLAY) {
        replayed.play(ui);
    }
    if button(ui, Sign::On, words::ON) {
        replayed.go(replayed.at + 1);
    }
    if button(ui, Sign::ToNextView, words::VIEW_ON) {
        replayed.next_view();
    }
    ui.spacing_mut().slider_width = (ui.available_width() - 240.0).max(80.0);
    let mut at = replayed.at;
    let last = replayed.steps.len() - 1;
    if ui.add(Slider::new(&mut at, 0..=last).text(words::SCRUBBER)).changed() {
        replayed.go(at);
    }
    let fold = Button::selectable(replayed.numbers, words::NUMBERS);
    if ui.add(fold).on_hover_text(words::NUMBERS_TIP).clicked() {
        replayed.numbers ^= true;
    }
}
