//! Tests of the checker: small houses with a violation each.

use std::collections::BTreeMap;

use super::{
    house::House,
    rules::{Reach, Rules},
    source::Workspace,
};

/// `disk` and `middle` use `low`; only `disk` may read files.
const SMALL: Rules = Rules {
    of_rooms: &["boresight"],
    panels: &["boresight/window/panel"],
    panels_may_use: &["boresight/low", "boresight/window"],
    only_in: &[
        (Reach::Path("std::fs"), &["boresight/disk"]),
        (Reach::Path("rand"), &[]),
        (Reach::Method("exists"), &["boresight/disk"]),
        (Reach::Macro("println"), &[]),
        (Reach::Ending("_mm"), &["boresight/disk"]),
        (Reach::SystemMathematics, &["boresight/disk"]),
    ],
    only_by: &[("boresight::middle::replay", &["boresight/window/saved.rs"])],
    unsafe_in: "boresight/disk/raw.rs",
};

const SOUND: &[(&str, &str)] = &[
    ("lib.rs", "pub mod low; pub mod middle; pub mod disk; pub mod window;"),
    ("low.rs", "pub struct Plain; pub const LIMIT: u8 = 1;"),
    ("middle.rs", "use crate::low::Plain; pub struct Fine; pub fn replay(_: &Plain) {}"),
    ("disk/mod.rs", "mod raw; pub use raw::handle; use crate::low::LIMIT;"),
    ("disk/raw.rs", "pub fn handle() { unsafe { std::hint::unreachable_unchecked() } }"),
    ("window/mod.rs", "mod panel; mod saved; use crate::middle::Fine;"),
    ("window/panel.rs", "use crate::low::Plain;"),
    ("window/saved.rs", "fn open() { crate::middle::replay(&crate::low::Plain); }"),
];

/// The sound crate, with the texts of some files replaced.
fn house(changed: &[(&str, &str)]) -> House {
    let files = SOUND.iter().chain(changed);
    let texts: BTreeMap<String, String> =
        files.map(|(path, text)| (format!("boresight/{path}"), (*text).to_owned())).collect();
    House::new(&Workspace::from_texts(&texts))
}

/// All violations of the rules of [`SMALL`].
fn wrong(changed: &[(&str, &str)]) -> Vec<String> {
    let house = house(changed);
    [
        house.unknown_names(),
        house.wrong_panels(&SMALL),
        house.wrong_reaches(&SMALL),
        house.wrong_users(&SMALL),
        house.wrong_unsafe(&SMALL),
        house.circles_of_rooms(&SMALL),
        house.circles_of_files(),
    ]
    .concat()
}

/// Violations if `low` names `path` in `disk`: `disk` uses `low`.
fn circle_with_disk(path: &str) -> String {
    format!(
        "circle of 2:\
         \n    disk uses low: src/disk/mod.rs: crate::low::LIMIT\
         \n    low uses disk: src/low.rs: {path}"
    )
}

#[track_caller]
fn assert_wrong(changed: &[(&str, &str)], expected: &[&str]) {
    assert_eq!(wrong(changed), expected);
}

#[test]
fn a_sound_crate_has_no_problems() {
    assert_wrong(&[], &[]);
}

#[test]
fn a_room_that_may_not_be_used_is_found_however_it_is_named() {
    let named = |code: &str, path: &str| {
        assert_wrong(
            &[("low.rs", &format!("pub struct Plain; pub const LIMIT: u8 = 1;\n{code}"))],
            &[&circle_with_disk(path)],
        );
    };
    named("use crate::disk::handle;", "crate::disk::handle");
    // Bare, in a group.
    named("use crate::{disk, low};", "crate::disk");
    named("use crate::{disk as d};", "crate::disk");
    named("use crate::disk::*;", "crate::disk::*");
    named("use super::disk::handle;", "super::disk::handle");
    named("use self::super::disk::handle;", "self::super::disk::handle");
    named("mod inner { use super::super::disk::handle; }", "super::super::disk::handle");
    named("fn f() { crate::disk::handle() }", "crate::disk::handle");
    named("fn f() { use crate::disk::handle; }", "crate::disk::handle");
    named("fn f(_: &dyn Fn() -> crate::disk::handle) {}", "crate::disk::handle");
}

