//! States of the guide, as shown in `docs/design`: `UPDATE_SNAPSHOTS=1 cargo test --test window
//! design` paints them again. `BORESIGHT_DESIGN=FOLDER` paints them in several sizes, for
//! inspection.

use std::path::{Path, PathBuf};

use egui::{Theme, Vec2};
use egui_kittest::{Harness, SnapshotOptions, SnapshotResults};

use crate::{
    Page, Table,
    fixtures::{Moment, moments},
    matrix::{SIZES, moment_of, page_at},
};

/// State, and moment in the fixtures.
const STATES: [(&str, &str); 10] = [
    ("search", "searching"),
    ("approach", "approach"),
    ("match", "match"),
    ("hold", "holding"),
    ("taken", "accepted"),
    ("rest", "paused"),
    ("lost", "camera lost"),
    ("wrong_board", "other board"),
    ("beyond_the_edge", "beyond the edge"),
    ("done", "done good"),
];

fn guide(
    all: &[Moment],
    name: &str,
    (size, scale): (Vec2, f32),
    distance: bool,
) -> Harness<'static, Table> {
    let moment = moment_of(all, name);
    let mut page = page_at(Page::Guide, &moment, (Theme::Dark, scale), size, distance);
    page.state_mut().screen.preferences.panels = false;
    page.run();
    page
}

#[test]
fn the_states_look_as_the_design_shows_them() {
    let all = moments();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/design");
    let options = SnapshotOptions::default().output_path(&folder);
    let mut results = SnapshotResults::new();
    for (state, name) in STATES {
        let mut page = guide(&all, name, (Vec2::new(720.0, 450.0), 1.0), false);
        page.snapshot_options(state, &options);
        results.extend_harness(&mut page);
    }
}

#[test]
fn the_states_are_painted_in_every_size() {
    let Some(folder) = std::env::var_os("BORESIGHT_DESIGN").map(PathBuf::from) else { return };
    std::fs::create_dir_all(&folder).expect("made");
    let all = moments();
    for (state, name) in STATES {
        for (width, height, scale) in SIZES {
            for distance in [false, true] {
                let mut page = guide(&all, name, (Vec2::new(width, height), scale), distance);
                let far = if distance { "-distance" } else { "" };
                let file = folder.join(format!("{state}-{width}@{scale}{far}.png"));
                page.render().expect("painted").save(file).expect("saved");
            }
        }
    }
}
