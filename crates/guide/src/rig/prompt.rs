//! The one sentence to say to the person in front of several cameras.

use super::lead::{REST_SECS, RigSession};
use crate::session::{Gravity, Prompt};

/// Request to the person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RigPrompt {
    /// What a camera's session asks for.
    OfCamera {
        /// The camera.
        camera: usize,
    },
    /// Move the board to where this camera sees it, too.
    Unseen {
        /// Camera without the board.
        camera: usize,
    },
    /// Show the board to two cameras at once.
    ShowToTwo,
    /// Show the board to one of the `linked` cameras and to another camera at once.
    Link {
        /// Cameras linked with each other, by bit.
        linked: u32,
    },
    /// Let the board rest.
    Rest,
    /// Wait: the board rests.
    Resting {
        /// Share of the rest passed, 0 to 1.
        progress: f64,
    },
    /// A place was taken.
    Taken,
    /// Show another place: this one tells nothing new.
    Elsewhere,
    /// Every pair of cameras meets the goal.
    Complete,
}

impl RigPrompt {
    /// Gravity of the request; `of_camera` is that of a camera's own request.
    pub fn gravity(self, of_camera: impl FnOnce(usize) -> Gravity) -> Gravity {
        match self {
            Self::OfCamera { camera } => of_camera(camera),
            Self::Resting { .. } | Self::Taken | Self::Complete => Gravity::Good,
            Self::Elsewhere => Gravity::Careful,
            Self::Unseen { .. } | Self::ShowToTwo | Self::Link { .. } | Self::Rest => {
                Gravity::Plain
            }
        }
    }
}

impl RigSession {
    /// Camera whose picture the person looks at: the one that the request is about, else the one
    /// with the largest view of the next place.
    pub fn shown(&self) -> usize {
        match self.prompt() {
            RigPrompt::OfCamera { camera } | RigPrompt::Unseen { camera } => camera,
            _ => self.wanted().map_or(0, |wanted| wanted.lead),
        }
    }

    /// What to ask the person for now.
    pub fn prompt(&self) -> RigPrompt {
        let troubled = self
            .cameras
            .iter()
            .position(|camera| camera.prompt.is_some_and(|it| it.gravity() == Gravity::Bad));
        if let Some(camera) = troubled {
            return RigPrompt::OfCamera { camera };
        }
        if self.is_complete() {
            return RigPrompt::Complete;
        }
        if self.is_taking() {
            return RigPrompt::Resting { progress: 1.0 };
        }
        if self.has_just_taken() {
            return RigPrompt::Taken;
        }
        let seeing = self.seeing();
        let wanted = self.wanted();
        let lead = wanted.map_or_else(|| seeing.first().copied().unwrap_or(0), |it| it.lead);
        if !seeing.contains(&lead) {
            // A camera without a link needs one, with whichever camera sees the board.
            let is_alone = self.linked(lead).is_power_of_two();
            return match is_alone && !seeing.is_empty() {
                true => RigPrompt::Unseen { camera: lead },
                false => RigPrompt::OfCamera { camera: lead },
            };
        }
        let linked = self.linked(lead);
        let links_nothing = seeing.iter().all(|camera| linked >> camera & 1 == 1);
        if links_nothing && (2..self.cameras.len() as u32).contains(&linked.count_ones()) {
            return RigPrompt::Link { linked };
        }
        if seeing.len() < 2 {
            let misses = |camera: &usize| !seeing.contains(camera);
            let mut asked = wanted.iter().flat_map(|it| &it.targets).map(|(camera, _)| *camera);
            let others: Vec<usize> = (0..self.cameras.len()).filter(misses).collect();
            return match (asked.find(misses), others.as_slice()) {
                (Some(camera), _) | (None, &[camera]) => RigPrompt::Unseen { camera },
                _ => RigPrompt::ShowToTwo,
            };
        }
        let asks_for_a_move = self.cameras[lead].prompt.is_some_and(Prompt::asks_for_a_move);
        let rested_secs = self.rested_secs(&seeing);
        if rested_secs >= REST_SECS && self.is_declined {
            return match asks_for_a_move {
                true => RigPrompt::OfCamera { camera: lead },
                false => RigPrompt::Elsewhere,
            };
        }
        if asks_for_a_move && rested_secs < 0.5 * REST_SECS {
            RigPrompt::OfCamera { camera: lead }
        } else if rested_secs > 0.0 {
            RigPrompt::Resting { progress: (rested_secs / REST_SECS).min(1.0) }
        } else {
            RigPrompt::Rest
        }
    }
}
