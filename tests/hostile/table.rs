//! Corner tables.

use boresight::{calibration::files::corner_table, geometry::Corner};
use nalgebra::Point2;

use crate::harness::{only_numbers, run};

const CORNERS: usize = 6;

#[test]
fn tables() {
    let corners: Vec<Corner> =
        (0..CORNERS).map(|i| Corner::isotropic(Point2::new(10.5 * i as f64, 7.25), 0.1)).collect();
    let seeds = [
        corner_table::write([("a.png", Some(corners.as_slice())), ("b.png", None)]),
        "a 1 2 0\na 3 4 -\nb - - -\n# c\n\nc 1 2\n".to_owned(),
    ];
    run(
        "table",
        |mutator| mutator.text(&seeds),
        |input| {
            let text = String::from_utf8_lossy(input);
            let Ok(views) = corner_table::read(&text, CORNERS) else { return Ok(false) };
            // Names may say anything. A table doesn't state the expected place of a missing corner.
            let seen = |views: &[corner_table::TableView]| -> Vec<Corner> {
                let corners = views.iter().flat_map(|view| view.corners.iter().flatten());
                corners.filter(|corner| corner.is_seen()).copied().collect()
            };
            only_numbers(&seen(&views))?;
            let lines = views.iter().map(|view| (view.name.as_str(), view.corners.as_deref()));
            let again = corner_table::read(&corner_table::write(lines), CORNERS);
            let again = again.map_err(|err| format!("what is written reads back as: {err}"))?;
            let places = |views: &[corner_table::TableView]| -> Vec<Option<Point2<f64>>> {
                let corners = views.iter().flat_map(|view| view.corners.iter().flatten());
                corners.map(|corner| corner.is_seen().then_some(corner.px)).collect()
            };
            // Two names may become one; the table is then refused above.
            if places(&again) == places(&views) {
                Ok(true)
            } else {
                Err("corners read back otherwise".into())
            }
        },
    );
}
