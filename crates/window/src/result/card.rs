//! The result as one card: grade, one number against the goal, two sentences, one main action; and
//! the picture, bright where the goal is met.

use egui::{
    Align, Align2, Button, Color32, CornerRadius, Image, Label, Layout, Link, Painter, Rect,
    Response, RichText, Sense, Shape, Stroke, Ui, UiBuilder, Vec2, WidgetInfo, accesskit::Role,
    pos2, vec2,
};

use super::{
    super::{
        aloud,
        keys::UiAction,
        known_map,
        picture::{Dressing, Placed},
        screen::Screen,
        theme,
    },
    Context, error_lines,
    result_page::ResultPage,
};
use boresight_app::window::services::Ended;
use boresight_guide::session::Snapshot;
use boresight_present::{
    cause_picture::CausePicture,
    grade::Grade,
    result_card::{Error, ResultCard},
    text::{self, Act, window as words},
};

/// Height of the drawn page, in its own points.
const HIGH: f32 = 640.0;
/// Left column, and the picture's, in the page's points.
const COLUMNS: [[f32; 2]; 2] = [[40.0, 352.0], [408.0, 1096.0]];
/// Width of the page.
const WIDE: f32 = 1136.0;
/// Smallest letters on any screen.
const SMALLEST: f32 = 13.0;

/// Shows the card of the session `ended`.
pub(super) fn show(
    ui: &mut Ui,
    (screen, snapshot, card): (&Screen, &Snapshot, &ResultCard),
    (ended, context): (&Ended, &Context<'_>),
    page: &mut ResultPage,
    asks: &mut Vec<UiAction>,
) {
    let area = ui.available_rect_before_wrap();
    let k = (area.width() / WIDE).min(area.height() / HIGH);
    let origin = pos2(area.center().x - 0.5 * k * WIDE, area.center().y - 0.5 * k * HIGH);
    let column = |[left, right]: [f32; 2]| {
        let (top, bottom) = (origin.y + 36.0 * k, origin.y + (HIGH - 24.0) * k);
        Rect::from_min_max(pos2(origin.x + left * k, top), pos2(origin.x + right * k, bottom))
    };
    let paint = Page { k, screen, snapshot, card };
    let [left, right] = COLUMNS.map(column);
    ui.scope_builder(UiBuilder::new().max_rect(left), |ui| {
        paint.verdict(ui);
        paint.actions(ui, (ended, context), asks);
    });
    ui.scope_builder(UiBuilder::new().max_rect(right), |ui| {
        paint.picture(ui);
        paint.photos(ui);
        ui.with_layout(Layout::bottom_up(Align::Max), |ui| {
            if paint.link(ui, words::ENGINEERS_VIEW).clicked() {
                page.engineer = true;
            }
        });
    });
}

struct Page<'a> {
    /// Points of the screen for a point of the page.
    k: f32,
    screen: &'a Screen,
    snapshot: &'a Snapshot,
    card: &'a ResultCard,
}

