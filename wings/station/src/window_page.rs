//! Way back of a watched camera: the live picture with the expected edges of the scene, an arrow, a
//! number, a sentence, and a tone rising as the camera comes nearer.

use std::{
    f32::consts::{FRAC_PI_2, PI},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, Builder},
};

use egui::{
    CentralPanel, Checkbox, Color32, FontId, Frame, Image, Mesh, Painter, Panel, Rect, Sense,
    Shape, Ui, Vec2, ViewportCommand, WidgetInfo, accesskit::Role, pos2,
};
use nalgebra::Point2;

use crate::{
    Feed, Step, WatchedCamera, with_scale,
    words::{self as watch_words, Cue},
};
use boresight_app::{
    usual_memory,
    window::{memory, services::Memory},
};
use boresight_geometry::frame;
use boresight_guide::session::Gravity;
use boresight_present::{instruction::Movement, text::window as words};
use boresight_watch::{Advice, Axis, Lens};
use boresight_window::{
    guide::icon,
    open::or_say_why,
    picture::{Dressing, Picture, Placed},
    screen::Preferences,
    sound::{Sound, Tone},
    theme,
};

/// Time between two looks for a new picture, and between two tones.
const LOOK: std::time::Duration = std::time::Duration::from_millis(40);
const TONE_SECS: f64 = 0.4;
/// Minimum closeness for a tone.
const HEARD: f64 = 0.25;
/// Height of the words and of the bar below the picture, as shares of the window's.
const WORDS: f32 = 0.2;
const BAR: f32 = 0.035;

/// Step as shown by the window.
#[derive(Clone, Debug)]
pub struct WayBack {
    frame: Arc<frame::Frame>,
    /// Next action for a person behind the camera, and for a person facing the camera.
    said: [(Advice, Cue); 2],
    gravity: Gravity,
    close: Option<f64>,
    outline: Vec<Point2<f64>>,
}

impl WayBack {
    /// Step of a camera with the given lens.
    pub fn of(step: &Step<'_>, lens: &Lens) -> Self {
        let said = |advice| (advice, with_scale(lens, |scale| watch_words::cue(&advice, scale)));
        Self {
            frame: Arc::clone(step.frame),
            said: [step.advice, watch_words::facing(&step.advice)].map(said),
            gravity: watch_words::gravity(&step.advice),
            close: step.closeness,
            outline: step.outline.clone(),
        }
    }
}

/// Link between the window and the measuring thread.
#[derive(Debug, Default)]
pub struct Link {
    newest: Mutex<Option<WayBack>>,
    /// True once the thread has failed or stopped.
    pub has_ended: AtomicBool,
}

impl Link {
    /// Shows a step from now on.
    pub fn show(&self, step: WayBack) {
        *self.newest.lock().unwrap_or_else(PoisonError::into_inner) = Some(step);
    }
}

/// Page for a watched camera's way back.
pub struct AdjustPage {
    link: Arc<Link>,
    shown: Option<WayBack>,
    picture: Picture,
    faces: bool,
    /// Sound; `None` if the person has turned the tone off.
    sound: Option<Sound>,
    sounded_secs: f64,
}

impl AdjustPage {
    /// Page for the steps from `link`, for a person behind the camera or, with `faces`, facing the
    /// camera, with the choices in `memory`.
    pub fn new(link: Arc<Link>, faces: bool, memory: &Memory) -> Self {
        let has_tone = memory.tone.unwrap_or(Preferences::default().tone);
        let (shown, picture, sound) = (None, Picture::default(), has_tone.then(Sound::found));
        Self { link, shown, picture, faces, sound, sounded_secs: 0.0 }
    }

    /// Shows the page.
    pub fn show(&mut self, ui: &mut Ui) {
        if self.link.has_ended.load(Ordering::Relaxed) {
            ui.ctx().send_viewport_cmd(ViewportCommand::Close);
        }
        let newest = self.link.newest.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(step) = newest {
            self.picture.show_image(&step.frame.image);
            self.shown = Some(step);
        }
        self.sound(ui.input(|input| input.time));
        ui.ctx().request_repaint_after(LOOK);
        let window = ui.ctx().content_rect().height();
        let close = self.shown.as_ref().and_then(|shown| shown.close);
        Panel::top("words").frame(Frame::new()).show_separator_line(false).show(ui, |ui| {
            self.words(ui, WORDS * window);
        });
        Panel::bottom("side").show_separator_line(false).show(ui, |ui| {
            ui.add(Checkbox::new(&mut self.faces, watch_words::FACES));
        });
        Panel::bottom("close").frame(Frame::new()).show_separator_line(false).show(ui, |ui| {
            let size = Vec2::new(ui.available_width(), BAR * window);
            let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
            theme::band(ui, rect);
            if let Some(close) = close {
                let end = rect.left() + rect.width() * close as f32;
                ui.painter().rect_filled(rect.with_max_x(end), 0.0, theme::approach(close as f32));
            }
        });
        CentralPanel::no_frame().show(ui, |ui| self.scene(ui));
    }

