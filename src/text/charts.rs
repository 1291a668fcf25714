//! The words of the charts on the result page.

/// A chart of the result page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Chart {
    /// Uncertainty of projection over the picture.
    #[default]
    Uncertainty,
    /// What is left at each corner.
    Residuals,
    /// The principal lines around the principal point.
    Lines,
    /// The principal point with views left out.
    Skipped,
    /// The newest picture without distortion.
    Undistorted,
    /// What has moved since an older calibration.
    Change,
}

impl Chart {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Uncertainty,
        Self::Residuals,
        Self::Lines,
        Self::Skipped,
        Self::Undistorted,
        Self::Change,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uncertainty => "Uncertainty",
            Self::Residuals => "Residuals",
            Self::Lines => "Principal lines",
            Self::Skipped => "Views left out",
            Self::Undistorted => "Undistorted",
            Self::Change => "Change",
        }
    }

    /// What it shows.
    pub fn tip(self) -> &'static str {
        match self {
            Self::Uncertainty => {
                "How well a ray's pixel is known, in each part of the picture; a turn of the camera is set aside."
            }
            Self::Residuals => {
                "From where a corner should be to where it was seen, enlarged. Arrows that point the same way all over a view say that the board or the lens model is wrong."
            }
            Self::Lines => {
                "Every view's principal line without distortion, around the principal point with its ellipse of two standard deviations. They should meet in it."
            }
            Self::Skipped => {
                "Where the principal lines meet when one, two or three views in a row are left out. Scatter says how much single views matter, not how true the point is."
            }
            Self::Undistorted => {
                "The newest picture as a pinhole camera would see it: straight edges must be straight."
            }
            Self::Change => {
                "Where to, and how far, the image of each ray has moved since the older calibration, enlarged. All one way: the principal point moved. Outwards or inwards: the focal length changed."
            }
        }
    }
}

/// Below the chart of uncertainty.
pub fn uncertainty_scale(mean_px: f64, max_px: f64) -> String {
    format!("{mean_px:.3} px on average, {max_px:.3} px at worst")
}

/// Below the chart of residuals.
pub fn residual_scale(times: f64, rms_px: f64) -> String {
    format!("enlarged {times:.0} times; {rms_px:.3} px RMS")
}

/// Below a chart of the surroundings of the principal point.
pub fn width(width_px: f64) -> String {
    if width_px >= 10.0 {
        format!("{width_px:.0} px wide")
    } else {
        format!("{width_px:.2} px wide")
    }
}

/// Below the chart of views left out.
pub fn skipped_scale(width_px: f64, counts: [usize; 3]) -> String {
    let [one, two, three] = counts;
    format!("{}; one left out: {one} points, two: {two}, three: {three}", width(width_px))
}

/// Below the chart of a change.
pub fn change_scale(times: f64, most_px: f64, matters_px: f64) -> String {
    format!("enlarged {times:.0} times; up to {most_px:.2} px, and {matters_px:.2} px matter")
}

/// Where a chart needs an older calibration.
pub const NOT_COMPARED: &str = "This needs an older calibration to compare with.";
/// Where a chart needs more than there is.
pub const TOO_FEW: &str = "This needs more views.";
/// Where a chart needs a picture.
pub const NO_PICTURE: &str = "This needs a picture.";
