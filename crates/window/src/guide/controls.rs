//! Controls of the camera: set by a slider or a number, shown as read back.

use egui::{Button, RichText, Slider, Ui};

use super::super::{keys::UiAction, screen::Screen};
use boresight_geometry::device::{Adjustable, Lock};
use boresight_guide::session::Stream;
use boresight_present::text::adjust as words;

/// Shows the adjustable controls.
pub(super) fn show(ui: &mut Ui, screen: &Screen, asks: &mut Vec<UiAction>) {
    let Some(snapshot) = &screen.snapshot else { return };
    let lives = snapshot.camera.stream == Stream::Live;
    for adjustable in &screen.adjustables {
        let lock = screen.locks().of(adjustable.control);
        // An unlocked control is moved by the camera itself.
        let can = lives && !matches!(lock, Lock::Unknown | Lock::Absent);
        ui.add_enabled_ui(can, |ui| one(ui, screen, (adjustable, lock), asks));
    }
}

fn one(
    ui: &mut Ui,
    screen: &Screen,
    (adjustable, lock): (&Adjustable, Lock),
    asks: &mut Vec<UiAction>,
) {
    let Adjustable { control, min, max, step } = *adjustable;
    let tip = words::tip(control);
    let asked = screen.adjusting.get(&control).map(|adjusting| adjusting.value);
    let name = ui.horizontal(|ui| {
        let name = ui.label(RichText::new(words::name(control)).small()).on_hover_text(tip);
        ui.label(RichText::new(words::state(lock, asked)).small().weak()).on_hover_text(tip);
        let first = screen.first_locks.of(control).value();
        if let Some(first) = first.filter(|first| lock.value().is_some_and(|now| now != *first)) {
            let back = Button::new(RichText::new(words::back(first)).small()).small();
            if ui.add(back).on_hover_text(words::back_tip(control, first)).clicked() {
                asks.push(UiAction::Adjust { control, value: first });
            }
        }
        name.id
    });
    // A dragged value is the person's.
    let id = ui.scope_id().with(words::name(control));
    let drafted = ui.data(|data| data.get_temp::<i64>(id));
    let shown = asked.or(lock.value()).unwrap_or(min);
    let mut value = drafted.unwrap_or(shown).clamp(min, max);
    ui.spacing_mut().slider_width = 120.0;
    let slider =
        Slider::new(&mut value, min..=max).step_by(step as f64).update_while_editing(false);
    let response = ui.add(slider).labelled_by(name.inner).on_hover_text(tip);
    if response.changed() {
        ui.data_mut(|data| data.insert_temp(id, value));
    }
    if !response.dragged()
        && let Some(value) = ui.data_mut(|data| data.remove_temp::<i64>(id))
    {
        asks.push(UiAction::Adjust { control, value });
    }
}
