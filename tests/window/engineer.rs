//! The engineer's view: a view chosen in one chart is chosen in all, and can be left out there.

use std::fs;

use boresight::{
    calibration::files::CalibrationFile,
    cli::services,
    text::{Act, charts::Chart},
    ui::{App, Page as WindowPage, UiAction},
};
use egui::{Event, Modifiers, PointerButton, Pos2, Rect, Theme, Vec2, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};

use crate::{
    Page, Table, app,
    fixtures::moments,
    matrix::{moment_of, page_at},
};

fn chart_of(page: &Harness<'_, Table>, chart: Chart) -> Rect {
    let start = format!("{}: ", chart.name());
    let is_chart = |label: Option<String>| label.is_some_and(|label| label.starts_with(&start));
    let mut images = page.get_all_by_role(Role::Image);
    images.find(|image| is_chart(image.accesskit_node().label())).expect("a chart").rect()
}

fn click_at(page: &mut Harness<'_, Table>, pos: Pos2) {
    page.input_mut().events.push(Event::PointerMoved(pos));
    for pressed in [true, false] {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        page.input_mut().events.push(Event::PointerButton { pos, button, pressed, modifiers });
    }
    page.run();
}

/// Number of the view that can be left out.
fn chosen(page: &Harness<'_, Table>) -> String {
    let labels = page.get_all_by_role(Role::Button).filter_map(|it| it.accesskit_node().label());
    let mut offered = labels.filter_map(|it| Some(it.strip_prefix("Leave out view ")?.to_owned()));
    offered.next().expect("a view to leave out")
}

#[test]
fn a_click_on_a_bar_or_a_board_chooses_the_view_in_every_chart() {
    let (moment, size) = (moment_of(&moments(), "done good"), Vec2::new(1280.0, 800.0));
    let mut page = page_at(Page::Result, &moment, (Theme::Dark, 1.0), size, false);
    page.state_mut().result.chart = Chart::Views;
    page.run();
    let area = chart_of(&page, Chart::Views);
    let views = page.state().screen.snapshot.as_ref().expect("there").views.clone();
    let numbers: Vec<String> = views.iter().map(|view| view.number.to_string()).collect();
    page.state_mut().result.chosen = Some(views[3].number);
    page.run();
    let mut by_bar: Vec<String> = Vec::new();
    let mut painted = Vec::new();
    for step in 0..64 {
        let x = area.left() + area.width() * (step as f32 + 0.5) / 64.0;
        click_at(&mut page, Pos2::new(x, area.bottom() - 88.0 - 24.0));
        let is_other = by_bar.last().map_or("4", |it| it.as_str()) != chosen(&page);
        if is_other {
            by_bar.push(chosen(&page));
            // Away from everything that lights up below the pointer.
            page.input_mut().events.push(Event::PointerMoved(Pos2::new(2.0, 2.0)));
            page.run();
            painted.push(page.render().expect("painted"));
        }
    }
    assert_eq!(by_bar, numbers, "each has its bar");
    // The picture, the boards and the bars change with it.
    let (one, other) = (&painted[0], &painted[1]);
    let middle = area.left() + 0.58 * area.width();
    let bars = area.top() + 0.6 * (area.height() - 92.0);
    let panes = [
        Rect::from_min_max(area.min, Pos2::new(middle, bars)),
        Rect::from_min_max(Pos2::new(middle, area.top()), Pos2::new(area.right(), bars)),
        Rect::from_min_max(Pos2::new(area.left(), bars), area.max - Vec2::new(0.0, 92.0)),
    ];
    for pane in panes {
        let (top, left) = (pane.top() as u32, pane.left() as u32);
        let all = (top..pane.bottom() as u32)
            .flat_map(|y| (left..pane.right() as u32).map(move |x| (x, y)));
        let count = all.filter(|(x, y)| one.get_pixel(*x, *y) != other.get_pixel(*x, *y)).count();
        assert!(count > 50, "{pane:?}: {count} pixels");
    }
    let mut by_board = Vec::new();
    for step in 0..400 {
        let share = Vec2::new((step % 20) as f32 + 0.5, (step / 20) as f32 + 0.5) / 20.0;
        click_at(&mut page, panes[1].min + share * panes[1].size());
        by_board.push(chosen(&page));
    }
    by_board.sort();
    by_board.dedup();
    assert_eq!(by_board.len(), numbers.len(), "each has a board to click: {by_board:?}");
    // One value: it stays in the other charts.
    let last = chosen(&page);
    for chart in [Chart::Poses, Chart::Scatter, Chart::Residuals, Chart::Radius] {
        page.state_mut().result.chart = chart;
        page.run();
        assert_eq!(chosen(&page), last, "{chart:?}");
    }
    let area = chart_of(&page, Chart::Radius);
    let mut by_corner = Vec::new();
    for step in 0..400 {
        let share = Vec2::new((step % 20) as f32 + 0.5, (step / 20) as f32 + 0.5) / 20.0;
        click_at(&mut page, area.min + share * (area.size() - Vec2::new(0.0, 92.0)));
        by_corner.push(chosen(&page));
    }
    by_corner.sort();
    by_corner.dedup();
    assert_eq!(by_corner.len(), numbers.len(), "each has a corner to click: {by_corner:?}");
    page.get_by_role_and_label(Role::Button, "Previous view").click();
    page.run();
    page.get_by_role_and_label(Role::Button, &format!("Leave out view {}", chosen(&page))).click();
    page.run();
    let number = page.state().result.chosen.expect("chosen");
    // What was left out can be put back even without a result.
    let snapshot = page.state_mut().screen.snapshot.as_mut().expect("there");
    (snapshot.removed, snapshot.calibration) = (Some(views[1].number), None);
    page.run();
    page.get_by_role_and_label(Role::Button, "Put back view 2").click();
    page.run();
    assert_eq!(page.state().asks, [UiAction::Remove(number), UiAction::Act(Act::Restore)]);
}

