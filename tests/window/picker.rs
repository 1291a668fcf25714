//! Choosing a recording.

use boresight::{
    app::{
        explain::UserError,
        window::recordings::{Recording, folders_in},
    },
    calibration::Verdict,
    ui::{
        SMALLEST, UiAction,
        replay::{Picker, pick},
    },
};
use egui::accesskit::Role;
use egui_kittest::{Harness, kittest::Queryable};

use crate::painter;

type Table = (Picker, Vec<UiAction>);

fn page(picker: Picker) -> Harness<'static, Table> {
    Harness::builder().with_size(SMALLEST).renderer(painter()).build_ui_state(
        |ui, (picker, asks): &mut Table| pick(ui, picker, asks),
        (picker, Vec::new()),
    )
}

#[test]
fn a_recording_is_opened_by_its_path_or_from_the_list() {
    let recordings = vec![Recording {
        folder: "sessions/one".into(),
        when: "21 November 2026, 09:00".into(),
        camera: "Front camera, 1280 × 720".into(),
        verdict: "Good".into(),
        judged: Some(Verdict::Good),
        views: Some(5),
        report: Some("sessions/one/report.html".into()),
        is_rig: false,
    }];
    let formats = [vec!["OpenCV", "ROS"], vec!["Kalibr"]];
    let mut page = page(Picker { recordings, formats, ..Picker::default() });
    page.run();
    for said in ["21 November 2026, 09:00", "Front camera, 1280 × 720", "Good", "5 views"] {
        page.get_by_label(said);
    }
    let folder = std::path::PathBuf::from("sessions/one");
    let asks = [
        ("Show result", UiAction::ShowResult(folder.clone())),
        ("Continue", UiAction::GoOnWith(folder.clone())),
        ("Report", UiAction::Show(folder.join("report.html"))),
        ("Delete", UiAction::Delete(folder.clone())),
        ("Replay", UiAction::Replay(folder.clone())),
    ];
    for (button, ask) in asks {
        page.get_by_role_and_label(Role::Button, button).click();
        page.run();
        assert_eq!(page.state().1.last(), Some(&ask));
    }
    page.get_by_role_and_label(Role::Button, "Export").click();
    page.run();
    page.get_by_role_and_label(Role::Button, "ROS").click();
    page.run();
    assert_eq!(page.state().1.last(), Some(&UiAction::ExportOf(folder, 1)));
    // A running session isn't ended from here.
    page.state_mut().0.busy = true;
    page.run();
    let before = page.state().1.len();
    for button in ["Show result", "Continue", "Delete"] {
        page.get_by_role_and_label(Role::Button, button).click();
        page.run();
    }
    assert_eq!(page.state().1.len(), before);
    page.get_by_role_and_label(Role::TextInput, "Folder").focus();
    page.run();
    page.get_by_role_and_label(Role::TextInput, "Folder").type_text("elsewhere/two");
    page.run();
    page.get_by_role_and_label(Role::Button, "Open").click();
    page.run();
    assert_eq!(page.state().1.last(), Some(&UiAction::Replay("elsewhere/two".into())));
}

#[test]
fn a_session_of_several_cameras_has_its_own_steps_and_formats() {
    let folder = std::path::PathBuf::from("sessions/rig");
    let report = folder.join("rig.html");
    let recordings = vec![Recording {
        folder: folder.clone(),
        when: "29 November 2026, 09:00".into(),
        camera: "left, right: 8 places".into(),
        verdict: "Good".into(),
        judged: Some(Verdict::Good),
        views: None,
        report: Some(report.clone()),
        is_rig: true,
    }];
    let formats = [vec!["OpenCV", "ROS"], vec!["Kalibr"]];
    let mut page = page(Picker { recordings, formats, ..Picker::default() });
    page.run();
    page.get_by_label("left, right: 8 places");
    let asks = [
        ("Report", UiAction::Show(report)),
        ("Continue", UiAction::GoOnWithRig(folder.clone())),
        ("Delete", UiAction::Delete(folder.clone())),
    ];
    for (button, ask) in asks {
        page.get_by_role_and_label(Role::Button, button).click();
        page.run();
        assert_eq!(page.state().1.last(), Some(&ask));
    }
    page.get_by_role_and_label(Role::Button, "Export").click();
    page.run();
    page.get_by_role_and_label(Role::Button, "Kalibr").click();
    page.run();
    assert_eq!(page.state().1.last(), Some(&UiAction::ExportOf(folder, 0)));
    for button in ["Show result", "Replay"] {
        assert!(page.query_by_role_and_label(Role::Button, button).is_none(), "{button}");
    }
}

#[test]
fn a_recording_is_found_by_browsing() {
    let place = tempfile::tempdir().expect("a folder");
    let session = place.path().join("bench").join("monday");
    for folder in [&session, &place.path().join(".hidden")] {
        std::fs::create_dir_all(folder).expect("made");
    }
    std::fs::write(session.join("session.toml"), "").expect("written");
    let bench = place.path().join("bench");
    assert_eq!(folders_in(place.path()), [(bench.clone(), false)]);
    let path = place.path().display().to_string();
    let mut page = page(Picker { path, ..Picker::default() });
    page.run();
    for (button, ask) in [
        ("Browse…", UiAction::Browse(place.path().to_path_buf())),
        ("bench", UiAction::Browse(bench.clone())),
        ("Up", UiAction::Browse(place.path().to_path_buf())),
        ("monday", UiAction::Replay(session)),
    ] {
        page.get_by_role_and_label(Role::Button, button).click();
        page.run();
        assert_eq!(page.state().1.last(), Some(&ask), "{button}");
        // As the window does.
        let listed = if button == "Browse…" { place.path() } else { &bench };
        let picker = &mut page.state_mut().0;
        picker.path = listed.display().to_string();
        picker.inside = Some(folders_in(listed));
        page.run();
    }
}

#[test]
fn an_empty_list_and_a_folder_that_is_none_say_so() {
    let trouble = UserError {
        what: "could not read session.toml".into(),
        action: Some("Name a session's folder.".into()),
    };
    let mut page = page(Picker { trouble: Some(trouble), ..Picker::default() });
    page.get_by_label(
        "No recorded sessions yet. Each session is recorded: start one, and it appears here.",
    );
    page.get_by_label("could not read session.toml");
    page.get_by_label("Name a session's folder.");
    page.get_by_role_and_label(Role::Button, "Open").click();
    page.run();
    assert_eq!(page.state().1, [], "without a path there is nothing to open");
    page.state_mut().0.opening = Some("sessions/one".into());
    page.step();
    page.get_by_label("Opening sessions/one");
}