impl Page<'_> {
    fn size(&self, points: f32) -> f32 {
        (self.k * points).max(SMALLEST)
    }

    /// Grade, error and goal, and two sentences.
    fn verdict(&self, ui: &mut Ui) {
        let k = self.k;
        let color = color(ui, self.card.grade);
        ui.spacing_mut().item_spacing = vec2(14.0 * k, 6.0 * k);
        ui.horizontal(|ui| {
            let (rect, _) = ui.allocate_exact_size(Vec2::splat(48.0 * k), Sense::hover());
            sign(ui.painter(), rect, self.card.grade, color, theme::ground(ui.visuals()));
            let words = text::grade(self.card.grade);
            let size = if words.len() > 10 { 30.0 } else { 48.0 };
            let said = RichText::new(words).font(theme::headline(self.size(size)));
            aloud::read_next(&ui.label(said));
        });
        if text::is_simulated(&self.screen.source) {
            self.small(ui, words::SIMULATED_CAMERA);
        }
        ui.add_space(14.0 * k);
        if let Some(error) = &self.card.error {
            self.error(ui, error, color);
        }
        ui.add_space(18.0 * k);
        let body = |words: &str| RichText::new(words).size(self.size(19.0));
        ui.label(body(&self.card.what).strong());
        ui.label(body(&self.card.action));
    }

    fn small(&self, ui: &mut Ui, words: &str) -> Response {
        ui.label(RichText::new(words).size(self.size(14.0)).weak())
    }

    fn link(&self, ui: &mut Ui, words: &str) -> Response {
        let color = ui.visuals().widgets.inactive.fg_stroke.color;
        ui.add(Link::new(RichText::new(words).size(self.size(16.0)).color(color)))
    }

    /// The one number, and a bar up to the goal.
    fn error(&self, ui: &mut Ui, error: &Error, color: Color32) {
        let k = self.k;
        let is_void = self.card.grade == Grade::NotTrustworthy;
        let weak = ui.visuals().weak_text_color();
        let strong = if is_void { weak } else { ui.visuals().strong_text_color() };
        let number = ui
            .horizontal(|ui| {
                let number = format!("±{}", error.number);
                let number = RichText::new(number).font(theme::headline(self.size(72.0)));
                let of_number = ui.label(number.color(strong)).rect;
                let unit = RichText::new(error.unit).size(self.size(30.0)).color(weak);
                ui.with_layout(Layout::left_to_right(Align::Max), |ui| ui.label(unit));
                of_number
            })
            .inner;
        if is_void {
            let y = number.center().y;
            let ends = [pos2(number.left() - 6.0 * k, y), pos2(number.right() + 60.0 * k, y)];
            ui.painter().line_segment(ends, Stroke::new(5.0 * k, color));
            return;
        }
        let (bar, _) = ui.allocate_exact_size(vec2(ui.available_width(), 14.0 * k), Sense::hover());
        self.bar(ui, bar, error.of_goal as f32);
        ui.horizontal(|ui| {
            self.small(ui, error.name);
            ui.with_layout(Layout::right_to_left(Align::Min), |ui| {
                self.small(ui, &words::your_goal(&self.card.goal));
            });
        });
    }

    /// Bar of the error, with a mark at the goal; the part beyond the goal is hatched.
    fn bar(&self, ui: &Ui, rect: Rect, of_goal: f32) {
        let painter = ui.painter_at(rect.expand(2.0));
        let bar = rect.shrink2(vec2(0.0, 3.0 * self.k));
        let whole = of_goal.max(1.0);
        let at = |share: f32| bar.left() + bar.width() * share / whole;
        let palette = theme::palette(ui.visuals());
        let fill = if of_goal <= 1.0 { palette.good } else { palette.care };
        painter.rect_filled(bar, 3.0, ui.visuals().widgets.noninteractive.bg_stroke.color);
        painter.rect_filled(bar.with_max_x(at(of_goal.min(1.0))), 3.0, fill);
        if of_goal > 1.0 {
            known_map::hatch_rect(&painter, bar.with_min_x(at(1.0)), fill);
        }
        let mark = Stroke::new(2.5 * self.k, ui.visuals().strong_text_color());
        let x = at(1.0).min(rect.right() - self.k);
        painter.line_segment([pos2(x, rect.top()), pos2(x, rect.bottom())], mark);
    }

    /// The main action as a button, and the others as links.
    fn actions(
        &self,
        ui: &mut Ui,
        (ended, context): (&Ended, &Context<'_>),
        asks: &mut Vec<UiAction>,
    ) {
        let k = self.k;
        ui.add_space(20.0 * k);
        let report = ended.files.iter().find(|file| file.extension().is_some_and(|e| e == "html"));
        let simulated = text::is_simulated(&self.screen.source);
        let certificate = if simulated { words::SAMPLE } else { words::CERTIFICATE };
        let (main, other) = match self.card.grade {
            Grade::Good => {
                (report.map(|file| (certificate, UiAction::Show(file.clone()))), Some(more()))
            }
            Grade::Care => {
                let main = if self.card.starts_over() { again() } else { more() };
                (Some(main), report.map(|file| (certificate, UiAction::Show(file.clone()))))
            }
            Grade::Unfinished => (Some(more()), None),
            Grade::NotTrustworthy => (Some(again()), None),
        };
        if let Some((words, ask)) = main {
            let (fill, ink) = if ui.visuals().dark_mode {
                (Color32::from_gray(244), theme::BAND)
            } else {
                (theme::BAND, Color32::WHITE)
            };
            let words = RichText::new(words).font(theme::headline(self.size(22.0))).color(ink);
            let button = Button::new(words).fill(fill).corner_radius(CornerRadius::same(255));
            if ui.add_sized([ui.available_width(), 56.0 * k], button).clicked() {
                asks.push(ask);
            }
        }
        ui.add_space(12.0 * k);
        ui.horizontal(|ui| {
            let export = match self.card.grade {
                Grade::NotTrustworthy | Grade::Unfinished => words::EXPORT_ANYWAY,
                Grade::Good | Grade::Care => words::USE_IN,
            };
            ui.menu_button(RichText::new(export).size(self.size(16.0)), |ui| {
                for (index, name) in context.formats.iter().enumerate() {
                    if ui.button(*name).on_hover_text(words::export_tip(name)).clicked() {
                        asks.push(UiAction::Export(index));
                        ui.close();
                    }
                }
            });
            if let Some((words, ask)) = other {
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    if self.link(ui, words).clicked() {
                        asks.push(ask);
                    }
                });
            }
        });
        match context.exported {
            Some(Ok(file)) => {
                self.small(ui, &words::written(file));
            }
            Some(Err(trouble)) => error_lines(ui, trouble),
            None => {}
        }
        if let Some(trouble) = &ended.trouble {
            error_lines(ui, trouble);
        }
        ui.with_layout(Layout::bottom_up(Align::Min), |ui| {
            let folder = RichText::new(words::stored_in(&ended.folder)).small().weak();
            ui.add(Label::new(folder).truncate());
        });
    }

    /// The newest picture, bright where the goal is met, hatched where no board was.
    fn picture(&self, ui: &mut Ui) {
        let image_size = self.snapshot.setup.image_size;
        let most = vec2(ui.available_width(), 400.0 * self.k);
        let (rect, response) = ui.allocate_exact_size(most, Sense::hover());
        let placed = Placed::within(rect, image_size, self.screen.preferences.mirrored);
        let known = self.screen.known.borrow_mut().of(self.snapshot);
        if let Some(cause) = &self.card.cause {
            self.cause(ui, &placed, cause);
            response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &cause.caption));
            self.small(ui, &cause.caption);
            return;
        }
        let dressing = Dressing { known, ..Dressing::default() };
        if let Some(texture) = self.screen.picture.texture(ui.ctx(), &dressing) {
            let radius = CornerRadius::same((10.0 * self.k) as u8);
            let image = Image::new((texture, placed.rect.size())).uv(placed.uv());
            image.corner_radius(radius).paint_at(ui, placed.rect);
        } else {
            ui.painter().rect_filled(placed.rect, 10.0 * self.k, ui.visuals().extreme_bg_color);
        }
        let share = dressing.known.as_ref().map_or(0.0, |known| known.share());
        if let Some(known) = &dressing.known {
            let painter = ui.painter_at(placed.rect);
            known_map::hatch(&painter, &placed, known);
            known_map::border(&painter, &placed, known, &[]);
        }
        let met = words::meets_goal(share);
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &met));
        if self.card.grade == Grade::NotTrustworthy {
            return;
        }
        ui.horizontal(|ui| {
            let swatch = |ui: &mut Ui| {
                let (at, _) = ui.allocate_exact_size(vec2(22.0, 14.0) * self.k, Sense::hover());
                at
            };
            let at = swatch(ui);
            let line = Stroke::new(1.5, theme::GREEN);
            ui.painter().rect_filled(at, 2.0, Color32::from_gray(150));
            ui.painter().rect_stroke(at, 2.0, line, egui::StrokeKind::Inside);
            self.small(ui, &met);
            let at = swatch(ui);
            ui.painter().rect_filled(at, 2.0, Color32::from_gray(60));
            known_map::hatch_rect(ui.painter(), at, Color32::from_white_alpha(120));
            self.small(ui, words::NO_BOARD_HERE);
        });
    }

    /// The cause on the picture of its view.
    fn cause(&self, ui: &Ui, placed: &Placed, cause: &CausePicture) {
        let painter = ui.painter_at(placed.rect);
        painter.rect_filled(placed.rect, 0.0, theme::BAND);
        let views = &self.snapshot.views;
        let view = cause.place.and_then(|place| views.get(place)).or(views.last());
        if let Some(texture) = view.and_then(|view| self.screen.thumbnails.get(&view.number)) {
            painter.image(texture.id(), placed.rect, placed.uv(), Color32::from_gray(110));
        }
        let font = theme::headline(self.size(18.0));
        let parts = cause.parts.iter().zip([Color32::WHITE, theme::RED]);
        for (part, ((name, corners_px), color)) in parts.enumerate() {
            let [a, b, c, d] = corners_px.map(|px| placed.pos(&px));
            let (closed, stroke) = ([a, b, c, d, a], Stroke::new(3.0 * self.k, color));
            if color == Color32::WHITE {
                painter.extend(Shape::dashed_line(&closed, stroke, 10.0 * self.k, 10.0 * self.k));
            } else {
                painter.add(Shape::line(closed.to_vec(), stroke));
            }
            // A mirrored picture has its left corner on the right.
            let (down, anchor) = match cause.is_inner(part) {
                true => (3.0, Align2::LEFT_TOP),
                false => (-3.0, Align2::LEFT_BOTTOM),
            };
            let at = pos2(a.x.min(b.x), a.y) + vec2(6.0, down) * self.k;
            painter.text(at, anchor, name, font.clone(), color);
        }
    }

    /// The views, as many as fit, and their number.
    fn photos(&self, ui: &mut Ui) {
        let size = self.snapshot.setup.image_size;
        let high = 56.0 * self.k;
        let wide = high * size.width_px as f32 / size.height_px.max(1) as f32;
        ui.add_space(4.0 * self.k);
        ui.horizontal(|ui| {
            let count = self.snapshot.views.len();
            let fit = ((ui.available_width() - 90.0 * self.k) / (wide + 14.0 * self.k)) as usize;
            for view in self.snapshot.views.iter().take(fit) {
                if let Some(texture) = self.screen.thumbnails.get(&view.number) {
                    let tip = words::thumbnail_tip(view, self.screen.preferences.mirrored);
                    let image = Image::new((texture.id(), vec2(wide, high)));
                    let image = ui.add(image.corner_radius(6.0 * self.k));
                    image.widget_info(|| WidgetInfo::labeled(Role::Image, true, &tip));
                    image.on_hover_text(tip);
                }
            }
            self.small(ui, &words::photos(count));
        });
    }
}

