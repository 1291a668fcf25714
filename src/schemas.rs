//! JSON Schema of every written file, from the Rust types.

use schemars::{JsonSchema, Schema, SchemaGenerator, generate::SchemaSettings};

use boresight_app::{
    commands::{
        board_sheet::TargetFile, doctor::DoctorFile, json::DetectedLine, paths::PathsFile,
        plan_board::BoardPlan,
    },
    session::{devices_file::DevicesFile, report::ReportFile, truth::TruthFile},
};
use boresight_fleet::{
    batch::{Item, Job, Row},
    history::HistoryFile,
};
use boresight_formats::{CalibrationFile, CheckFile, JudgementFile, RigFile};
use boresight_run::recording::{RigSessionFile, journal_line_schema};
use boresight_station::{StateLine, StoreLine, WatchFile};

/// Name of each file in `docs/schemas`, with schema (draft 2020-12). The schemas describe the
/// output of this version; readers skip unknown fields.
pub fn schemas() -> Vec<(&'static str, Schema)> {
    let mut schemas = vec![
        ("calibration.v1.json", of::<CalibrationFile>()),
        ("check.v1.json", of::<CheckFile>()),
        ("judgement.v1.json", of::<JudgementFile>()),
        ("rig.v1.json", of::<RigFile>()),
        ("rig-session.v1.json", of::<RigSessionFile>()),
        ("report.v1.json", of::<ReportFile>()),
        ("doctor.v1.json", of::<DoctorFile>()),
        ("batch.v1.json", of::<Job>()),
        ("batch-manifest-line.v1.json", of::<Item>()),
        ("batch-row.v1.json", of::<Row>()),
        ("detect-line.v1.json", of::<DetectedLine>()),
        ("board-plan.v1.json", of::<BoardPlan>()),
        ("target.v1.json", of::<TargetFile>()),
        ("history.v1.json", of::<HistoryFile>()),
        ("devices.v1.json", of::<DevicesFile>()),
        ("truth.v1.json", of::<TruthFile>()),
        ("paths.v1.json", of::<PathsFile>()),
        ("watch.v1.json", of::<WatchFile>()),
        ("watch-line.v1.json", of::<StoreLine>()),
        ("watch-state.v1.json", of::<StateLine>()),
        ("session-journal-line.v1.json", journal_line_schema(generator())),
    ];
    for (name, schema) in &mut schemas {
        let name = name.trim_end_matches(".json").replace(".v", ":");
        schema.insert("$id".into(), format!("urn:boresight:schema:{name}").into());
    }
    schemas
}

fn of<T: JsonSchema>() -> Schema {
    generator().into_root_schema_for::<T>()
}

/// Generator of schemas for written files, not for accepted files: always written fields are
/// required.
fn generator() -> SchemaGenerator {
    SchemaSettings::draft2020_12().for_serialize().into_generator()
}