#[test]
fn leaving_out_a_view_changes_the_stored_result_and_putting_it_back_restores_it() {
    let place = tempfile::tempdir().expect("a folder");
    let session = place.path().join("good");
    let from = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/recordings/v1/good");
    for folder in ["", "frames"] {
        fs::create_dir_all(session.join(folder)).expect("made");
        for entry in fs::read_dir(from.join(folder)).expect("read").flatten() {
            if entry.path().is_file() {
                fs::copy(entry.path(), session.join(folder).join(entry.file_name()))
                    .expect("copied");
            }
        }
    }
    let services = services(&[], false).expect("arguments");
    let mut window = app::window(|ctx| App::new(ctx, services));
    app::drop_onto(&mut window, &session);
    app::until(&mut window, "the result", |window| app::app(window).page() == WindowPage::Result);
    let used = || -> Option<(usize, f64)> {
        let tree = serde_json::from_str(&app::text(&session.join("calibration.json"))).ok()?;
        let file = CalibrationFile::read(&tree).ok()?;
        let f_px = file.result.as_ref()?.camera().f_px.x;
        Some((file.used().count(), f_px))
    };
    app::click(&mut window, Role::Link, "Engineer's view");
    app::click(&mut window, Role::Button, Chart::Views.name());
    app::click(&mut window, Role::Button, "Next view");
    let views = |window: &app::Window| {
        let snapshot = app::app(window).screen().snapshot.as_ref();
        snapshot.map_or(0, |snapshot| snapshot.views.len())
    };
    let all = views(&window);
    let number = {
        let labels = window.get_all_by_role(Role::Button);
        let mut labels = labels.filter_map(|it| it.accesskit_node().label());
        labels.find_map(|it| Some(it.strip_prefix("Leave out ")?.to_owned())).expect("offered")
    };
    app::click(&mut window, Role::Button, &format!("Leave out {number}"));
    app::until(&mut window, "one view less", |window| views(window) == all - 1);
    let without = used().expect("stored");
    assert_eq!(without.0, all - 1);
    let report = app::text(&session.join("report.html"));
    // The page stays where it was, and offers the way back.
    app::settle(&mut window);
    app::click(&mut window, Role::Button, &format!("Put back {number}"));
    app::until(&mut window, "all views", |window| views(window) == all);
    let with = used().expect("stored");
    assert_eq!(with.0, all);
    assert!((with.1 - without.1).abs() > 1e-6, "{with:?} {without:?}");
    assert_ne!(app::text(&session.join("report.html")), report);
    // The recording holds both decisions.
    let journal = app::text(&session.join("journal.jsonl"));
    assert!(journal.contains("\"remove\"") && journal.contains("\"restore\""));
}
