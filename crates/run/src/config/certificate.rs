//! Statements of the report's first sheet beside the numbers.

use std::path::{Component, Path};

use serde::{Deserialize, Serialize};

/// Most letters of a text.
const LETTERS: usize = 200;

/// The certificate. An empty text is left for filling in by pen.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "explained in default.toml")]
pub struct CertificateConfig {
    pub number: String,
    pub company: String,
    pub logo: String,
    pub customer: String,
    pub site: String,
    pub operator: String,
    pub camera_make: String,
    pub camera_model: String,
    pub camera_serial: String,
    pub lens: String,
    pub board_id: String,
    pub square_measured: String,
    pub check_months: u32,
}

impl Default for CertificateConfig {
    fn default() -> Self {
        Self {
            number: String::new(),
            company: String::new(),
            logo: String::new(),
            customer: String::new(),
            site: String::new(),
            operator: String::new(),
            camera_make: String::new(),
            camera_model: String::new(),
            camera_serial: String::new(),
            lens: String::new(),
            board_id: String::new(),
            square_measured: String::new(),
            check_months: 12,
        }
    }
}

impl CertificateConfig {
    /// True if no text is too long to print.
    pub fn is_usable(&self) -> bool {
        let short = |text: &&mut String| text.chars().count() <= LETTERS;
        self.check_months <= 120 && self.clone().texts().iter().all(short)
    }

    /// Removes a logo outside the working folder: another person's session could name any picture
    /// of the machine.
    pub fn take_foreign_logo(&mut self) -> Option<String> {
        let is_below = |part: Component<'_>| matches!(part, Component::Normal(_));
        let is_own = Path::new(&self.logo).components().all(is_below);
        (!is_own).then(|| std::mem::take(&mut self.logo))
    }

    /// The certificate, with `base` in place of empty texts.
    #[must_use]
    pub fn over(mut self, mut base: Self) -> Self {
        if self.check_months == Self::default().check_months {
            self.check_months = base.check_months;
        }
        for (text, below) in self.texts().into_iter().zip(base.texts()) {
            if text.is_empty() {
                *text = std::mem::take(below);
            }
        }
        self
    }

    fn texts(&mut self) -> [&mut String; 12] {
        [
            &mut self.number,
            &mut self.company,
            &mut self.logo,
            &mut self.customer,
            &mut self.site,
            &mut self.operator,
            &mut self.camera_make,
            &mut self.camera_model,
            &mut self.camera_serial,
            &mut self.lens,
            &mut self.board_id,
            &mut self.square_measured,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_later_wins_and_the_rest_stays() {
        let base = CertificateConfig {
            customer: "Mill".into(),
            site: "Hall 1".into(),
            check_months: 6,
            ..CertificateConfig::default()
        };
        let later = CertificateConfig { site: "Hall 2".into(), ..CertificateConfig::default() };
        let both = later.over(base);
        assert_eq!((both.customer.as_str(), both.site.as_str()), ("Mill", "Hall 2"));
        assert_eq!((both.check_months, both.number.as_str()), (6, ""));
    }
}
