//! A text as a QR code, on a screen or on paper.

use qrcodegen::QrCodeEcc;

/// Width of the quiet zone in modules, as required by ISO/IEC 18004: a dark window may begin beside
/// it.
const QUIET: i32 = 4;

/// QR code: dark modules on a light background, with the quiet zone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QrCode {
    side: usize,
    dark: Vec<bool>,
}

impl QrCode {
    /// QR code of `text` for a screen; `None` if the text is too long.
    pub fn of(text: &str) -> Option<Self> {
        Self::with(text, QrCodeEcc::Low)
    }

    /// As [`Self::of`], readable with a stain or a fold.
    pub fn on_paper(text: &str) -> Option<Self> {
        Self::with(text, QrCodeEcc::Medium)
    }

    fn with(text: &str, correction: QrCodeEcc) -> Option<Self> {
        let code = qrcodegen::QrCode::encode_text(text, correction).ok()?;
        let range = -QUIET..code.size() + QUIET;
        let dark = range
            .clone()
            .flat_map(|y| range.clone().map(move |x| (x, y)))
            .map(|(x, y)| code.get_module(x, y))
            .collect();
        Some(Self { side: usize::try_from(code.size() + 2 * QUIET).ok()?, dark })
    }

    /// Number of modules along a side.
    pub fn side(&self) -> usize {
        self.side
    }

    /// True for a dark module; modules outside are light.
    pub fn is_dark(&self, x: usize, y: usize) -> bool {
        x < self.side && self.dark.get(y * self.side + x).copied().unwrap_or(false)
    }

    /// Columns and rows of the dark modules.
    pub fn dark(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let all = (0..self.side * self.side).map(|module| [module % self.side, module / self.side]);
        all.filter(|[x, y]| self.is_dark(*x, *y))
    }

    /// QR code in letters, two modules per letter, light modules filled: for a terminal with a dark
    /// background. Most readers accept it on a light background, too.
    pub fn lines(&self) -> Vec<String> {
        (0..self.side)
            .step_by(2)
            .map(|y| {
                (0..self.side)
                    .map(|x| {
                        match (self.is_dark(x, y), self.is_dark(x, y + 1) || y + 1 >= self.side) {
                            (false, false) => '█',
                            (false, true) => '▀',
                            (true, false) => '▄',
                            (true, true) => ' ',
                        }
                    })
                    .collect()
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_fits_into_a_terminal() {
        let link = format!("http://192.168.100.200:8417/#{}", "A".repeat(43));
        let code = QrCode::of(&link).expect("short enough");
        let lines = code.lines();
        assert!(lines.len() <= 24 && code.side() <= 48, "{}", code.side());
        assert!(lines.iter().all(|line| line.chars().count() == code.side()));
        assert!(code.is_dark(4, 4) && !code.is_dark(3, 3) && !code.is_dark(99, 0));
        assert!(QrCode::of(&"x".repeat(10_000)).is_none());
    }
}
