//! The words of the charts on the result page and in the report.

use super::view_name;
use crate::{chart::Axes, reading::fit::Ring};
use boresight_guide::session::ViewNumber;

/// Chart of the result page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Chart {
    /// Uncertainty of projection over the picture.
    #[default]
    Uncertainty,
    /// Residual of each corner.
    Residuals,
    /// Principal lines around the principal point.
    Lines,
    /// Principal point with views left out.
    Skipped,
    /// Newest picture without distortion.
    Undistorted,
    /// Change since an older calibration.
    Change,
    /// Residual of each view, with the worst view's picture.
    Views,
    /// Boards and field of view in space.
    Poses,
    /// Cloud and histogram of the residuals.
    Scatter,
    /// Residuals against the distance from the principal point.
    Radius,
    /// Uncertainty of a point against its distance.
    Distance,
    /// Correlations of the lens parameters.
    Correlations,
}

impl Chart {
    /// Charts for everyone.
    pub const PLAIN: [Self; 5] =
        [Self::Uncertainty, Self::Views, Self::Poses, Self::Undistorted, Self::Change];
    /// Charts for engineers.
    pub const EXPERT: [Self; 7] = [
        Self::Residuals,
        Self::Scatter,
        Self::Radius,
        Self::Distance,
        Self::Correlations,
        Self::Lines,
        Self::Skipped,
    ];

    /// Name of the chart.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uncertainty => super::numbers::TYPICAL_ERROR,
            Self::Residuals => "Residuals",
            Self::Lines => "Principal lines",
            Self::Skipped => "Views left out",
            Self::Undistorted => "Undistorted",
            Self::Change => "Change",
            Self::Views => "Fit of views",
            Self::Poses => "Poses",
            Self::Scatter => "Scatter",
            Self::Radius => "From the middle out",
            Self::Distance => "At a distance",
            Self::Correlations => "Correlations",
        }
    }

    /// Explanation of the chart.
    pub fn tip(self) -> &'static str {
        match self {
            Self::Uncertainty => "Typical error in each part of the picture, in pixels.",
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
                "The newest picture before and after: with distortion removed, straight edges must look straight."
            }
            Self::Change => {
                "How far each point has shifted since the older calibration, enlarged. All the same way: the principal point moved. Outwards or inwards: the focal length changed."
            }
            Self::Views => {
                "How well each view fits: its corners are this far from where the calibration expects them (RMS, px)."
            }
            Self::Poses => {
                "Where the board was, seen from above and the side: boards all over the camera's field, tipped in all directions, are best."
            }
            Self::Scatter => {
                "How far each corner is off, and how often. It should be a round cloud, and bars that follow the curve."
            }
            Self::Radius => {
                "How far each corner is off towards the picture's edge, by its distance from the principal point. Solid: mean of a ring, should be near zero, else the lens model misses something there. Dashed: RMS."
            }
            Self::Distance => {
                "How far a point at that distance may be beside where the camera says (1 sd), by the lens alone."
            }
            Self::Correlations => {
                "Which parameters of the lens change together: near 1 or −1, one makes up for the other."
            }
        }
    }
}

/// Heading of a report's charts for a screen.
pub const FIT: &str = "How the views fit";
/// Note in place of a report's chart whose numbers are missing from the file.
pub const NOT_KNOWN: &str = "Not shown: this file doesn't have its numbers.";

/// Axes of the bars of the views.
pub const VIEWS_AXES: Axes<'_> = Axes { x: "view", y: "RMS in px", pixels: false };
/// Axes of the cloud of residuals.
pub const OFF_AXES: Axes<'_> = Axes { x: "x off in px", y: "y off in px", pixels: true };
/// Axes of the histogram of residuals.
pub const OFTEN_AXES: Axes<'_> = Axes { x: "x or y off in px", y: "how often", pixels: false };
/// Axes of the residuals from the middle out.
pub const RADIUS_AXES: Axes<'_> =
    Axes { x: "px from the principal point", y: "off outwards in px", pixels: false };
/// Axes of the uncertainty at a distance.
pub const DISTANCE_AXES: Axes<'_> =
    Axes { x: "distance in m", y: "off to the side in mm", pixels: false };

/// Heading of the charts for engineers.
pub const MORE: &str = "Residuals and lines";

/// Note below the chart of uncertainty.
pub fn uncertainty_scale(mean_px: f64, max_px: f64) -> String {
    format!("{mean_px:.3} px on average, {max_px:.3} px at worst")
}

/// Legend of amber cells.
pub const BEYOND_GOAL: &str = "misses it, or no board was there";

/// Slider from the original picture to the picture without distortion.
pub const AFTER: &str = "Distortion removed";

