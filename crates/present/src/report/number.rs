//! Number formatting for the page: as many digits as the uncertainty justifies, and all digits
//! beside them.

use crate::chart::escaped;

/// Number of decimals for two digits of `sd`.
pub(super) fn decimals(sd: f64) -> usize {
    if !(sd > 0.0 && sd.is_finite()) {
        return 2;
    }
    // Between 0 and 9 after clamping.
    (1.0 - libm::log10(sd).floor()).clamp(0.0, 9.0) as usize
}

/// Number with `decimals` decimals; all digits are in its `value`.
pub(super) fn plain(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return text(value, decimals);
    }
    format!("<data value=\"{value}\">{}</data>", text(value, decimals))
}

/// Text of a number with a typographic minus sign, and no minus before zero.
pub(super) fn text(value: f64, decimals: usize) -> String {
    // Of a file with numbers that no camera has.
    if !value.is_finite() {
        return "\u{2013}".into();
    }
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.into(),
        Some(digits) => format!("\u{2212}{digits}"),
        None => text,
    }
}

/// About `digits` significant digits, for numbers between a hundred-thousandth and millions.
pub(super) fn brief(value: f64, digits: i32) -> String {
    text(value, brief_decimals(value, digits))
}

/// Text of [`brief`], with all digits in `value`.
pub(super) fn brief_data(value: f64, digits: i32) -> String {
    plain(value, brief_decimals(value, digits))
}

fn brief_decimals(value: f64, digits: i32) -> usize {
    if value == 0.0 || !value.is_finite() {
        return 0;
    }
    (f64::from(digits) - 1.0 - libm::log10(value.abs()).floor()).clamp(0.0, 6.0) as usize
}

/// `value ± sd`, or the value alone without a standard deviation; both with all digits in their
/// `value`.
pub(super) fn measured(value: f64, sd: Option<f64>) -> String {
    let Some(sd) = sd else { return plain(value, 2) };
    let decimals = decimals(sd);
    format!("{} ± {}", plain(value, decimals), plain(sd, decimals))
}

/// Table row: name, and cells in HTML.
pub(super) fn row(name: &str, cells: &[String]) -> String {
    let cells: String = cells.iter().map(|cell| format!("<td class=\"n\">{cell}</td>")).collect();
    format!("<tr><th scope=\"row\">{}</th>{cells}</tr>\n", escaped(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_uncertainty() {
        let text = |value, sd| measured(value, Some(sd));
        assert!(text(653.41234, 0.012).contains(">653.412</data> ± <"));
        assert!(text(653.41234, 0.012).contains("value=\"653.41234\""));
        assert!(text(653.41234, 3.1).contains(">653.4</data>"));
        assert!(text(653.41234, 31.0).contains(">653</data>"));
        assert!(text(-0.12, 0.001).contains(">\u{2212}0.1200</data>"));
        assert!(text(0.0, 0.0).contains(">0.00</data>"));
        assert_eq!(measured(1.5, None), "<data value=\"1.5\">1.50</data>");
        assert_eq!(super::text(-0.001, 2), "0.00");
        assert_eq!(brief(0.012345, 2), "0.012");
        assert_eq!(brief(1234.5, 2), "1234");
    }
}
