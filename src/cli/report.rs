//! `boresight report`.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;

use super::{accept_args::AcceptArguments, guide_rig::is_rig, rig, this_command::this_command};
use boresight_app::{
    Announcer, Exit, RESULT_FILE, RIG_RESULT,
    commands::calibration_views::{SessionViews, from_session},
    cores,
    session::{
        certificate::{Circumstances, certificate},
        report::{REPORT_SCHEMA, ReportFile, of_file},
        rig_result::write_rig_page,
        rig_run::saved_rig,
        session_report,
        source::is_session,
    },
};
use boresight_calibrate::{BOARD_SCALE_SD, CalibrationParams};
use boresight_files::{Links, Overwrite, TEXT_LIMIT, read_text, save};
use boresight_formats::{AcceptanceEntry, CalibrationFile, RigFile};
use boresight_present::{
    report::{certificate_pdf, page},
    text::{acceptance::acceptance, of_source, report as words},
};
use boresight_run::config::Config;
use boresight_terminal::{board_args::setting, print, say, usage::WrongUsage};

/// Write a certificate and report of a calibration, to read and print.
///
/// One self-contained HTML file. The first sheet is for your customer, the others are for
/// engineers.
///
/// For a session, rewrites the report in its folder; likewise for several cameras, and for a
/// rig.json. For a calibration.json from `calibrate`, writes a report beside it, with the pictures
/// if they're in the same folder.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// A session folder, a calibration.json, or a rig.json.
    #[arg(value_name = "SESSION|FILE")]
    input: PathBuf,
    #[command(flatten)]
    goal: AcceptArguments,
    /// Settings file. Its table [certificate] fills in the first sheet.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Fill in the first sheet, for example certificate.customer="Mill Ltd". Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = setting)]
    settings: Vec<String>,
    /// Write the certificate only, as a PDF: its front, and a sheet with the numbers.
    #[arg(long)]
    pdf: bool,
    /// File to write [default: report.html in the session, or FILE.html beside the calibration;
    /// with --pdf, report.pdf or FILE.pdf].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Overwrite an existing file.
    #[arg(long)]
    force: bool,
    /// Print the report's path and the verdict as JSON on stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight report sessions/2026-11-21T08-00-00Z
  boresight report sessions/front --config firm.toml --set certificate.customer=\"Mill Ltd\"
  boresight report sessions/front --pdf
  boresight report calibration.json --out site-12.html";

impl Arguments {
    /// The file of several cameras that is named, or in the session that is.
    fn rig(&self) -> Option<PathBuf> {
        if is_rig(&self.input) {
            return Some(self.input.join(RIG_RESULT));
        }
        let text = read_text(&self.input, TEXT_LIMIT, Links::Followed).ok()?;
        let tree = serde_json::from_str(&text).ok()?;
        RigFile::is_one(&tree).then(|| self.input.clone())
    }

    /// Writes the page about the rig in the file `path`.
    fn of_rig(&self, path: &Path) -> anyhow::Result<Exit> {
        if self.pdf || self.goal.says_something() {
            let usage = "a rig has a page only: leave out --pdf, --accept and --board-scale-error"
                .to_owned();
            return Err(WrongUsage(usage).into());
        }
        let rig = rig::read(path).with_context(|| {
            format!("to calibrate it again: boresight calibrate --rig {}", self.input.display())
        })?;
        let page = self.out.clone().unwrap_or_else(|| path.with_extension("html"));
        // A session's own page follows from its result.
        let is_own = self.out.is_none() && path != self.input;
        let may_overwrite = self.force || is_own;
        let overwrite = if may_overwrite { Overwrite::Allowed } else { Overwrite::Never };
        let session = path.parent().filter(|folder| is_rig(folder));
        let saved = session.and_then(|folder| saved_rig(folder, &Announcer::silent()).ok());
        let picture = |name: &str, number| saved.as_ref()?.picture(name, number);
        let stated = Config::load(self.config.as_deref(), &self.settings)?.certificate;
        let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
        let known = Circumstances {
            made: saved.as_ref().and_then(|saved| saved.created.parse().ok()),
            file: Some((path, text.as_bytes())),
            ..Circumstances::default()
        };
        let mut notes = Vec::new();
        let certificate = certificate(&stated, known, &mut notes);
        say(&write_rig_page(&rig, &picture, &certificate, (&page, overwrite))?);
        notes.iter().for_each(|note| say(note));
        if self.json {
            let (schema, page) = (REPORT_SCHEMA.into(), page.display().to_string());
            let written = ReportFile { schema, page, verdict: rig.verdict.clone() };
            print(&serde_json::to_value(&written)?.to_string())?;
        }
        let is_usable = matches!(rig.verdict.as_str(), "good" | "care");
        Ok(if is_usable { Exit::Good } else { Exit::NotTrustworthy })
    }

