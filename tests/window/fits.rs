//! Nothing is cut off: the contents of a page are inside the window, or reachable by scrolling.

use egui::{Rect, Theme, Vec2, accesskit::Role};
use egui_kittest::{
    Harness, Node,
    kittest::{NodeT, Queryable},
};

use crate::{Page, Table, fixtures::moments, harness_at};

/// Words of a node for a person.
fn words(node: &Node<'_>) -> Option<String> {
    let node = node.accesskit_node();
    node.label().or_else(|| node.value()).filter(|words| !words.is_empty())
}

/// All words, with places.
fn read<T>(page: &Harness<'_, T>) -> Vec<(String, Rect)> {
    page.root()
        .children_recursive()
        .filter(|node| node.accesskit_node().bounding_box().is_some())
        .filter_map(|node| Some((words(&node)?, node.rect())))
        .collect()
}

pub(crate) fn outside<T>(page: &Harness<'_, T>, window: Vec2) -> Vec<String> {
    let window = Rect::from_min_size(egui::Pos2::ZERO, window).expand(1.0);
    let mut outside: Vec<String> = read(page)
        .into_iter()
        .filter(|(_, rect)| !window.contains_rect(*rect))
        .map(|(words, _)| words)
        .collect();
    outside.dedup();
    outside
}

#[test]
fn everything_is_in_the_window_or_comes_there_by_scrolling() {
    let moments = moments();
    let sizes = [(1024.0, 640.0), (1280.0, 800.0), (1920.0, 1080.0)];
    for name in ["fresh", "done good", "camera lost", "camera with controls"] {
        let moment = moments.iter().find(|m| m.name == name).expect("there");
        for (width, high) in sizes {
            for (scale, theme) in [(1.0, Theme::Dark), (1.5, Theme::Light), (3.0, Theme::Dark)] {
                for page in Page::ALL {
                    let size = Vec2::new(width, high);
                    let mut page_now = harness_at(page, moment, (theme, scale), size);
                    for words in outside(&page_now, size) {
                        let is_it = |node: &Node<'_>| self::words(node).as_ref() == Some(&words);
                        let find = |page: &Harness<'_, Table>, scroll: bool| {
                            let root = page.root();
                            let node = root.children_recursive().find(|node| is_it(node))?;
                            if scroll {
                                node.scroll_to_me();
                            }
                            Some(node.rect())
                        };
                        find(&page_now, true);
                        page_now.run();
                        let rect = find(&page_now, false).expect("still there");
                        let window = Rect::from_min_size(egui::Pos2::ZERO, size).expand(1.0);
                        assert!(
                            window.contains_rect(rect),
                            "{name} {page:?} {width}x{high} at {scale}: {words:?} {rect:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn without_a_live_camera_nothing_needs_to_be_scrolled() {
    let moments = moments();
    for name in ["fresh", "holding", "accepted", "paused"] {
        let moment = moments.iter().find(|m| m.name == name).expect("there");
        for page in [Page::Guide, Page::Settings] {
            let size = boresight::ui::SMALLEST;
            let harness = harness_at(page, moment, (Theme::Dark, 1.0), size);
            assert_eq!(outside(&harness, size), Vec::<String>::new(), "{name} {page:?}");
        }
    }
}

#[test]
fn the_numbers_of_a_result_do_not_run_under_its_chart() {
    let moments = moments();
    for name in ["done good", "done untrustworthy"] {
        let moment = moments.iter().find(|m| m.name == name).expect("there");
        let size = boresight::ui::SMALLEST;
        let harness = harness_at(Page::Result, moment, (Theme::Dark, 1.0), size);
        let charts = harness.get_by_role_and_label(Role::Button, "Typical error").rect();
        for (words, rect) in read(&harness) {
            let is_left = rect.left() < charts.left() - 20.0 && rect.top() > charts.top();
            assert!(!is_left || rect.right() <= charts.left(), "{name}: {words:?} {rect:?}");
        }
    }
}