#[test]
fn macros_and_attributes_are_code() {
    let named = |code: &str, path: &str| {
        assert_wrong(
            &[("low.rs", &format!("pub struct Plain; pub const LIMIT: u8 = 1;\n{code}"))],
            &[&circle_with_disk(path)],
        );
    };
    named("fn f() { assert!(vec![crate::disk::handle()].is_empty()); }", "crate::disk::handle");
    named("fn f() { format!(\"{:?}\", super::disk::handle()); }", "super::disk::handle");
    named("macro_rules! m { () => { use crate::{disk}; } }", "crate::disk");
    named("#[derive(crate::disk::handle)] struct S;", "crate::disk::handle");
    named("struct S { #[serde(with = \"crate::disk\")] a: u8 }", "crate::disk");
}

#[test]
fn what_a_room_passes_on_belongs_to_the_room_that_defines_it() {
    let changed = [
        ("middle.rs", "pub use crate::low::*; pub fn replay(_: &Plain) {}"),
        ("low.rs", "pub struct Plain; pub const LIMIT: u8 = 1;"),
        ("disk/mod.rs", "mod raw; pub use raw::handle; use crate::middle::Plain;"),
        ("window/mod.rs", "mod panel; mod saved; pub use crate::middle::replay as again;"),
        ("window/panel.rs", "use super::again;"),
    ];
    assert_wrong(
        &changed,
        &[
            "src/window/panel.rs: a panel sees plain data and words, not `boresight/middle.rs`: \
             super::again",
            "src/window/panel.rs: only boresight/window/saved.rs may use `boresight::middle::replay`",
        ],
    );
}

