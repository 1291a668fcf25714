//! Keys and buttons for every action.

use egui::{Button, Context, Key, Response, Ui};

use boresight_geometry::{boards::BoardChoice, device::Control};
use boresight_guide::session::ViewNumber;
use boresight_present::text::Act;

/// Request of a panel.
#[derive(Clone, Debug, PartialEq)]
pub enum UiAction {
    /// Action without further data.
    Act(Act),
    /// Scale everything by a factor; 1 is the usual size.
    Zoom(f32),
    /// Take back a view.
    Remove(ViewNumber),
    /// Start the session chosen on the start page.
    Start(Box<boresight_app::window::services::SessionRequest>),
    /// Start the session of several cameras chosen on the start page.
    StartRig(Box<boresight_app::window::services::RigRequest>),
    /// Take two more views in uncovered areas.
    TakeMore,
    /// Restart with a board of the given size.
    UseBoard(BoardChoice),
    /// Print a board on paper number `paper`.
    Print {
        /// Board, with the side of markers in squares.
        board: BoardChoice,
        /// Number of the paper.
        paper: usize,
    },
    /// Mirror the picture if true: the camera faces the person, as confirmed.
    Mirror(bool),
    /// Switch the voice on and speak a test sentence.
    TestVoice,
    /// Fill the screen during a session, if true, while the person is away.
    FullScreenAfar(bool),
    /// Start with the settings.
    Open(Box<boresight_app::window::services::SessionRequest>),
    /// Write the result in the format by number.
    Export(usize),
    /// Compare the result with the calibration in the file.
    Compare(std::path::PathBuf),
    /// Set a control of the camera.
    Adjust {
        /// The control concerned.
        control: Control,
        /// Value to set, in the driver's unit.
        value: i64,
    },
    /// Open the recording in the folder.
    Replay(std::path::PathBuf),
    /// List the folders in the folder, to choose a recording.
    Browse(std::path::PathBuf),
    /// Show the result of the session in the folder.
    ShowResult(std::path::PathBuf),
    /// Continue the session in the folder.
    GoOnWith(std::path::PathBuf),
    /// Continue the session of several cameras in the folder.
    GoOnWithRig(std::path::PathBuf),
    /// Write the result of the session in the folder in a format by number.
    ExportOf(std::path::PathBuf, usize),
    /// Move the session in the folder to the bin.
    Delete(std::path::PathBuf),
    /// Close the recording that is open.
    CloseRecording,
    /// Show the file.
    Show(std::path::PathBuf),
}

fn key(act: Act) -> Key {
    match act {
        Act::Force => Key::Space,
        Act::Undo => Key::U,
        Act::Restore => Key::R,
        Act::Pause => Key::P,
        Act::Finish => Key::E,
        Act::GoOn => Key::G,
        Act::New => Key::N,
        Act::Mirror => Key::M,
        Act::Tone => Key::T,
        Act::Speech => Key::S,
        Act::Panels => Key::H,
        Act::FullScreen => Key::F11,
        Act::Distance => Key::B,
        Act::Lines => Key::L,
        Act::Theme => Key::D,
        Act::Help => Key::F12,
        Act::StartPage => Key::F6,
        Act::GuidePage => Key::F1,
        Act::ResultPage => Key::F2,
        Act::SettingsPage => Key::F4,
        Act::ReplayPage => Key::F5,
    }
}

/// True if `act` affects the running session.
pub(super) fn is_of_session(act: Act) -> bool {
    matches!(act, Act::Force | Act::Undo | Act::Restore | Act::Pause | Act::Finish | Act::GoOn)
}

/// Requests from keys pressed since the last pass. A focused text field keeps its letters, and a
/// focused control its Space.
pub(super) fn pressed(ctx: &Context) -> Vec<Act> {
    let writing = ctx.egui_wants_keyboard_input();
    let focused = ctx.memory(|memory| memory.focused().is_some());
    ctx.input(|input| {
        let pressed = |act: &Act| {
            let free = match act {
                Act::Force => !focused,
                _ => !writing || act.words().key.starts_with('F'),
            };
            free && input.modifiers.is_none() && input.key_pressed(key(*act))
        };
        Act::ALL.iter().copied().filter(pressed).collect()
    })
}

/// A button for `act`, with tooltip and key.
pub(super) fn button(ui: &mut Ui, act: Act, asks: &mut Vec<UiAction>) -> Response {
    let words = act.words();
    let response = with_tip(ui.button(words.label), act);
    if response.clicked() {
        asks.push(UiAction::Act(act));
    }
    response
}

/// Button pressed down while `on`.
pub(super) fn toggle(ui: &mut Ui, act: Act, on: bool, asks: &mut Vec<UiAction>) -> Response {
    let response = with_tip(ui.add(Button::selectable(on, act.words().label)), act);
    if response.clicked() {
        asks.push(UiAction::Act(act));
    }
    response
}

fn with_tip(response: Response, act: Act) -> Response {
    let words = act.words();
    response.on_hover_text(format!("{} ({})", words.tip, words.key))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_act_has_a_key_of_its_own_that_bears_its_name() {
        for (i, act) in Act::ALL.iter().enumerate() {
            assert_eq!(key(*act).name(), act.words().key);
            assert!(Act::ALL[..i].iter().all(|other| key(*other) != key(*act)), "{act:?}");
        }
    }
}