    fn words(&self, ui: &mut Ui, high: f32) {
        let (rect, response) =
            ui.allocate_exact_size(Vec2::new(ui.available_width(), high), Sense::hover());
        let painter = ui.painter_at(rect);
        theme::band(ui, rect);
        let color = self.shown.as_ref().map_or(theme::GREY, |shown| match shown.gravity {
            Gravity::Bad => theme::RED,
            Gravity::Good => theme::GREEN,
            Gravity::Careful => theme::AMBER,
            Gravity::Plain => Color32::WHITE,
        });
        let said = self.shown.as_ref().map(|shown| &shown.said[usize::from(self.faces)]);
        let (number, sentence) = said
            .map_or(("", words::STARTING), |(_, cue)| (cue.number.as_str(), cue.sentence.as_str()));
        let line = |text: &str, size: f32, color| {
            painter.layout_no_wrap(text.to_owned(), FontId::proportional(size), color)
        };
        // Sign and number are read from a ladder; the sentence takes the remaining width.
        let square = Rect::from_min_size(rect.min, Vec2::splat(high)).shrink(0.15 * high);
        if let Some((advice, _)) = said {
            sign(&painter, square, advice, color);
        }
        let number_at = rect.left() + high + theme::UNIT;
        let galley = line(number, 0.55 * high, color);
        let at = number_at + galley.size().x + 2.0 * theme::UNIT;
        painter.galley(pos2(number_at, rect.center().y - 0.5 * galley.size().y), galley, color);
        let room = rect.right() - at - 2.0 * theme::UNIT;
        let fits = (room / line(sentence, 0.3 * high, color).size().x.max(1.0)).min(1.0);
        let galley = line(sentence, (0.3 * high * fits).max(theme::SMALL), Color32::WHITE);
        let top = rect.center().y - 0.5 * galley.size().y;
        painter.galley(pos2(at, top), galley, Color32::WHITE);
        let said = format!("{sentence} {number}");
        response.widget_info(|| WidgetInfo::labeled(Role::Status, true, said.trim_end()));
    }

    fn scene(&self, ui: &mut Ui) {
        let area = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(area, Sense::hover());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, words::PICTURE));
        let texture = self.picture.texture(ui.ctx(), &Dressing::default());
        let (Some(shown), Some(texture)) = (&self.shown, texture) else {
            theme::band(ui, area);
            return;
        };
        let size = frame::ImageSize::of(&shown.frame.image);
        let placed = Placed::within(area, size, self.faces);
        for bar in placed.bars(area) {
            theme::band(ui, bar);
        }
        Image::new((texture, placed.rect.size())).uv(placed.uv()).paint_at(ui, placed.rect);
        let color = shown.close.map_or(theme::GREY, |close| theme::approach(close as f32));
        // Dark below, to show the edges on any picture.
        let dot = placed.scale().max(1.0);
        for (side, color) in [(dot + 1.5, Color32::from_black_alpha(140)), (dot, color)] {
            let mut mesh = Mesh::default();
            for px in &shown.outline {
                let square = Rect::from_center_size(placed.pos(px), Vec2::splat(side));
                mesh.add_colored_rect(square, color);
            }
            ui.painter_at(placed.rect).add(Shape::mesh(mesh));
        }
    }

    /// Tone, rising by two octaves on the way.
    fn sound(&mut self, now_secs: f64) {
        let Some(sound) = &mut self.sound else { return };
        let close = self.shown.as_ref().and_then(|shown| shown.close).unwrap_or(0.0);
        if close > HEARD && now_secs - self.sounded_secs >= TONE_SECS {
            self.sounded_secs = now_secs;
            sound.play(Tone::Near { hertz: (200.0 * 4_f64.powf(close)) as u16 });
        }
    }
}

/// Shows in a window how to push `camera` back until it's closed; `hear` gets every step. True if
/// the camera stands right.
pub(crate) fn adjust(
    (camera, feed): (&WatchedCamera, &Feed),
    faces: bool,
    stop: &AtomicBool,
    hear: &mut (dyn FnMut(&Step<'_>) + Send),
) -> anyhow::Result<bool> {
    let link = Arc::new(Link::default());
    thread::scope(|scope| {
        let shown = Arc::clone(&link);
        let work = move || {
            let outcome = crate::adjust(camera, feed, stop, &mut |step| {
                shown.show(WayBack::of(step, camera.lens()));
                hear(step);
            });
            shown
                .has_ended
                .store(outcome.is_err() || stop.load(Ordering::Relaxed), Ordering::Relaxed);
            outcome
        };
        let worker = Builder::new().name("way back".into()).spawn_scoped(scope, work)?;
        let memory = usual_memory().as_deref().map(memory::read).unwrap_or_default();
        let opened = or_say_why(boresight_window::open(|ctx| {
            theme::apply(ctx);
            Box::new(AdjustPage::new(link, faces, &memory))
        }));
        stop.store(true, Ordering::Relaxed);
        let outcome = worker.join().unwrap_or_else(|payload| std::panic::resume_unwind(payload));
        opened.and(outcome)
    })
}

/// Sign of the next action; none while the camera's direction is unknown.
fn sign(painter: &Painter, rect: Rect, advice: &Advice, color: Color32) {
    let shift = |towards_rad| icon::paint(painter, rect, Movement::Shift { towards_rad }, color);
    match *advice {
        Advice::Lost(_) => {}
        Advice::Push { axis: Axis::Pan, off_px } => shift(if off_px > 0.0 { 0.0 } else { PI }),
        Advice::Push { axis: Axis::Tilt, off_px } => {
            shift(if off_px > 0.0 { -FRAC_PI_2 } else { FRAC_PI_2 });
        }
        Advice::Push { axis: Axis::Roll, off_px } => {
            icon::paint_roll(painter, rect, off_px > 0.0, color);
        }
        Advice::Hold { .. } | Advice::Tighten { .. } | Advice::Right => {
            painter.circle_filled(rect.center(), 0.3 * rect.width(), color);
        }
    }
}

impl eframe::App for AdjustPage {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        theme::background(visuals)
    }
}
