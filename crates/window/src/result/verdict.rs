//! The verdict in words, with the findings and the numbers.

use egui::{CollapsingHeader, Grid, RichText, Sense, Ui, Vec2};

use super::{
    super::{
        aloud,
        keys::{UiAction, button},
        screen::Screen,
        theme,
    },
    card, charts,
    comparison::{self, Comparison},
    state::State,
};
use boresight_calibrate::{Calibration, Severity, Verdict};
use boresight_geometry::{BoardOutline, open_corners};
use boresight_guide::session::Snapshot;
use boresight_present::{
    grade::Grade,
    text::{self, Act, window as words},
};

/// Shows the verdict, and ways to improve.
pub(super) fn show(ui: &mut Ui, screen: &Screen, state: State<'_>, asks: &mut Vec<UiAction>) {
    let snapshot = screen.snapshot.as_ref();
    let shown = snapshot.and_then(|snapshot| Some((snapshot, snapshot.calibration.as_ref()?)));
    let Some((snapshot, calibration)) = shown else {
        nothing(ui, screen, state, asks);
        return;
    };
    theme::card(ui.visuals()).show(ui, |ui| {
        ui.set_width(ui.available_width());
        let may_go_on = matches!(state, State::Ended(_));
        verdict(ui, screen, snapshot, calibration);
        if may_go_on {
            ui.label(text::ending(
                snapshot.ending,
                snapshot.lack,
                snapshot.limits.plan,
                Some(&**calibration),
            ));
        }
        uncovered(ui, (snapshot, calibration), may_go_on, asks);
    });
}

/// Shows the findings of the checks, if any.
pub(super) fn found(ui: &mut Ui, screen: &Screen) {
    let snapshot = screen.snapshot.as_ref();
    let shown = snapshot.and_then(|snapshot| Some((snapshot, snapshot.calibration.as_ref()?)));
    let Some((snapshot, calibration)) = shown else { return };
    if calibration.findings.is_empty() {
        return;
    }
    ui.add_space(theme::UNIT);
    theme::card(ui.visuals()).show(ui, |ui| {
        ui.set_width(ui.available_width());
        findings(ui, snapshot, calibration);
    });
}

/// Shows the result of a comparison, with the numbers and methods behind folds.
pub(super) fn details(ui: &mut Ui, screen: &Screen, compared: &Comparison) {
    let Some(snapshot) = &screen.snapshot else { return };
    let Some(calibration) = &snapshot.calibration else { return };
    comparison::show(ui, compared);
    ui.add_space(theme::UNIT);
    theme::card(ui.visuals()).show(ui, |ui| {
        ui.set_width(ui.available_width());
        let heading = |words: &str| RichText::new(words).strong();
        CollapsingHeader::new(heading(words::NUMBERS_HEADING)).show(ui, |ui| {
            let known = screen.known.borrow_mut().of(snapshot);
            let lines = words::result_lines(calibration, known.and_then(|known| known.met()));
            table(ui, "result", lines.into_iter().map(|(name, value)| (name, value, "")));
        });
        let fold = CollapsingHeader::new(heading(words::METHODS)).show(ui, |ui| {
            ui.label(RichText::new(words::METHODS_TIP).small().weak());
            table(ui, "methods", words::method_lines(calibration).into_iter());
        });
        fold.header_response.on_hover_text(words::METHODS_TIP);
    });
}

/// Reason for a missing result, and the next action.
fn nothing(ui: &mut Ui, screen: &Screen, state: State<'_>, asks: &mut Vec<UiAction>) {
    let snapshot = screen.snapshot.as_ref();
    let has_views = snapshot.is_some_and(|snapshot| !snapshot.views.is_empty());
    theme::card(ui.visuals()).show(ui, |ui| {
        ui.set_width(ui.available_width());
        let heading = |words: &str| RichText::new(words).size(theme::VERDICT).strong();
        if has_views || screen.asked.is_empty() {
            ui.label(heading(words::NO_RESULT));
            ui.label(words::NO_RESULT_ACTION);
        } else {
            ui.label(heading(words::NO_VIEW_TAKEN));
            if let Some(reasons) = words::most_often(&screen.asked) {
                ui.label(reasons);
            }
            ui.label(words::TRY);
        }
        ui.add_space(theme::UNIT);
        if let Some(snapshot) = snapshot {
            charts::put_back(ui, snapshot, asks);
        }
        ui.horizontal(|ui| match state {
            State::Running | State::Ending => {
                button(ui, Act::GuidePage, asks);
            }
            State::Ended(_) => {
                button(ui, Act::GoOn, asks);
                button(ui, Act::StartPage, asks);
            }
            State::Nothing => {
                button(ui, Act::StartPage, asks);
            }
        });
    });
}

