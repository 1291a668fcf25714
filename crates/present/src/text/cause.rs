//! The words of the picture of a cause.

/// Names of the outlines for a focal length that follows the distance.
pub const BREATHES: [&str; 2] = ["farthest board", "nearest board"];
/// Names of the outlines for a focal length that scatters.
pub const SCATTERED: [&str; 2] = ["some views", "others"];
/// Name of the outline of the other views.
pub const OTHERS: &str = "the other views";

/// Name of the outline of a view.
pub fn view(number: &str) -> String {
    format!("view {number}")
}

/// How much larger everything is in the second outline, and how often that is enlarged.
pub fn larger(change: f64, times: f64) -> String {
    let (percent, size) = (100.0 * change.abs(), if change < 0.0 { "smaller" } else { "larger" });
    let drawn = if times > 1.0 { format!(", drawn {times:.0} times as much") } else { "".into() };
    format!("{percent:.1} % {size}{drawn}")
}
