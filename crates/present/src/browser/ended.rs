//! The result as shown on a page.

use std::sync::Arc;

use serde::Serialize;

use super::ValidMap;
use crate::{
    grade::Grade,
    known::Known,
    result_card::ResultCard,
    text::{self, phone as words},
};
use boresight_calibrate::NotCalibrated;
use boresight_formats::{CalibrationFile, JudgementFile, RigFile, RigPairEntry};
use boresight_guide::session::Session;

/// Result as shown on a page.
#[derive(Clone, Debug, Default, Serialize)]
pub struct EndedPage {
    /// `good`, `care`, `unfinished`, `bad`, or `none` without a calibration.
    pub verdict: &'static str,
    /// Verdict in words.
    pub what: String,
    /// Next action.
    pub action: String,
    /// Spoken verdict, six words at most.
    pub aloud: &'static str,
    /// Names and values.
    pub lines: Vec<(String, String)>,
    /// Findings with actions.
    pub findings: Vec<(String, String)>,
    /// Picture size.
    pub image_size_px: [u32; 2],
    /// Map of the valid area; `None` if unknown.
    pub map: Option<ValidMap>,
    /// Drawing of the cause of an untrustworthy result, and its caption.
    pub cause: Option<[String; 2]>,
    /// True if the page may start another session.
    pub can_restart: bool,
    /// True if this session can continue with two more views.
    pub can_go_on: bool,
    /// Files offered for download.
    pub files: Vec<PageFile>,
}

/// Downloadable file, in memory.
#[derive(Clone, Debug, Serialize)]
pub struct PageFile {
    /// File name for saving.
    pub name: String,
    /// Label on the button.
    pub label: String,
    /// Media type.
    #[serde(skip)]
    pub media_type: &'static str,
    /// Contents.
    #[serde(skip)]
    pub bytes: Arc<[u8]>,
}

impl PageFile {
    /// File with these contents.
    pub fn new(name: &str, label: &str, media_type: &'static str, bytes: Vec<u8>) -> Self {
        Self { name: name.to_owned(), label: label.to_owned(), media_type, bytes: bytes.into() }
    }
}

impl EndedPage {
    /// Page about a session whose views judged a calibration, as told by `judged`.
    #[must_use]
    pub fn judged(mut self, judged: &JudgementFile) -> Self {
        let (verdict, aloud) = words::judged(&judged.answer);
        let doubts = judged.doubts.iter().map(|doubt| (doubt.clone(), String::new()));
        self.findings.splice(0..0, doubts);
        let (what, action) = (judged.message.clone(), judged.action.clone());
        // The map is that of the fresh lens.
        Self { verdict, aloud, what, action, map: None, cause: None, ..self }
    }

    /// Page about the finished session of several cameras with the file `result`, if any. Numbers
    /// of a rig that isn't to be used are left out.
    pub fn of_rig(result: Option<&RigFile>, grade: Option<Grade>, files: Vec<PageFile>) -> Self {
        let findings = result.iter().flat_map(|rig| &rig.findings);
        let usable = result.filter(|_| grade.is_some_and(|it| it != Grade::NotTrustworthy));
        let pairs = usable.iter().flat_map(|rig| &rig.pairs).filter(|pair| pair.instants > 0);
        let graded = result.filter(|_| grade.is_some());
        Self {
            verdict: grade.map_or("none", code),
            aloud: grade.map_or(words::NO_CALIBRATION, words::aloud),
            what: graded.map_or_else(|| words::NO_CALIBRATION.into(), text::rig::verdict),
            action: findings.clone().next().map_or(String::new(), |first| first.action.clone()),
            findings: findings.map(|it| (it.message.clone(), it.action.clone())).collect(),
            lines: pairs
                .map(|RigPairEntry { of: [a, b], baseline_m, baseline_sd_m, .. }| {
                    (text::rig::pair_name(a, b), text::rig::baseline(*baseline_m, *baseline_sd_m))
                })
                .collect(),
            files,
            ..Self::default()
        }
    }

    /// Page about the finished `session` with the calibration file `result`.
    pub fn of(session: &Session, result: &CalibrationFile, files: Vec<PageFile>) -> Self {
        let source = result.source.as_deref().unwrap_or_default();
        let image_size = session.setup().image_size;
        let image_size_px = [image_size.width_px, image_size.height_px];
        let page = Self { image_size_px, files, ..Self::default() };
        let Some(calibration) = session.calibration() else {
            let reason = session.not_calibrated().unwrap_or(&NotCalibrated::NoViews);
            let (what, action) = text::not_calibrated(reason, &[]);
            return Self {
                verdict: "none",
                aloud: words::NO_CALIBRATION,
                what: text::of_source(source, words::NO_CALIBRATION),
                action: format!("{what}. {action}"),
                ..page
            };
        };
        let number = |place: usize| session.accepted().get(place).map(|view| view.number);
        let card = ResultCard::of_result(calibration, session.limits(), &number);
        let findings: Vec<_> = calibration
            .findings
            .iter()
            .map(|finding| {
                let (what, action) = text::finding_in_session(finding, &number);
                (what, action.to_owned())
            })
            .collect();
        let known = Known::of_file(result);
        Self {
            verdict: code(card.grade),
            aloud: words::aloud(card.grade),
            what: text::of_source(source, text::verdict_on(calibration)),
            action: format!(
                "{}. {} {}",
                text::session_news::ending(session),
                card.what,
                card.action
            ),
            findings,
            lines: text::result::result_lines(calibration, known.as_ref().and_then(Known::met))
                .into_iter()
                .map(|(name, value)| (name.to_owned(), value))
                .collect(),
            cause: card.cause.map(|cause| [cause.svg(image_size, None), cause.caption]),
            map: known.and_then(|known| ValidMap::of(calibration, &known)),
            ..page
        }
    }
}

/// Name of a grade in the page's style.
fn code(grade: Grade) -> &'static str {
    match grade {
        Grade::NotTrustworthy => "bad",
        other => other.code(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_judgement_leads_the_page() {
        let judged = |answer: &str| JudgementFile {
            answer: answer.into(),
            message: "OFF by 5.00 px".into(),
            action: "Use another".into(),
            doubts: vec!["It states no distortion".into()],
            ..JudgementFile::default()
        };
        let own = ("Few views".to_owned(), "Take more.".to_owned());
        let page = EndedPage { findings: vec![own.clone()], ..EndedPage::default() };
        let page = page.judged(&judged("off"));
        assert_eq!(
            (page.verdict, &*page.what, &*page.action),
            ("bad", "OFF by 5.00 px", "Use another")
        );
        assert_eq!(page.findings, [("It states no distortion".to_owned(), String::new()), own]);
        let verdicts = ["true", "cannot-tell"]
            .map(|answer| EndedPage::default().judged(&judged(answer)).verdict);
        assert_eq!(verdicts, ["good", "care"]);
    }
}
