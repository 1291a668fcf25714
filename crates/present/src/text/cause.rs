//! The words of the picture of a cause.

use super::camera::capital;

/// Names of the outlines for a focal length that follows the distance.
pub const BREATHES: [&str; 2] = ["farthest board", "nearest board"];
/// Names of the outlines for a focal length that scatters.
pub const SCATTERED: [&str; 2] = ["some views", "others"];
/// Name of the outline of the other views.
pub const OTHERS: &str = "the other views";
/// Name of the picture's middle.
pub const MIDDLE: &str = "middle";
/// Name of the principal point.
pub const PRINCIPAL: &str = "principal point";

/// Name of the outline of a view.
pub fn view(number: &str) -> String {
    format!("view {number}")
}

/// How much larger everything is in the second outline.
pub fn larger(change: f64) -> String {
    let size = if change < 0.0 { "smaller" } else { "larger" };
    format!("{:.1} % {size}", 100.0 * change.abs())
}

/// How much the size differs between views.
pub fn scatters(relative_sd: f64) -> String {
    format!("Size differs by {:.1} % (sd)", 100.0 * relative_sd)
}

/// How far two points are apart.
pub fn apart(distance_px: f64) -> String {
    format!("{distance_px:.0} px apart")
}

/// Caption of a drawing enlarged by a factor.
pub fn drawn(what: &str, times: f64) -> String {
    let what = capital(what);
    if times > 1.0 { format!("{what}, drawn {times:.0} times as much") } else { what }
}
