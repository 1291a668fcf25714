//! Boards to print, reports, batches and histories: what the program's commands of those names do.

use std::path::{Path, PathBuf};

use boresight::{
    app::{
        commands::{
            board_sheet::{BoardSheet, SheetKind, paper},
            plan_board::{self, Place},
        },
        session::{report, session_report},
        window::printed_board::new_id,
    },
    config::Config,
    fleet::{
        batch::{self, Action, Item, Job, Store},
        history::{self, HistoryFile, Index, days_ago, histories},
    },
    frame::ImageSize,
    geometry::boards::BoardChoice,
    guidance::GuidanceParams,
    report::page,
};
use pyo3::{prelude::*, types::PyBytes};
use serde_json::json;

use crate::{
    error::{raised, wrong},
    picture::{self, Named, board},
};

/// Rows differ from those of other versions.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "+python");

fn choice(named: &Named) -> PyResult<BoardChoice> {
    board(named)?;
    picture::choice(named)
}

/// A board on paper, as a file's bytes, and `boresight.target/1`. Without `exact`, the squares are
/// as large as fits.
#[pyfunction]
pub(crate) fn sheet<'py>(
    py: Python<'py>,
    named: Named,
    exact: bool,
    on: &str,
    kind: &str,
    file: PathBuf,
) -> PyResult<(Bound<'py, PyBytes>, String)> {
    let choice = choice(&named)?;
    let Some(paper) = paper(on) else {
        return Err(wrong(format!("there is no paper {on:?}: a4, a3 or letter")));
    };
    let Some(kind) = SheetKind::by_name(kind) else {
        return Err(wrong(format!("a board is written as pdf, svg or png, not {kind:?}")));
    };
    let square_mm = exact.then_some(named.2);
    let work = || {
        let sheet = BoardSheet::new(choice, square_mm, &paper.pages())?.with_code(new_id());
        let told = sheet.told(&file, &paper.name().to_ascii_lowercase());
        Ok::<_, anyhow::Error>((sheet.bytes(kind, None)?, serde_json::to_string(&told)?))
    };
    let (bytes, told) = py.detach(work).map_err(|err| raised(&err))?;
    Ok((PyBytes::new(py, &bytes), told))
}

/// Which board to print: `boresight.board-plan/1`.
#[pyfunction]
pub(crate) fn board_plan(
    named: Named,
    image_size: (u32, u32),
    f_px: f64,
    distance_m: f64,
) -> PyResult<String> {
    let choice = choice(&named)?;
    if !choice.pattern.is_squares() {
        return Err(wrong("checkerboards and ChArUco boards are planned, other boards aren't"));
    }
    let (width_px, height_px) = image_size;
    if width_px == 0 || height_px == 0 || !(f_px > 0.0 && distance_m > 0.0) {
        return Err(wrong("image_size, focal length and distance are above zero"));
    }
    let place = Place { image_size: ImageSize { width_px, height_px }, f_px, distance_m };
    let plan = plan_board::plan_board(choice, &place, &GuidanceParams::default());
    serde_json::to_string(&plan).map_err(|err| raised(&err.into()))
}

