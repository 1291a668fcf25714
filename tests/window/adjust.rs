//! Page to push a watched camera back.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use boresight::{
    app::{Announcer, window::services::Memory},
    config::Config,
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
    geometry::Camera,
    station::{
        AdjustPage, Feed, Link, Step, Taken, WatchedCamera, WayBack, adjust, street::Street,
    },
    ui::{SMALLEST, apply_theme},
    watch::{Advice, Axis, Lens},
};
use egui::{Theme, Vec2, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use image::GrayImage;
use nalgebra::Point2;
use tempfile::TempDir;

use crate::painter;

fn page(step: WayBack, size: Vec2) -> Harness<'static, AdjustPage> {
    let link = Arc::new(Link::default());
    link.show(step);
    let mut harness = Harness::builder()
        .with_size(size)
        .with_theme(Theme::Dark)
        .renderer(painter())
        .with_context_setup(apply_theme)
        .build_ui_state(
            |ui, page: &mut AdjustPage| page.show(ui),
            AdjustPage::new(link, false, &Memory::default()),
        );
    harness.run();
    harness
}

#[test]
fn who_steps_before_the_camera_reads_the_other_side() {
    let frame = Arc::new(Frame {
        id: FrameId(1),
        captured_at: CaptureTime { nanos: 0 },
        kind: FrameKind::Video,
        name: String::new(),
        image: GrayImage::new(320, 180),
    });
    let size = ImageSize::of(&frame.image);
    let lens = Lens::new(Camera::pinhole(300.0, size.centre_px()), None, size);
    let step = Step {
        advice: Advice::Push { axis: Axis::Pan, off_px: 14.0 },
        closeness: Some(0.3),
        frame: &frame,
        outline: vec![Point2::new(100.0, 50.0)],
    };
    let mut page = page(WayBack::of(&step, &lens), SMALLEST);
    page.get_by_role_and_label(Role::Image, "Live picture");
    page.get_by_role_and_label(Role::Status, "Push it to the right. 14 px");
    page.get_by_role_and_label(Role::CheckBox, "I face the camera").click();
    page.run();
    page.get_by_role_and_label(Role::Status, "Push it to the left. 14 px");
}

#[test]
fn the_way_back_is_painted() {
    let mut page = pushed_street();
    let pushed = page.get_by_role(Role::Status).accesskit_node().label().expect("said");
    let off_px = pushed.strip_prefix("Push it to the right. ").and_then(|s| s.strip_suffix(" px"));
    let off_px: f64 = off_px.expect(&pushed).parse().expect("a number");
    assert!((13.0..=15.0).contains(&off_px), "{pushed}");
    // The edges are drawn over the grey picture, in a colour between amber and green.
    let scene = page.get_by_role_and_label(Role::Image, "Live picture").rect();
    let picture = page.render().expect("painted");
    let is_in = |x: u32, y: u32| scene.contains(egui::pos2(x as f32, y as f32));
    let coloured = picture.enumerate_pixels().filter(|(x, y, pixel)| {
        let [red, green, blue, _] = pixel.0;
        is_in(*x, *y) && red.max(green) > 100 && blue < red.max(green) / 2
    });
    let share = coloured.count() as f32 / scene.area();
    assert!((0.002..0.2).contains(&share), "{share}");
}

/// Page of a simulated camera pushed by 14 px to the left.
pub(crate) fn pushed_street() -> Harness<'static, AdjustPage> {
    let folder = TempDir::new().expect("a folder");
    let street = Street::parse("1,days=0.5").expect("a street");
    let lens = Lens::new(street.camera, None, street.image_size);
    let (mut camera, _) =
        WatchedCamera::open(folder.path(), "gate", None, (Some(lens), false)).expect("a store");
    for hour in 6..12 {
        let at_secs = street.began_secs + 3600.0 * f64::from(hour);
        camera.look(vec![street.picture(at_secs)], Taken::at(at_secs)).expect("recorded");
    }
    let pushed = ["sim:street:1,days=0.5,pan=14px@0d".to_owned()];
    let config = Config::load(None, &[]).expect("settings");
    let feed = Feed::parse(&pushed, &config, &Announcer::silent()).expect("a street");
    let (stop, mut first) = (AtomicBool::new(false), None);
    adjust(&camera, &feed, &stop, &mut |step| {
        first.get_or_insert_with(|| WayBack::of(step, camera.lens()));
        stop.store(true, Ordering::Relaxed);
    })
    .expect("measured");
    page(first.expect("a step"), Vec2::new(1280.0, 800.0))
}
