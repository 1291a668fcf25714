//! Texts in a PDF's own fonts: widths, lines and letters.

/// Height of a line, in type sizes.
pub(super) const LINE: f32 = 1.35;
/// Widths of Helvetica's letters from the space to the tilde, in thousandths of the type size.
#[rustfmt::skip]
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556,
    556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667,
    611, 778, 722, 278, 500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667,
    667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500,
    222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];
/// Width of a bold letter, in widths of the usual one, at most.
const BOLD: f32 = 1.1;

/// Type size, bold, colour.
pub(super) type Style = (f32, bool, [f32; 3]);

/// Width of a text; a bold one has at most this width.
pub(super) fn wide(text: &str, (size, bold, _): Style) -> f32 {
    let letter = |letter: char| {
        let place = (u32::from(letter) as usize).checked_sub(32);
        place.and_then(|place| WIDTHS.get(place)).map_or(584.0, |width| f32::from(*width))
    };
    let bold = if bold { BOLD } else { 1.0 };
    1e-3 * size * bold * text.chars().map(letter).sum::<f32>()
}

/// Lines of `text` of at most `most` points. A longer word is cut.
pub(super) fn lines(text: &str, most: f32, style: Style) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if wide(&format!("{line} {word}"), style) <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(String::new()),
        }
        if let Some(line) = lines.last_mut().filter(|line| line.is_empty()) {
            let mut rest = word;
            while wide(rest, style) > most {
                let end = rest
                    .char_indices()
                    .map(|(at, _)| at)
                    .take_while(|at| wide(&rest[..*at], style) <= most)
                    .last();
                let end = end.filter(|end| *end > 0).unwrap_or(rest.len());
                line.push_str(&rest[..end]);
                line.push('\n');
                rest = &rest[end..];
            }
            line.push_str(rest);
        }
    }
    lines.iter().flat_map(|line| line.split('\n')).map(Into::into).collect()
}

/// Bytes of `text` in the fonts' code; `None` for a letter that they lack. Signs of comparison
/// become words, and there is no Greek.
pub(super) fn encoded(text: &str) -> Option<Vec<u8>> {
    let text = text.replace('χ', "chi").replace('≤', "at most").replace('≥', "at least");
    text.chars().map(in_windows_1252).collect()
}

/// Byte of a letter in Windows' Western code page, which PDF's WinAnsiEncoding is.
fn in_windows_1252(letter: char) -> Option<u8> {
    match u32::from(letter) {
        code @ (0x20..=0x7e | 0xa0..=0xff) => u8::try_from(code).ok(),
        0x20ac => Some(0x80),
        0x2026 => Some(0x85),
        0x2018 => Some(0x91),
        0x2019 => Some(0x92),
        0x201c => Some(0x93),
        0x201d => Some(0x94),
        0x2013 => Some(0x96),
        0x2014 => Some(0x97),
        // Minus.
        0x2212 => Some(b'-'),
        _ => None,
    }
}