/// The report of a session folder or of `text`, a calibration, as a page of HTML.
#[pyfunction]
pub(crate) fn report_page(
    py: Python<'_>,
    input: PathBuf,
    text: Option<&str>,
    settings: Vec<String>,
) -> PyResult<String> {
    let work = || {
        let stated = Config::load(None, &settings)?.certificate;
        let report = match text {
            Some(text) => {
                report::of_text(text, Path::new("calibration.json"), String::new(), &stated)?
            }
            None if input.is_dir() => session_report::of_folder(&input, &stated)?,
            None => report::of_file(&input, String::new(), &stated)?,
        };
        Ok::<_, anyhow::Error>(page(&report))
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Sessions in and below folders: a line of a manifest each.
#[pyfunction]
pub(crate) fn batch_plan(py: Python<'_>, roots: Vec<PathBuf>) -> PyResult<Vec<String>> {
    let work = || {
        let mut items = Vec::new();
        batch::plan(&roots, &mut |item| {
            items.push(serde_json::to_string(item)?);
            Ok(())
        })?;
        Ok::<_, anyhow::Error>(items)
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Settings, the older calibration of a check, and the format of an export.
type How = (Vec<String>, Option<PathBuf>, Option<String>);

/// Works on one session. Whatever is wrong with it becomes a row with a code.
#[pyfunction]
pub(crate) fn batch_work(
    py: Python<'_>,
    session: PathBuf,
    action: &str,
    how: How,
    out: PathBuf,
) -> PyResult<String> {
    let (settings, against, format) = how;
    let action: Action = serde_json::from_value(json!(action))
        .map_err(|_| wrong(format!("there is no action {action:?}")))?;
    let work = || {
        Config::load(None, &settings)?;
        let session = std::path::absolute(&session)?;
        let item = Item::of(&session)
            .ok_or_else(|| anyhow::anyhow!("its name isn't UTF-8: {session:?}"))?;
        let job = Job { settings, format, ..Job::new(action, VERSION) };
        let job = match &against {
            Some(file) => job.against(file)?,
            None => job,
        };
        Ok::<_, anyhow::Error>(serde_json::to_string(&batch::work(&job, &Store::at(&out)?, &item))?)
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// The rows of a batch that the program ran.
#[pyfunction]
pub(crate) fn batch_rows(py: Python<'_>, out: PathBuf) -> PyResult<Vec<String>> {
    let work = || {
        let mut rows = Vec::new();
        batch::gather(&Store::at(&out)?, &mut |line| {
            rows.push(line.to_owned());
            Ok(())
        })?;
        Ok::<_, anyhow::Error>(rows)
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Reads the results of sessions into an index; returns what `history add` says, as JSON.
#[pyfunction]
pub(crate) fn history_add(py: Python<'_>, index: PathBuf, roots: Vec<PathBuf>) -> PyResult<String> {
    let work = || {
        let added = history::add(&index, &roots, |_| (), || ())?;
        let value = json!({
            "sessions": added.sessions, "added": added.added, "without": added.without, "gone": added.gone,
            "damaged": added.damaged,
        });
        Ok::<_, anyhow::Error>(value.to_string())
    };
    py.detach(work).map_err(|err| raised(&err))
}

fn opened(index: &Path) -> anyhow::Result<Index> {
    if !index.is_file() {
        anyhow::bail!("there is no index {:?}; add sessions first", index.display());
    }
    Ok(Index::open(index)?)
}

/// Every camera of an index with its calibrations, `boresight.history/1` each.
#[pyfunction]
pub(crate) fn history_cameras(py: Python<'_>, index: PathBuf) -> PyResult<Vec<String>> {
    let work = || {
        let all = histories(&opened(&index)?.all());
        let files = all.iter().map(|camera| serde_json::to_string(&HistoryFile::of(camera, true)));
        Ok::<_, anyhow::Error>(files.collect::<Result<Vec<String>, _>>()?)
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Cameras without a usable calibration of so many days, each with the time of its newest.
#[pyfunction]
pub(crate) fn history_due(
    py: Python<'_>,
    index: PathBuf,
    older_days: f64,
) -> PyResult<Vec<(String, Option<String>)>> {
    let work = || Ok(opened(&index)?.due(&days_ago(older_days)?, &days_ago(0.0)?));
    py.detach(work).map_err(|err: anyhow::Error| raised(&err))
}

/// The page with every camera's curves.
#[pyfunction]
pub(crate) fn history_page(py: Python<'_>, index: PathBuf, older_days: f64) -> PyResult<String> {
    let work = || history::page(&histories(&opened(&index)?.all()), Vec::new(), older_days);
    py.detach(work).map_err(|err| raised(&err))
}