fn more() -> (&'static str, UiAction) {
    (words::TAKE_MORE, UiAction::TakeMore)
}

fn again() -> (&'static str, UiAction) {
    (words::START_AGAIN, UiAction::Act(Act::New))
}

pub(crate) fn color(ui: &Ui, grade: Grade) -> Color32 {
    let palette = theme::palette(ui.visuals());
    match grade {
        Grade::Good => palette.good,
        Grade::Care => palette.care,
        Grade::Unfinished => palette.info,
        Grade::NotTrustworthy => palette.bad,
    }
}

/// Sign with a distinctive shape: a disc with a tick, a triangle, an open ring, or an octagon with
/// a cross.
pub(crate) fn sign(painter: &Painter, rect: Rect, grade: Grade, color: Color32, ground: Color32) {
    let (middle, half) = (rect.center(), 0.5 * rect.width());
    let at = |x: f32, y: f32| middle + half * vec2(x, y);
    let stroke = Stroke::new(0.17 * half, ground);
    match grade {
        Grade::Good => {
            painter.circle_filled(middle, half, color);
            painter.add(Shape::line(vec![at(-0.42, 0.02), at(-0.1, 0.34), at(0.42, -0.3)], stroke));
        }
        Grade::Care => {
            let corners = vec![at(0.0, -0.92), at(1.0, 0.84), at(-1.0, 0.84)];
            painter.add(Shape::convex_polygon(corners, color, Stroke::NONE));
            painter.line_segment([at(0.0, -0.3), at(0.0, 0.3)], stroke);
            painter.circle_filled(at(0.0, 0.58), 0.1 * half, ground);
        }
        Grade::Unfinished => {
            painter.circle_stroke(middle, 0.86 * half, Stroke::new(0.2 * half, color));
        }
        Grade::NotTrustworthy => {
            let corner = |eighth: usize| {
                let turn = (eighth as f32 + 0.5) * std::f32::consts::FRAC_PI_4;
                middle + half * Vec2::angled(turn)
            };
            let corners = (0..8).map(corner).collect();
            painter.add(Shape::convex_polygon(corners, color, Stroke::NONE));
            painter.line_segment([at(-0.36, -0.36), at(0.36, 0.36)], stroke);
            painter.line_segment([at(-0.36, 0.36), at(0.36, -0.36)], stroke);
        }
    }
}