    pub(super) fn run(self) -> anyhow::Result<Exit> {
        if let Some(rig) = self.rig() {
            return self.of_rig(&rig);
        }
        let session = self.session();
        self.says_what_it_states()?;
        let stated = Config::load(self.config.as_deref(), &self.settings)?.certificate;
        let mut report = match &session {
            Some(path) => session_report::of_folder(path, &stated)?,
            None => of_file(&self.input, this_command(), &stated)?,
        };
        match &session {
            Some(path) if self.goal.says_something() => report.calibration = self.again(path)?,
            Some(_) => {}
            None => self.judge(&mut report.calibration)?,
        }
        let kind = if self.pdf { "pdf" } else { "html" };
        let own = session.map(|path| session_report::page_path(&path).with_extension(kind));
        let (path, overwrite) = match (&self.out, own) {
            // The session's own page follows from its journal.
            (None, Some(own)) => (own, Overwrite::Allowed),
            (out, _) => {
                let path = out.clone().unwrap_or_else(|| self.input.with_extension(kind));
                (path, if self.force { Overwrite::Allowed } else { Overwrite::Never })
            }
        };
        let written = if self.pdf { certificate_pdf(&report)? } else { page(&report).into_bytes() };
        save(&path, &written, overwrite)?;
        for note in &report.notes {
            say(note);
        }
        let calibration = &report.calibration;
        let verdict = words::verdict_of(calibration);
        say(&of_source(calibration.source.as_deref().unwrap_or_default(), verdict));
        let judged = report.calibration.acceptance.as_ref();
        if let Some(judged) = judged {
            say(format!("{}. {}", judged.message, judged.action).trim_end());
        }
        say(&format!("Report: {}", path.display()));
        if self.json {
            let written = ReportFile {
                schema: REPORT_SCHEMA.into(),
                page: path.display().to_string(),
                verdict: report.calibration.verdict.clone(),
            };
            print(&serde_json::to_value(&written)?.to_string())?;
        }
        Ok(match report.calibration.verdict.as_str() {
            "good" | "care" if calibration.is_imported() => Exit::NotTrustworthy,
            "good" | "care" if judged.is_none_or(|judged| judged.met) => Exit::Good,
            _ => Exit::NotTrustworthy,
        })
    }

    /// Calibrates the session at `path` again with the given goal, as `calibrate` does: a goal
    /// affects the verdict and the warnings, too.
    fn again(&self, path: &Path) -> anyhow::Result<CalibrationFile> {
        let silent = Announcer::silent();
        let SessionViews { mut views, noise_floor_px, saved } = from_session(path, &silent)?;
        let mut config = saved.header.config.clone();
        self.goal.apply(&mut config);
        let params = CalibrationParams { threads: cores(), noise_floor_px, ..config.calibration() };
        let (_, file) =
            views.calibrated_with_file(&config.board()?, &params, Some(&saved), &silent);
        Ok(file)
    }

    /// Judges the calibration by the given goal; without a goal, the verdict on its own stays.
    fn judge(&self, calibration: &mut CalibrationFile) -> anyhow::Result<()> {
        let own = calibration.acceptance.as_ref().and_then(|judged| judged.goal.parse().ok());
        let Some(goal) = self.goal.accept.or_else(|| own.filter(|_| self.goal.says_scale())) else {
            return Ok(());
        };
        let scale_sd = self.goal.scale_sd(BOARD_SCALE_SD);
        let judged = calibration
            .judged(goal, scale_sd)
            .context("the goal can't be judged: the file has no calibration with its covariance")?;
        calibration.acceptance = Some(AcceptanceEntry::of(&judged, acceptance(&judged)));
        Ok(())
    }

    /// Rejects settings with an effect on the calibration: a report only states.
    fn says_what_it_states(&self) -> anyhow::Result<()> {
        let key = |setting: &String| setting.split_once('=').map(|(key, _)| key.trim().to_owned());
        let keys = self.settings.iter().filter_map(key);
        let mut others = keys.filter(|key| !key.starts_with("certificate."));
        let Some(other) = others.next() else { return Ok(()) };
        let message = format!(
            "--set {other}: a report uses settings of certificate only. To calibrate with another one: boresight calibrate SESSION --set {other}=… --report FILE"
        );
        Err(WrongUsage(message).into())
    }

    /// Session folder, if the input is a session, or a session's result.
    fn session(&self) -> Option<PathBuf> {
        if self.input.is_dir() {
            return Some(self.input.clone());
        }
        let is_result = self.input.file_name().is_some_and(|name| name == RESULT_FILE);
        let folder = self.input.parent()?;
        (is_result && is_session(folder)).then(|| match folder.as_os_str() {
            here if here.is_empty() => PathBuf::from("."),
            _ => folder.to_path_buf(),
        })
    }
}
