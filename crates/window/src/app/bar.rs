//! Bar above every page, and the list of keys.

use egui::{
    Color32, Id, Panel, RichText, Stroke, TextStyle, TextWrapMode, Ui, UiBuilder, WidgetText, vec2,
};

use super::{
    super::{
        aloud, guide,
        keys::{self, UiAction, toggle},
        session_state::SessionState,
    },
    App, Page,
};
use boresight_present::{
    grade::Grade,
    text::{self, Act, window as words},
};

/// A page's name, underlined on its page: a switch that is on is filled.
fn tab(ui: &mut Ui, act: Act, on: bool, asks: &mut Vec<UiAction>) {
    ui.scope(|ui| {
        let ink = ui.visuals().strong_text_color();
        ui.visuals_mut().widgets.inactive.bg_stroke = Stroke::NONE;
        let selection = &mut ui.visuals_mut().selection;
        (selection.bg_fill, selection.stroke.color) = (Color32::TRANSPARENT, ink);
        let rect = toggle(ui, act, on, asks).rect.shrink2(vec2(6.0, 0.0));
        if on {
            ui.painter().hline(rect.x_range(), rect.bottom(), Stroke::new(2.0, ink));
        }
    });
}

impl App {
    pub(super) fn bar(&mut self, ui: &mut Ui, asks: &mut Vec<UiAction>) {
        Panel::top("bar").show(ui, |ui| {
            // A small window puts the surplus into a second line.
            ui.horizontal_wrapped(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                ui.spacing_mut().button_padding.x = 6.0;
                for (page, act) in [
                    (Page::Start, Act::StartPage),
                    (Page::Guide, Act::GuidePage),
                    (Page::Result, Act::ResultPage),
                    (Page::Settings, Act::SettingsPage),
                    (Page::Replay, Act::ReplayPage),
                ] {
                    tab(ui, act, self.page == page, asks);
                }
                match &self.stage {
                    _ if self.page == Page::Replay => {
                        if self.shelf.is_open() {
                            ui.separator();
                            let another = ui.button(text::replay::ANOTHER);
                            if another.on_hover_text(text::replay::ANOTHER_TIP).clicked() {
                                asks.push(UiAction::CloseRecording);
                            }
                        }
                    }
                    SessionState::Running(_) => {
                        ui.separator();
                        guide::buttons(ui, &self.screen, asks);
                    }
                    SessionState::Ended(_) => {
                        ui.separator();
                        // More views can't mend it.
                        if !self.is_not_trustworthy() {
                            keys::button(ui, Act::GoOn, asks);
                        }
                        keys::button(ui, Act::New, asks);
                    }
                    SessionState::Idle | SessionState::NotStarted(_) | SessionState::Ending(_) => {}
                }
                ui.separator();
                let preferences = &self.screen.preferences;
                // Elsewhere, most switches change nothing that is seen or heard.
                let is_picture = matches!(self.page, Page::Guide | Page::Replay);
                let switches = [
                    (Act::Mirror, preferences.mirrored),
                    (Act::Tone, preferences.tone),
                    (Act::Speech, preferences.speech),
                    (Act::Panels, preferences.panels),
                    (Act::Lines, preferences.lines),
                    (Act::Help, self.help),
                ];
                let here = |act| is_picture || act == Act::Help;
                for (act, on) in switches.into_iter().filter(|(act, _)| here(*act)) {
                    toggle(ui, act, on, asks);
                }
                self.phone.button(ui);
                if let Some(note) = &self.note {
                    let note = RichText::new(note).small().weak();
                    let (wrap, room) = (Some(TextWrapMode::Extend), f32::INFINITY);
                    let whole = WidgetText::from(note.clone());
                    let whole = whole.into_galley(ui, wrap, room, TextStyle::Small);
                    // A note without room starts a new line.
                    if whole.size().x > ui.available_size_before_wrap().x {
                        ui.end_row();
                    }
                    // The same name on every page: a screen reader reads the news.
                    let own = UiBuilder::new().scope_id(Id::unique("note"));
                    ui.scope_builder(own, |ui| aloud::read_next(&ui.label(note)));
                }
            });
        });
    }

    fn is_not_trustworthy(&self) -> bool {
        let snapshot = self.screen.snapshot.as_ref();
        let calibration = snapshot.and_then(|snapshot| snapshot.calibration.as_deref());
        calibration.is_some_and(|it| Grade::of(it) == Grade::NotTrustworthy)
    }

    pub(super) fn help(&mut self, ui: &Ui) {
        if !self.help {
            return;
        }
        let mut open = true;
        let window =
            egui::Window::new(words::HELP).open(&mut open).collapsible(false).vscroll(true);
        window.show(ui.ctx(), |ui| {
            egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
                let acts = Act::ALL.iter().map(|act| act.words());
                // Once is enough.
                let acts = acts.map(|it| match it.tip.starts_with(it.label) {
                    true => (it.key, it.tip.to_owned()),
                    false => (it.key, format!("{}: {}", it.label, it.tip)),
                });
                let others = words::OTHER_KEYS.iter().map(|(key, what)| (*key, (*what).to_owned()));
                for (key, what) in acts.chain(others) {
                    ui.label(RichText::new(key).strong().monospace());
                    ui.label(what);
                    ui.end_row();
                }
            });
        });
        self.help = open;
    }
}
