use super::view_number::ViewNumber;
use crate::guidance::{Role, Velocity, View};
use boresight_geometry::Corner;

/// An accepted view.
#[derive(Clone, Debug, PartialEq)]
pub struct AcceptedView {
    /// Number of the view, by which people call it.
    pub number: ViewNumber,
    /// File name of the picture, or empty.
    pub name: String,
    /// Role of the view.
    pub role: Role,
    /// True if a board beyond the picture's edge was asked for, whose partner comes next.
    pub was_beyond_edge: bool,
    /// The view as measured when it was accepted, through the lens estimate of that time.
    pub view: View,
    /// Its corners as seen, sheared by a rolling shutter if the board moved; the view's are those of one instant, as far
    /// as the readout was known then.
    pub seen: Vec<Corner>,
    /// How the board moved; `None` of a photograph.
    pub velocity: Option<Velocity>,
}

impl AcceptedView {
    /// Name of the view's picture: its file name, or the name under which the session stores it.
    pub fn picture_name(&self) -> String {
        if self.name.is_empty() { self.view.frame_id.stored_name() } else { self.name.clone() }
    }
}
