//! The experiments of the source paper, and strategies of guidance compared.

#![forbid(unsafe_code)]

use std::{path::PathBuf, process::ExitCode};

use anyhow::{Context, bail};
use clap::{Parser, ValueEnum};

use boresight_app::Exit;
use boresight_files::{Links, TEXT_LIMIT, read_text};
use boresight_lab::{EXPERIMENTS, Outcome, Params, StudyFolder, guidance, page};
use boresight_terminal::{print, progress::Progress, say};

fn main() -> ExitCode {
    match Arguments::parse().run() {
        Ok(exit) => exit.into(),
        Err(err) => {
            let hint =
                boresight_app::explain(&err).map_or(String::new(), |hint| format!("\n{hint}"));
            say(&format!("boresight-study: {err:#}{hint}"));
            Exit::Failed.into()
        }
    }
}

/// Repeat the source paper's experiments with known true values.
///
/// Also compares guidance strategies.
///
/// Writes index.html, which lists each claim, measurement and verdict, with one CSV per table and
/// one SVG per figure. The same parameters and seed give the same files. Start an interrupted study
/// again with the same --out to continue. Exits with 3 if a known value is not reproduced.
#[derive(Debug, Parser)]
#[command(name = "boresight-study", version, after_help = EXAMPLES)]
struct Arguments {
    /// Experiments to run [default: all].
    #[arg(value_name = "EXPERIMENT")]
    experiments: Vec<Name>,
    /// Folder for the results.
    #[arg(long, value_name = "DIR", default_value = "study")]
    out: PathBuf,
    /// Parameters (TOML) [default: the paper's values; --print-params shows them all].
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    /// Random seed.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Detect corners in rendered pictures instead of computing them (directionality, monotonicity,
    /// pairs).
    #[arg(long)]
    rendered: bool,
    /// Print the parameters as TOML and exit.
    #[arg(long)]
    print_params: bool,
    /// Print one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight-study --out study
  boresight-study skip table1 --seed 2 --out skip2
  boresight-study --print-params > params.toml";

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Name {
    /// Which shifts move a principal line off the principal point? (Fig. 2)
    Directionality,
    /// How does the offset grow with the shift? (Fig. 3)
    Monotonicity,
    /// Does the opposed pose cancel it? (Figs 4 and 5)
    Pairs,
    /// What happens when slots are left out, compared with Zhang's method? (Fig. 6)
    Skip,
    /// Can the scatter of estimates tell which method is right? (Table 1)
    Table1,
    /// Which tilt is best?
    Tilt,
    /// What if the focal length changes between views?
    VaryingFocal,
    /// How good is each guidance strategy?
    Guidance,
}

impl Arguments {
    fn run(self) -> anyhow::Result<Exit> {
        let params = self.parameters()?;
        let text =
            toml::to_string(&params).context("the parameters could not be written as TOML")?;
        if self.print_params {
            print(text.trim_end())?;
            return Ok(Exit::Good);
        }
        let folder = StudyFolder::open(&self.out, &text)?;
        let wanted = |name: &str| {
            let is = |n: &Name| n.to_possible_value().is_some_and(|value| value.get_name() == name);
            self.experiments.is_empty() || self.experiments.iter().any(is)
        };
        let mut outcomes = Vec::new();
        // Earlier results in this folder stay on its page.
        let shown = |name: &str| wanted(name) || folder.is_done(name);
        let experiments: Vec<_> = EXPERIMENTS.into_iter().filter(|(name, _)| shown(name)).collect();
        let progress = Progress::of_long_steps("study", experiments.len());
        for (name, experiment) in experiments {
            progress.now(name);
            let outcome = folder.part(name, || Some(experiment(&params)))?;
            progress.step();
            progress.say(&summary(&outcome));
            outcomes.push(outcome);
        }
        progress.finish();
        let raced = || guidance::parts(&params).iter().all(|part| folder.is_done(&part.name()));
        if wanted("guidance") || raced() {
            let outcome = guidance_outcome(&folder, &params)?;
            say(&summary(&outcome));
            outcomes.push(outcome);
        }
        for outcome in &outcomes {
            for table in &outcome.tables {
                folder.write(&format!("{}.csv", table.name), table.csv().as_bytes())?;
            }
            for figure in &outcome.figures {
                folder.write(&format!("{}.svg", figure.name), figure.svg.as_bytes())?;
            }
        }
        folder.write("index.html", page::page(&outcomes, params.seed).as_bytes())?;
        let (passed, total) = page::tally(&outcomes);
        let index = self.out.join("index.html");
        say(&format!("{passed} of {total} known values reproduced"));
        say(&format!("Result: {}", index.display()));
        if self.json {
            let report = serde_json::json!({
                "schema": "boresight.study/1", "page": index.display().to_string(), "seed": params.seed,
                "reproduced": passed, "known": total,
                "experiments": outcomes.iter().map(report).collect::<Vec<_>>(),
            });
            print(&report.to_string())?;
        }
        Ok(if passed == total { Exit::Good } else { Exit::NotTrustworthy })
    }

    fn parameters(&self) -> anyhow::Result<Params> {
        let mut params = match &self.params {
            None => Params::default(),
            Some(path) => {
                let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
                toml::from_str(&text).with_context(|| {
                    format!("{} is no parameter file; --print-params shows one", path.display())
                })?
            }
        };
        params.seed = self.seed.unwrap_or(params.seed);
        params.rendered |= self.rendered;
        if let Some(problem) = params.problem() {
            bail!("{problem}");
        }
        Ok(params)
    }
}

fn guidance_outcome(folder: &StudyFolder, params: &Params) -> anyhow::Result<Outcome> {
    let parts = guidance::parts(params);
    let all = parts.len() * params.guidance_runs;
    let progress = Progress::of_long_steps("guidance", all);
    let mut runs = Vec::with_capacity(parts.len());
    for part in parts {
        let done: guidance::Runs =
            folder.part(&part.name(), || guidance::runs(params, part, &|| progress.step()))?;
        runs.push(done);
        progress.at(runs.len() * params.guidance_runs, all);
    }
    progress.finish();
    Ok(guidance::outcome(params, &runs))
}

fn summary(outcome: &Outcome) -> String {
    let mut text = outcome.title.clone();
    for claim in &outcome.claims {
        text += &format!("\n  {} — {}.\n    {}", claim.claim, claim.verdict.word(), claim.measured);
    }
    for check in outcome.checks.iter().filter(|check| !check.passes()) {
        text += &format!("\n  differs: {}: {} for {}", check.what, check.measured, check.reference);
    }
    text
}

fn report(outcome: &Outcome) -> serde_json::Value {
    serde_json::json!({
        "name": outcome.name, "claims": outcome.claims,
        "checks": outcome.checks.iter().map(|check| serde_json::json!({
            "what": check.what, "reference": check.reference, "measured": check.measured,
            "reproduced": check.passes(),
        })).collect::<Vec<_>>(),
    })
}
