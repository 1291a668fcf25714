//! `boresight schema`.

use anyhow::bail;
use clap::Args;

use boresight_app::Exit;
use boresight_terminal::print;

/// Print the JSON Schema of a file that boresight writes.
///
/// Without a name, lists them. Each names the files that it describes, and has an `$id` for schemas
/// that refer to it.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Name of the schema, with or without its version: calibration, calibration.v1.
    name: Option<String>,
}

const EXAMPLES: &str = "\
Examples:
  boresight schema
  boresight schema calibration > calibration.schema.json";

macro_rules! schema {
    ($name:literal, $version:literal) => {
        (
            concat!($name, ".", $version),
            include_str!(concat!("../../docs/schemas/", $name, ".", $version, ".json")),
        )
    };
}

/// Schemas of `docs/schemas`. A test compares the list with the types written to files.
const SCHEMAS: &[(&str, &str)] = &[
    schema!("batch", "v1"),
    schema!("batch-manifest-line", "v1"),
    schema!("batch-row", "v1"),
    schema!("board-plan", "v1"),
    schema!("calibration", "v1"),
    schema!("check", "v1"),
    schema!("detect-line", "v1"),
    schema!("devices", "v1"),
    schema!("doctor", "v1"),
    schema!("history", "v1"),
    schema!("judgement", "v1"),
    schema!("paths", "v1"),
    schema!("report", "v1"),
    schema!("rig", "v1"),
    schema!("rig-session", "v1"),
    schema!("session-journal-line", "v1"),
    schema!("target", "v1"),
    schema!("truth", "v1"),
    schema!("watch", "v1"),
    schema!("watch-line", "v1"),
    schema!("watch-state", "v1"),
];

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let Some(wanted) = self.name else {
            for (name, _) in SCHEMAS {
                print(name)?;
            }
            return Ok(Exit::Good);
        };
        let is_it = |name: &str| {
            name == wanted || name.rsplit_once(".v").is_some_and(|(name, _)| name == wanted)
        };
        let Some((_, text)) = SCHEMAS.iter().find(|(name, _)| is_it(name)) else {
            bail!("there is no schema {wanted:?}; `boresight schema` lists them");
        };
        print(text.trim_end())?;
        Ok(Exit::Good)
    }
}
