//! What each two cameras have reached, on a line between their pictures.

use egui::{Color32, Id, Pos2, Rect, Sense, Stroke, Ui, Vec2, WidgetInfo, accesskit::Role};

use super::super::theme;
use boresight_app::session::rig_run::RigLink;

/// Diameter of dots, and their distance.
const DOTS: [f32; 2] = [7.0, 14.0];
/// Steps along a line at which a label may stand.
const STEPS: usize = 50;

/// Draws the lines, below the pictures. Returns the places of the labels.
pub(super) fn lines(ui: &Ui, pictures: &[Rect], links: &[RigLink]) -> Vec<Rect> {
    let mut taken: Vec<Rect> = Vec::new();
    for link in links {
        let [a, b] = link.of.map(|camera| pictures[camera].center());
        let color = color(link);
        if link.is_met {
            ui.painter().line_segment([a, b], Stroke::new(4.0, color));
        } else {
            for at in dots(a, b) {
                ui.painter().circle_filled(at, 0.5 * DOTS[0], color);
            }
        }
        let size = galley_size(ui, &link.words) + Vec2::new(2.0, 1.0) * theme::UNIT;
        let place = place([a, b], size, pictures, &taken);
        taken.push(place);
    }
    taken
}

/// Shows the labels at their places, over the pictures.
pub(super) fn labels(ui: &Ui, places: &[Rect], links: &[RigLink], names: &[&str]) {
    for (link, place) in links.iter().zip(places) {
        let painter = ui.painter();
        painter.rect_filled(*place, 0.5 * place.height(), theme::BAND);
        let rim = Stroke::new(2.0, color(link));
        painter.rect_stroke(*place, 0.5 * place.height(), rim, egui::StrokeKind::Inside);
        let font = egui::FontId::proportional(theme::BODY);
        let middle = egui::Align2::CENTER_CENTER;
        painter.text(place.center(), middle, &link.words, font, Color32::WHITE);
        let [a, b] = link.of.map(|camera| names[camera]);
        let told = format!("{a} to {b}: {}", link.words);
        let response = ui.interact(*place, Id::unique(&told), Sense::hover());
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &told));
        response.on_hover_text(told);
    }
}

fn color(link: &RigLink) -> Color32 {
    if link.is_met { theme::GREEN } else { theme::AMBER }
}

fn galley_size(ui: &Ui, words: &str) -> Vec2 {
    let font = egui::FontId::proportional(theme::BODY);
    ui.painter().layout_no_wrap(words.to_owned(), font, Color32::WHITE).size()
}

fn dots(a: Pos2, b: Pos2) -> impl Iterator<Item = Pos2> {
    let count = ((b - a).length() / DOTS[1]) as usize;
    (0..=count).map(move |dot| a + (b - a) * (dot as f32 / count.max(1) as f32))
}

/// Place of a label on the line between `ends`: nearest to the middle where neither a picture nor
/// another label is.
fn place(ends: [Pos2; 2], size: Vec2, pictures: &[Rect], taken: &[Rect]) -> Rect {
    let [a, b] = ends;
    let at = |share: f32| Rect::from_center_size(a + (b - a) * share, size);
    let is_free = |rect: &Rect| !pictures.iter().chain(taken).any(|other| other.intersects(*rect));
    let offsets = (0..=STEPS).map(|step| 0.5 * step as f32 / STEPS as f32);
    let mut candidates = offsets.flat_map(|off| [at(0.5 - off), at(0.5 + off)]);
    candidates.find(is_free).unwrap_or_else(|| at(0.5))
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{pos2, vec2};

    #[test]
    fn a_label_avoids_pictures_and_other_labels() {
        let picture = |x: f32, y: f32| Rect::from_min_size(pos2(x, y), vec2(300.0, 200.0));
        let four =
            [picture(0.0, 0.0), picture(420.0, 0.0), picture(0.0, 280.0), picture(420.0, 280.0)];
        let size = vec2(80.0, 24.0);
        let mut taken = Vec::new();
        for [a, b] in [[0, 1], [0, 2], [1, 3], [2, 3], [0, 3], [1, 2]] {
            let label = place([four[a].center(), four[b].center()], size, &four, &taken);
            let others = four.iter().chain(&taken).filter(|other| other.intersects(label));
            assert_eq!(others.count(), 0, "{a} to {b}: {label:?}");
            taken.push(label);
        }
    }
}
