use super::view_number::ViewNumber;
use crate::guidance::{Role, Velocity, View};
use boresight_geometry::Corner;

/// An accepted view.
#[derive(Clone, Debug, PartialEq)]
pub struct AcceptedView {
    /// Number of the view, as shown to people.
    pub number: ViewNumber,
    /// File name of the picture, or empty.
    pub name: String,
    /// Role of the view.
    pub role: Role,
    /// True if the requested board extended beyond the picture's edge. Its partner comes next.
    pub was_beyond_edge: bool,
    /// The view as measured at acceptance, through the lens estimate of that time.
    pub view: View,
    /// Corners as seen, sheared by a rolling shutter if the board moved. The corners of `view` are
    /// those of one instant, as far as the readout was known at acceptance.
    pub seen: Vec<Corner>,
    /// Motion of the board; `None` for a photograph.
    pub velocity: Option<Velocity>,
}

impl AcceptedView {
    /// File name of the view's picture, or the name of the stored copy.
    pub fn picture_name(&self) -> String {
        if self.name.is_empty() { self.view.frame_id.stored_name() } else { self.name.clone() }
    }
}
