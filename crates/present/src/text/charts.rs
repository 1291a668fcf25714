//! The words of the charts on the result page.

/// A chart of the result page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Chart {
    /// Uncertainty of projection over the picture.
    #[default]
    Uncertainty,
    /// Residual of each corner.
    Residuals,
    /// The principal lines around the principal point.
    Lines,
    /// The principal point with views left out.
    Skipped,
    /// The newest picture without distortion.
    Undistorted,
    /// Change since an older calibration.
    Change,
}

impl Chart {
    /// Charts for everybody.
    pub const PLAIN: [Self; 3] = [Self::Uncertainty, Self::Undistorted, Self::Change];
    /// Charts for engineers.
    pub const EXPERT: [Self; 3] = [Self::Residuals, Self::Lines, Self::Skipped];

    /// Name of the chart.
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

    /// Explanation of the chart.
    pub fn tip(self) -> &'static str {
        match self {
            Self::Uncertainty => {
                "Uncertainty (1 sd, px) of a projected point in each part of the picture, ignoring camera rotation."
            }
            Self::Residuals => {
                "From predicted to measured corners, enlarged. If the arrows of a view all point the same way, the board or the lens model is wrong."
            }
            Self::Lines => {
                "Each view's principal line with distortion removed, around the principal point and its 2 sd ellipse. The lines should meet there."
            }
            Self::Skipped => {
                "Where the principal lines meet when one, two or three neighbouring views are left out. Scatter shows how much single views matter, not how accurate the point is."
            }
            Self::Undistorted => {
                "The newest picture with distortion removed: straight edges must look straight."
            }
            Self::Change => {
                "How far each point has shifted since the older calibration, enlarged. All the same way: the principal point moved. Outwards or inwards: the focal length changed."
            }
        }
    }
}

/// Heading of the charts for engineers.
pub const MORE: &str = "Residuals and lines";

/// Below the chart of uncertainty.
pub fn uncertainty_scale(mean_px: f64, max_px: f64) -> String {
    format!("{mean_px:.3} px on average, {max_px:.3} px at worst")
}

/// Below the chart of residuals.
pub fn residual_scale(times: f64, rms_px: f64) -> String {
    format!("enlarged {times:.0}×; {rms_px:.3} px RMS")
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
    format!("{}; one view left out: {one} points, two: {two}, three: {three}", width(width_px))
}

/// Below the chart of a change.
pub fn change_scale(times: f64, most_px: f64, matters_px: f64) -> String {
    format!("enlarged {times:.0}×; up to {most_px:.2} px (limit {matters_px:.2} px)")
}

/// Note in place of a chart that needs an older calibration.
pub const NOT_COMPARED: &str = "Compare with an older calibration to see this.";
/// Note in place of a chart that needs more views.
pub const TOO_FEW: &str = "Take more views to see this.";
/// Note in place of a chart that needs a picture.
pub const NO_PICTURE: &str = "No picture yet.";