/// Verdict, the two main numbers, and the area without boards.
fn verdict(ui: &mut Ui, screen: &Screen, snapshot: &Snapshot, calibration: &Calibration) {
    let grade = Grade::of(calibration);
    let color = card::color(ui, grade);
    let verdict = text::of_source(&screen.source, text::verdict_on(calibration));
    ui.horizontal_top(|ui| {
        let (rect, _) = ui.allocate_exact_size(Vec2::splat(theme::VERDICT), Sense::hover());
        card::sign(ui.painter(), rect, grade, color, theme::ground(ui.visuals()));
        ui.vertical(|ui| {
            let verdict = RichText::new(verdict).size(theme::VERDICT).strong().color(color);
            aloud::read_next(&ui.label(verdict));
        });
    });
    for accuracy in words::accuracies(snapshot) {
        ui.label(RichText::new(accuracy).size(theme::TITLE));
    }
    if let Some(met) = screen.known.borrow_mut().of(snapshot).and_then(|known| known.met()) {
        ui.label(RichText::new(format!("{}: {met}", words::MEETS)).size(theme::TITLE));
    }
    // Too few views leave the check as uncertain as the result.
    if calibration.verdict != Verdict::Untrustworthy
        && let Some(check) = words::independent_check(&calibration.principal_point)
    {
        ui.label(RichText::new(check).size(theme::TITLE));
    }
}

/// Names the corners of the picture hardly reached by boards, and offers two more views there.
fn uncovered(
    ui: &mut Ui,
    (snapshot, calibration): (&Snapshot, &Calibration),
    may_go_on: bool,
    asks: &mut Vec<UiAction>,
) {
    let outlines: Vec<BoardOutline> =
        snapshot.views.iter().filter_map(|view| view.outline).collect();
    if calibration.verdict != Verdict::Untrustworthy
        && let Some(open) = words::open_corners(open_corners(&outlines, calibration.image_size))
    {
        ui.label(open);
        let button = RichText::new(words::TAKE_MORE).size(theme::TITLE);
        if may_go_on && ui.button(button).on_hover_text(words::TAKE_MORE_TIP).clicked() {
            asks.push(UiAction::TakeMore);
        }
    }
}

fn findings(ui: &mut Ui, snapshot: &Snapshot, calibration: &Calibration) {
    let palette = theme::palette(ui.visuals());
    for finding in &calibration.findings {
        let number = |place: usize| snapshot.views.get(place).map(|view| view.number);
        let (what, action) = text::finding_in_session(finding, &number);
        let mark = match finding.severity {
            Severity::Info => palette.info,
            Severity::Care => palette.care,
            Severity::Bad => palette.bad,
        };
        ui.horizontal_top(|ui| {
            let (dot, _) = ui.allocate_exact_size(Vec2::splat(2.0 * theme::UNIT), Sense::hover());
            ui.painter().circle_filled(dot.center(), 5.0, mark);
            ui.vertical(|ui| {
                ui.label(format!("{what}.")).on_hover_text(finding.code.code());
                ui.label(RichText::new(action).strong());
            });
        });
    }
}

fn table<'a>(ui: &mut Ui, name: &str, lines: impl Iterator<Item = (&'a str, String, &'a str)>) {
    let spacing = [3.0 * theme::UNIT, 0.5 * theme::UNIT];
    Grid::new(name).num_columns(2).spacing(spacing).show(ui, |ui| {
        for (name, value, tip) in lines {
            let name = ui.label(RichText::new(name).weak());
            if !tip.is_empty() {
                name.on_hover_text(tip);
            }
            ui.label(value);
            ui.end_row();
        }
    });
}
