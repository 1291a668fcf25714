//! Time of a painting of the guide page on the processor: laid out and cut into triangles, in
//! 1920×1080. `BORESIGHT_PAINT_TIMES=1 cargo test --test window paint_time -- --nocapture`, in two
//! versions at the same time, compares them.

use std::time::{Duration, Instant};

use boresight::{
    frame::{CaptureTime, Frame, FrameId, FrameKind},
    ui::{Screen, apply_theme, guide},
};
use egui::{Context, Rect, Vec2};
use image::GrayImage;

use crate::fixtures::story;

#[test]
fn paint_time_of_a_session() {
    if std::env::var_os("BORESIGHT_PAINT_TIMES").is_none() {
        return;
    }
    let story = story();
    let ctx = Context::default();
    apply_theme(&ctx);
    let mut screen = Screen { source: "HD Webcam".into(), ..Screen::default() };
    let image = GrayImage::from_fn(1280, 720, |x, y| image::Luma([((x / 8 + y / 8) % 200) as u8]));
    let mut times: Vec<Duration> = Vec::new();
    for round in 0..5_u32 {
        for (number, snapshot) in story.iter().enumerate() {
            let captured_at =
                snapshot.live.as_ref().map_or(CaptureTime { nanos: 0 }, |live| live.captured_at);
            screen.now_secs = f64::from(round) * 1e3 + number as f64 / 30.0;
            let frame = Frame {
                id: FrameId(number as u64),
                captured_at,
                kind: FrameKind::Video,
                name: String::new(),
                image: image.clone(),
            };
            screen.picture.show_frame(&frame, screen.now_secs);
            screen.show(snapshot.clone());
            let screen_rect = Rect::from_min_size(egui::Pos2::ZERO, Vec2::new(1920.0, 1080.0));
            let input = egui::RawInput {
                screen_rect: Some(screen_rect),
                time: Some(screen.now_secs),
                ..egui::RawInput::default()
            };
            let started = Instant::now();
            let mut output = ctx.run_ui(input, |ui| guide::show(ui, &screen, &mut Vec::new()));
            output.textures_delta.clear();
            let triangles = ctx.tessellate(output.shapes, 1.0);
            let took = started.elapsed();
            assert!(!triangles.is_empty());
            if round > 0 {
                times.push(took);
            }
        }
    }
    times.sort();
    let at = |share: f64| times[(share * (times.len() - 1) as f64) as usize];
    println!(
        "painting the guide page, {} times: p50 {:?}, p95 {:?}, p99 {:?}",
        times.len(),
        at(0.5),
        at(0.95),
        at(0.99)
    );
}
