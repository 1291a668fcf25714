//! Rules of the architecture as a test: access to the outside world, and no circles. Dependencies
//! between crates are in their `Cargo.toml`.

mod circles;
mod house;
mod resolve;
mod rules;
mod scan;
mod self_tests;
mod source;

use std::{path::Path, sync::LazyLock};

use house::House;
use rules::RULES;
use source::Workspace;

static HOUSE: LazyLock<House> = LazyLock::new(|| {
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR"));
    House::new(&Workspace::load(checkout).expect("readable sources"))
});

#[track_caller]
fn none(problems: &[String]) {
    assert!(problems.is_empty(), "\n{}\n", problems.join("\n"));
}

#[test]
fn every_name_leads_to_its_definition() {
    none(&HOUSE.unknown_names());
}

#[test]
fn panels_see_plain_data_and_words_only() {
    none(&HOUSE.wrong_panels(&RULES));
}

#[test]
fn the_outside_world_is_touched_only_where_it_may_be() {
    none(&HOUSE.wrong_reaches(&RULES));
}

#[test]
fn unsafe_code_stands_in_one_file() {
    none(&HOUSE.wrong_unsafe(&RULES));
}

#[test]
fn a_recording_is_replayed_by_one_file_only() {
    none(&HOUSE.wrong_users(&RULES));
}

#[test]
fn no_room_uses_itself_through_others() {
    none(&HOUSE.circles_of_rooms(&RULES));
}

#[test]
fn no_file_uses_itself_through_others_of_its_crate() {
    none(&HOUSE.circles_of_files());
}
