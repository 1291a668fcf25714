//! Words of a session on a terminal.

use super::{deg, percent};

/// Tilt and size, measured (if known) and requested: "tilt 19° → 40°  size 60 → 74 %".
pub fn pose(
    (tilt_rad, wanted_tilt_rad): (Option<f64>, f64),
    (size, wanted_size): (Option<f64>, f64),
) -> String {
    let tilt = tilt_rad.map_or("–".into(), |tilt_rad| format!("{}°", deg(tilt_rad)));
    let size = size.map_or("–".into(), |size| format!("{:.0}", 100.0 * size));
    format!("tilt {tilt} → {}°  size {size} → {}", deg(wanted_tilt_rad), percent(wanted_size))
}

/// Numbers of views taken and still to take.
pub fn views(taken: usize, to_go: Option<usize>) -> String {
    match to_go {
        Some(to_go) => format!("{taken} taken, about {to_go} more"),
        None => format!("{taken} taken"),
    }
}

/// Keys of the session; `can_restore` if a removed view can be restored.
pub fn keys(is_paused: bool, can_restore: bool) -> String {
    let pause = if is_paused { "resume" } else { "pause" };
    let redo = if can_restore { "  r redo" } else { "" };
    format!("p {pause}  u undo{redo}  t take now  q finish")
}

/// Key that shows the QR code for a phone.
pub const CODE: &str = "c code for a phone";
/// Way back from the code.
pub const CODE_BACK: &str = "c back to the session";

/// A word quoted for a shell.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_./:=,@%+-".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_fits_beside_the_drawing() {
        let line = pose((Some(0.33), 0.7), (Some(0.6), 0.74));
        assert_eq!(line, "tilt 19° → 40°  size 60 → 74 %");
        assert!(
            [line, views(10, Some(14)), keys(true, true)].iter().all(|it| it.chars().count() <= 48)
        );
    }

    #[test]
    fn words_are_quoted_where_a_shell_needs_it() {
        assert_eq!(quoted("pictures/0.png"), "pictures/0.png");
        assert_eq!(quoted("my picture.png"), "'my picture.png'");
        assert_eq!(quoted("it's; rm *"), r"'it'\''s; rm *'");
        assert_eq!(quoted(""), "''");
    }
}