#[test]
fn unit_tests_are_left_out_and_the_code_after_them_is_not() {
    let tests = "pub struct Plain; pub const LIMIT: u8 = 1;
        #[cfg(test)]
        mod tests { use crate::disk::handle; fn f() { println!(); unsafe {} } }
        #[cfg(all(test, unix))]
        use crate::disk;
        #[cfg(test)]
        mod elsewhere;
        impl Plain { #[cfg(test)] fn f() { crate::disk::handle(); println!(); } }";
    let elsewhere = ("low/elsewhere.rs", "use crate::disk;");
    assert_wrong(&[("low.rs", tests), elsewhere], &[]);
    let after = format!("{tests}\nfn f() {{ println!(); crate::disk::handle() }}");
    assert_wrong(
        &[("low.rs", &after), elsewhere],
        &["src/low.rs: no `println!` here", &circle_with_disk("crate::disk::handle")],
    );
    let either = "#[cfg(any(test, feature = \"x\"))] use crate::disk::handle; pub struct Plain; pub const LIMIT: u8 = 1;";
    assert_wrong(&[("low.rs", either)], &[&circle_with_disk("crate::disk::handle")]);
}

#[test]
fn strings_and_comments_are_no_code() {
    assert_wrong(
        &[(
            "low.rs",
            "//! Not [`crate::disk`], `std::fs` or `unsafe`.
            pub struct Plain; pub const LIMIT: u8 = 1;
            /// Like println!(\"a_mm\").
            fn f() -> &'static str { /* unsafe { crate::disk } */ \"// std::fs::read unsafe \" }",
        )],
        &[],
    );
}

#[test]
fn the_outside_world_is_found_however_it_is_reached() {
    let reach = |code: &str, what: &str| {
        let text = format!("pub struct Plain; pub const LIMIT: u8 = 1;\n{code}");
        assert_wrong(&[("low.rs", &text)], &[&format!("src/low.rs: no {what} here")]);
    };
    reach("use std::{fs, path::Path};", "`std::fs`");
    reach("use std::{fs::File as Sheet};", "`std::fs`");
    reach("use std::fs as disk; fn f() { disk::read(\"a\") }", "`std::fs`");
    reach("fn f() { let url = \"http://a\"; std::fs::read(url) }", "`std::fs`");
    reach("fn f() { assert!(::std::fs::read(\"a\").is_ok()) }", "`std::fs`");
    reach("fn f(p: &std::path::Path) -> bool { p.exists() }", "`.exists()`");
    reach("fn f(p: &std::path::Path) { assert!(p.join(\"a\").exists()) }", "`.exists()`");
    reach("use std::path::Path; fn f() { a.filter(Path::exists) }", "`.exists()`");
    reach("fn f() -> u8 { rand::random() }", "`rand`");
    reach("fn f(operand: u8) { println!(\"{operand}\") }", "`println!`");
    reach("fn f(width_mm: f64) {}", "name in `_mm`");
    reach("fn f(x: f64) -> f64 { (x + 1.0).sin() }", "mathematics of the system");
    reach("fn f(x: &[f64]) { x.iter().copied().map(f64::exp); }", "mathematics of the system");
    assert_wrong(
        &[(
            "low.rs",
            "pub struct Plain; pub const LIMIT: u8 = 1; fn f(operand: bool, rand: u8, mmm: u8) {}",
        )],
        &[],
    );
}

#[test]
fn a_re_exported_part_of_the_outside_world_is_found() {
    assert_wrong(
        &[
            ("disk/mod.rs", "mod raw; pub use raw::handle; pub use std::fs::File as Sheet;"),
            ("window/mod.rs", "mod panel; mod saved; use crate::disk::Sheet;"),
        ],
        &["src/window/mod.rs: no `std::fs` here"],
    );
}

#[test]
fn unsafe_code_elsewhere_is_found() {
    let elsewhere = |code: &str| {
        let text = format!("pub struct Plain; pub const LIMIT: u8 = 1;\n{code}");
        assert_wrong(&[("low.rs", &text)], &["src/low.rs: unsafe code outside src/disk/raw.rs"]);
    };
    elsewhere("fn f() { unsafe { g() } }");
    elsewhere("unsafe fn f() {}");
    elsewhere("unsafe impl Send for Plain {}");
    elsewhere("#[expect(unsafe_code)] fn f() {}");
    elsewhere("fn f() { vec![unsafe { g() }]; }");
    assert_wrong(&[("disk/raw.rs", "pub fn handle() {}")], &["src/disk/raw.rs: no unsafe code"]);
}

#[test]
fn a_rule_that_nothing_can_break_is_a_problem() {
    assert_wrong(
        &[("window/saved.rs", "")],
        &["`boresight::middle::replay` is not used by boresight/window/saved.rs"],
    );
    let missing = [("lib.rs", "pub mod low; pub mod middle; pub mod disk;")];
    let problems = wrong(&missing);
    assert!(problems.contains(&"src/window/panel: no such panel".to_owned()), "{problems:?}");
    assert!(
        problems.contains(&"src/window/panel.rs: no `mod` names this file".to_owned()),
        "{problems:?}"
    );
}

#[test]
fn names_that_cannot_be_followed_are_problems() {
    assert_wrong(
        &[("middle.rs", "use crate::low::{Plain, Gone}; pub struct Fine; pub fn replay() {}")],
        &["src/middle.rs: `crate::low::Gone`: no `Gone` found"],
    );
    assert_wrong(
        &[("disk/mod.rs", "mod raw; mod lost; pub use raw::handle;")],
        &["src/disk/mod.rs: no file for `mod lost`"],
    );
    // A macro may write any item.
    let written = "items! { LIMIT, Gone } pub struct Plain;";
    let user = "use crate::low::Gone; pub struct Fine; pub fn replay() {}";
    assert_wrong(&[("low.rs", written), ("middle.rs", user)], &[]);
}

/// Circles in a room of the files.
fn circles(files: &[(&str, &str)]) -> Vec<String> {
    house(files).circles_of_files()
}

#[test]
fn a_facade_that_only_passes_names_on_makes_no_circle() {
    let files = [
        ("middle.rs", ""),
        ("disk/mod.rs", "mod raw; mod plan; pub use raw::handle; pub use self::plan::Plan;"),
        ("disk/raw.rs", "use super::Plan; pub fn handle(_: Plan) {}"),
        ("disk/plan.rs", "pub struct Plan;"),
    ];
    assert_eq!(circles(&files), [""; 0]);
}

#[test]
fn files_that_name_what_each_other_defines_are_a_circle() {
    let expected = "circle of 2:\
        \n    boresight/disk/plan.rs uses boresight/disk/raw.rs: handle\
        \n    boresight/disk/raw.rs uses boresight/disk/plan.rs: LIMIT, Plan";
    let mod_rs = "mod raw; mod plan; pub use raw::*; pub use plan::{Plan, LIMIT};";
    let raw = "use super::*; pub fn handle(_: Plan) -> u8 { match 1 { LIMIT => 2, _ => 3 } }";
    for plan in [
        "use super::handle; pub struct Plan; pub const LIMIT: u8 = 1;",
        "pub struct Plan; pub const LIMIT: u8 = 1; fn f() { crate::disk::raw::handle(Plan); }",
        "pub struct Plan; pub const LIMIT: u8 = 1; fn f() { assert!(super::handle(Plan)); }",
        "use super::raw as r; pub struct Plan; pub const LIMIT: u8 = 1; fn f() { r::handle(Plan) }",
        "use super::*; pub struct Plan; pub const LIMIT: u8 = 1; fn f() { handle(Plan) }",
    ] {
        let files = [("disk/mod.rs", mod_rs), ("disk/raw.rs", raw), ("disk/plan.rs", plan)];
        assert_eq!(circles(&files), [expected], "{plan}");
    }
}

#[test]
fn an_item_defined_in_the_folder_s_own_file_makes_a_circle() {
    let files = [
        ("disk/mod.rs", "mod raw; pub struct Failed; fn f() { raw::handle() }"),
        ("disk/raw.rs", "use super::Failed; pub fn handle() -> Failed { Failed }"),
    ];
    let expected = "circle of 2:\
        \n    boresight/disk/mod.rs uses boresight/disk/raw.rs: handle\
        \n    boresight/disk/raw.rs uses boresight/disk/mod.rs: Failed";
    assert_eq!(circles(&files), [expected]);
}

#[test]
fn a_variant_with_the_name_of_a_type_is_not_that_type() {
    let mod_rs = "mod raw; pub use raw::Raw; pub enum Failed { #[doc(hidden)] Raw, Plan(u8) }";
    let files = [("disk/mod.rs", mod_rs), ("disk/raw.rs", "pub struct Raw(super::Failed);")];
    assert_eq!(circles(&files), [""; 0]);
    let holds = mod_rs.replace("Plan(u8)", "Plan(Raw)");
    let files = [("disk/mod.rs", holds.as_str()), files[1]];
    assert_eq!(circles(&files).len(), 1);
}

#[test]
fn a_module_may_have_a_file_of_another_name_and_one_for_each_system() {
    let files = [
        (
            "disk/mod.rs",
            "#[cfg(unix)] #[path = \"raw.rs\"] mod now; #[cfg(not(unix))] mod now; pub use now::handle;",
        ),
        ("disk/now.rs", "pub fn handle() { println!() }"),
    ];
    assert_wrong(&files, &["src/disk/now.rs: no `println!` here"]);
}

#[test]
fn a_method_named_in_an_impl_ties_the_file_to_the_type_alone() {
    let files = [
        ("disk/mod.rs", "mod raw; mod plan; pub use plan::Plan;"),
        ("disk/raw.rs", "impl super::Plan { pub fn handle(&self) {} }"),
        (
            "disk/plan.rs",
            "pub struct Plan; fn f(plan: &Plan, handle: u8) { plan.handle(); handle }",
        ),
    ];
    assert_eq!(circles(&files), [""; 0]);
}

#[test]
fn a_circle_through_three_files_is_one_circle() {
    let files = [
        ("disk/mod.rs", "mod raw; mod plan; mod page;"),
        ("disk/raw.rs", "use super::plan::Plan; pub struct Raw;"),
        ("disk/plan.rs", "use super::page::Page; pub struct Plan;"),
        ("disk/page.rs", "use super::raw::Raw; pub struct Page;"),
    ];
    let expected = "circle of 3:\
        \n    boresight/disk/page.rs uses boresight/disk/raw.rs: Raw\
        \n    boresight/disk/plan.rs uses boresight/disk/page.rs: Page\
        \n    boresight/disk/raw.rs uses boresight/disk/plan.rs: Plan";
    assert_eq!(circles(&files), [expected]);
}

#[test]
fn rooms_that_use_each_other_are_a_circle() {
    let files = [
        ("low.rs", "use crate::middle; pub struct Plain;"),
        ("middle.rs", "pub use crate::low::Plain; pub fn replay() {}"),
    ];
    let expected = "circle of 2:\
        \n    low uses middle: src/low.rs: crate::middle\
        \n    middle uses low: src/middle.rs: crate::low::Plain";
    assert_eq!(house(&files).circles_of_rooms(&SMALL), [expected]);
}
