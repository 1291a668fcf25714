//! Spoken sentences. They are heard once and not read twice: the most important word comes first,
//! and nothing depends on a screen.

use super::{camera, prompt};
use boresight_detect::Side;
use boresight_guide::session::Prompt;

/// Next action, in six spoken words at most and without a number.
pub fn spoken(asked: Prompt) -> String {
    match asked {
        Prompt::Complete => "Finished. Put the board down".into(),
        Prompt::Exhausted => "Stopped. The result says why".into(),
        Prompt::Failed => "Stopped. Your views are safe".into(),
        Prompt::CameraLost => "Camera lost".into(),
        Prompt::Frozen => "Picture frozen".into(),
        Prompt::LensMoved(control) => {
            format!("{} changed", camera::capital(camera::control(control)))
        }
        Prompt::Taken => "Taken".into(),
        Prompt::ShowWholeFirst => "The whole board first".into(),
        Prompt::CutOff(Side::Left) => "Move right".into(),
        Prompt::CutOff(Side::Right) => "Move left".into(),
        Prompt::CutOff(Side::Top) => "Move down".into(),
        Prompt::CutOff(Side::Bottom) => "Move up".into(),
        Prompt::Glare => "Glare. Tip the board".into(),
        Prompt::Blurred => "Blurry. Hold still".into(),
        Prompt::SteadyTheBoard => "Rest your elbows".into(),
        Prompt::FollowTheOutline => "Tip it, or move it".into(),
        Prompt::CameraNotReady => "Wait for the camera".into(),
        other => prompt(other),
    }
}

/// Spoken words for the end of the state `ended`.
pub fn spoken_after(ended: Prompt) -> &'static str {
    match ended {
        Prompt::CameraLost => "The camera is back",
        _ => "Continuing",
    }
}

/// Sentence to test the voice.
pub const VOICE_TEST: &str = "This is how I sound";
/// Error for a missing speech program.
pub const NO_VOICE: &str =
    "No voice: install speech-dispatcher (spd-say) or espeak-ng, then try again";
