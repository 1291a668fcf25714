//! Corner files of real cameras.

use std::{path::Path, sync::Mutex, thread};

use anyhow::Context;
use boresight_geometry::{Corner, boards::Board, frame::ImageSize};
use nalgebra::Point2;

/// Views of one camera.
pub(crate) struct Set {
    pub(crate) name: String,
    pub(crate) board: Board,
    pub(crate) size: ImageSize,
    pub(crate) views: Vec<Vec<Corner>>,
}

/// Sets named by the lines of the file `list`, beside which they lie.
pub(crate) fn read_list(list: &Path) -> anyhow::Result<Vec<Set>> {
    let folder = list.parent().unwrap_or(Path::new("."));
    let text = std::fs::read_to_string(list)?;
    let lines = text.lines().filter(|line| !line.trim().is_empty());
    lines.map(|line| read(line, folder)).collect()
}

/// Result of `work` on each set, on two threads, by the sets' names.
pub(crate) fn each<T: Send>(sets: &[Set], work: impl Fn(&Set) -> T + Sync) -> Vec<(&Set, T)> {
    let (next, done) = (Mutex::new(sets.iter()), Mutex::new(Vec::new()));
    let walk = || {
        while let Some(set) = next.lock().ok().and_then(|mut sets| sets.next()) {
            let found = work(set);
            if let Ok(mut done) = done.lock() {
                done.push((set, found));
            }
        }
    };
    thread::scope(|scope| {
        let other = thread::Builder::new().name("sets".into()).spawn_scoped(scope, walk);
        walk();
        drop(other);
    });
    let mut done = done.into_inner().unwrap_or_default();
    done.sort_by(|a, b| a.0.name.cmp(&b.0.name));
    done
}

fn read(line: &str, folder: &Path) -> anyhow::Result<Set> {
    let mut words = line.split_whitespace();
    let mut word = || words.next().context("FILE COLUMNSxROWS WIDTHxHEIGHT");
    let (file, board, size) = (word()?, word()?, word()?);
    let pair = |text: &str| -> anyhow::Result<(u16, u16)> {
        let (a, b) = text.split_once('x').context("no x")?;
        Ok((a.parse()?, b.parse()?))
    };
    let ((columns, rows), (width, height)) = (pair(board)?, pair(size)?);
    let (width_px, height_px) = (u32::from(width), u32::from(height));
    let board = Board::new(columns, rows, 0.025)?;
    let text = std::fs::read_to_string(folder.join(file)).with_context(|| file.to_owned())?;
    let mut views = Vec::new();
    for line in text.lines().filter(|line| !line.is_empty()) {
        let value: serde_json::Value = serde_json::from_str(line)?;
        let mut view = vec![Corner::unseen(Point2::origin()); usize::from(columns * rows)];
        for corner in value["corners"].as_array().context("no corners")? {
            let number = |i: usize| corner[i].as_f64().unwrap_or(f64::NAN);
            let index = number(1) as usize * usize::from(columns) + number(0) as usize;
            view[index] = Corner::isotropic(Point2::new(number(2), number(3)), number(4));
        }
        if view.iter().any(Corner::is_seen) {
            views.push(view);
        }
    }
    let name = file.trim_end_matches(".jsonl").to_owned();
    Ok(Set { name, board, size: ImageSize { width_px, height_px }, views })
}