/// Name of a view in a chart.
pub fn view(number: &str) -> String {
    format!("View {number}")
}

/// Note below the picture of the worst-fitting view.
pub fn worst(view: &str) -> String {
    format!("{view} fits worst")
}

/// Line at the error of all views.
pub fn all_views(rms_px: f64) -> String {
    format!("all views: {rms_px:.3} px")
}

/// Note below the picture of a view with its residuals.
pub fn arrows(view: &str, times: f64) -> String {
    format!("{view}: arrows enlarged {times:.0}×")
}

/// Tooltip of the button that leaves out a view.
pub const LEAVE_OUT_TIP: &str = "Calibrate again without this view. You can put it back.";

/// Button to calibrate without a view.
pub fn leave_out(number: ViewNumber) -> String {
    format!("Leave out {}", view_name(number))
}

/// Button to calibrate with a view that was left out.
pub fn put_back(number: ViewNumber) -> String {
    format!("Put back {}", view_name(number))
}

/// Button to choose the view before the chosen one.
pub const PREVIOUS: &str = "Previous view";
/// Button to choose the view after the chosen one.
pub const NEXT: &str = "Next view";

/// Note below the bars: distance of the worst view from the rest.
pub fn per_view(times: f64) -> String {
    format!("The largest error is {times:.1} times the usual one")
}

/// Note below the cloud of residuals.
pub fn scatter(corners: usize, rms_px: f64) -> String {
    format!("{corners} corners, {rms_px:.3} px RMS; rings at 1 and 2 times that")
}

/// Note below the residuals from the middle out.
pub fn by_radius(rings: &[Ring]) -> String {
    let [Some(inner), Some(outer)] = [rings.first(), rings.last()] else { return String::new() };
    let means = rings.iter().map(|ring| ring.mean_px.abs());
    format!(
        "{:.3} px RMS in the middle, {:.3} px outermost; a ring's mean is off by up to {:.3} px",
        inner.rms_px,
        outer.rms_px,
        means.fold(0.0, f64::max)
    )
}

/// Note below the drawing of the poses.
pub fn poses(views: usize, nearest_m: f64, farthest_m: f64) -> String {
    format!("{views} boards, {nearest_m:.2} to {farthest_m:.2} m away; grey: what the camera sees")
}

/// Hint on the bars, which choose a view in the window.
pub const CLICK: &str = "click a bar or a board to see its view";

/// Hint on the drawing of the poses, which turns in the window.
pub const DRAG: &str = "drag to turn";

/// Label of the curve of the mean over the picture.
pub const MEAN: &str = "on average";
/// Label of the curve of the worst place in the picture.
pub const WORST_PLACE: &str = "at worst";

/// Note below the curves of uncertainty against distance.
pub fn at_a_distance(mean_m: f64, worst_m: f64) -> String {
    let [mean_mm, worst_mm] = [mean_m, worst_m].map(|length_m| 1e3 * length_m);
    format!("At 1 m: {mean_mm:.3} mm on average, {worst_mm:.3} mm at worst")
}

/// Power of ten, at an axis.
pub fn millimetres(length_m: f64) -> String {
    format!("{} mm", (1e12 * length_m).round() / 1e9)
}

/// Note below the correlations.
pub fn strongest(one: &str, other: &str, value: f64) -> String {
    format!("Strongest: {one} and {other}, {value:.2}")
}

/// Note below the chart of residuals.
pub fn residual_scale(times: f64, rms_px: f64) -> String {
    format!("enlarged {times:.0}×; {rms_px:.3} px RMS")
}

/// Note below a chart of the surroundings of the principal point.
pub fn width(width_px: f64) -> String {
    if width_px >= 10.0 {
        format!("{width_px:.0} px wide")
    } else {
        format!("{width_px:.2} px wide")
    }
}

/// Note below the chart of views left out.
pub fn skipped_scale(width_px: f64, counts: [usize; 3]) -> String {
    let [one, two, three] = counts;
    format!("{}; one view left out: {one} points, two: {two}, three: {three}", width(width_px))
}

/// Note below the chart of a change.
pub fn change_scale(times: f64, most_px: f64, matters_px: f64) -> String {
    format!("enlarged {times:.0}×; up to {most_px:.2} px (limit {matters_px:.2} px)")
}

/// Note in place of a chart of changes, without an older calibration.
pub const NOT_COMPARED: &str = "Compare with an older calibration to see this.";
/// Note in place of a chart, with too few views.
pub const TOO_FEW: &str = "Take more views to see this.";
/// Note in place of a chart, without a picture.
pub const NO_PICTURE: &str = "No picture yet.";
