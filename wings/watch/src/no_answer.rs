//! Reasons for a picture without an answer.

use boresight_scene::Weak;

/// Why a picture has no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum NoAnswer {
    /// Nothing stands out from the picture's noise: hardly any light, or hardly any contrast.
    TooDark,
    /// Too few patches of the references are in the picture.
    FewFound {
        /// Patches that were found.
        found: u32,
        /// Patches that were looked for.
        of: u32,
    },
    /// Patches were found, but they disagree about where the camera points.
    Disagree {
        /// Patches that agree.
        agree: u32,
        /// Patches that were found.
        found: u32,
    },
    /// Patches agree about two different motions.
    TwoMotions {
        /// Patches that agree about one.
        agree: u32,
        /// Patches that agree about the other.
        other: u32,
        /// Share of the picture left out from then on as the camera's own mount, or as text.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        left_out_percent: Option<u32>,
    },
    /// What agrees is little of what usually does.
    LittleSeen {
        /// Patches that agree.
        agree: u32,
        /// Patches that were looked for.
        of: u32,
    },
    /// What agrees lies in one corner of the picture only.
    OneCorner,
    /// The camera shakes too much during a burst.
    Shakes,
    /// There are no references yet.
    NoReferences,
    /// The picture has another size.
    OtherSize,
    /// No picture came.
    NoPicture,
    /// No picture came: the camera asks for another user name or password.
    NotLoggedIn,
    /// No picture came: the camera isn't reached.
    NotReached,
    /// The same picture came again.
    Frozen,
    /// The camera looks somewhere between its presets.
    BetweenPresets,
    /// The answer's interval reaches beyond the smallest visible change.
    Unsure,
    /// Too few answers in a row since the last doubt.
    Unconfirmed,
    /// The times of pictures lie ahead, or go back: a clock is wrong.
    WrongClock,
}

impl NoAnswer {
    /// True if a new picture came, with a time that may be true.
    pub fn is_of_a_picture(self) -> bool {
        let none = [Self::NoPicture, Self::NotLoggedIn, Self::NotReached, Self::Frozen];
        self != Self::WrongClock && !none.contains(&self)
    }

    /// True if looks have no answer until a person mends the cause.
    pub fn is_for_a_person(self) -> bool {
        [Self::Frozen, Self::NotLoggedIn, Self::OtherSize].contains(&self)
    }

    /// True if the picture has an answer, which doesn't vouch for the camera.
    pub fn is_of_an_answer(self) -> bool {
        matches!(self, Self::Unsure | Self::LittleSeen { .. })
    }
}

impl From<Weak> for NoAnswer {
    fn from(weak: Weak) -> Self {
        match weak {
            Weak::FewFound { found, of } => Self::FewFound { found, of },
            Weak::Disagree { agree, found } => Self::Disagree { agree, found },
            Weak::OneCorner => Self::OneCorner,
        }
    }
}
