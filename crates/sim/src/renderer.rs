//! Pictures of the board through the true lens.
//!
//! Each pixel's ray is computed once. A frame traces the rays of the board's surroundings onto the
//! sheet; pixels away from any edge are flat, the others are sampled 64 times over the pixel and
//! the exposure. Then come the lens blur, the light and the noise, in this order. With a rolling
//! shutter, each row has its exposure time.

use std::rc::Rc;

use image::GrayImage;
use nalgebra::{Isometry3, Point2, Point3};
use rand::RngExt;
use rand_distr::StandardNormal;

use super::{
    backdrop,
    blur::{Kernel, Region},
    exposure::Exposure,
    print::{Patch, Print, Share},
    rng_stream::RngStream,
    scene::Scene,
    sheet_view::{PixelRay, SheetView},
    shutter::{Shutter, middle_pose},
    technician::Hand,
};
use boresight_geometry::Camera;

/// Normal deviates drawn once; each row of each frame starts at a different index.
const NOISE_TABLE: usize = 1 << 18;

/// Renderer of a scene's frames. Keeps constant parts and working memory.
pub struct Renderer {
    camera: Camera,
    print: Print,
    dark_level: f32,
    light_level: f32,
    seed: u64,
    width: usize,
    height: usize,
    kernel: Kernel,
    /// Padding of rays and canvas around the picture, in pixels.
    pad: usize,
    stride: usize,
    rays_x: Vec<f32>,
    rays_y: Vec<f32>,
    widest_ray: f64,
    /// Room before the lens's blur, padded.
    sharp_room: Vec<f32>,
    /// Room with blur and light, not padded.
    room: Vec<f32>,
    gain: Vec<f32>,
    noise: Vec<f32>,
    canvas: Vec<f32>,
    half_blurred: Vec<f32>,
    traced: Traced,
    hand: Option<Hand>,
}

/// Sheet coordinates of three neighbouring rows.
#[derive(Default)]
struct Traced {
    us: [Vec<f32>; 3],
    vs: [Vec<f32>; 3],
}

/// Sheet during the exposure of a row.
struct RowViews {
    centre: SheetView,
    exposure: Exposure,
}

impl Renderer {
    /// Prepares the scene: rays through the lens, room, light, noise.
    pub fn new(scene: &Scene) -> Self {
        let (width, height) =
            (scene.image_size.width_px as usize, scene.image_size.height_px as usize);
        // Sampling of edge pixels already adds the blur of another box.
        let kernel = Kernel::with_variance(scene.psf_sigma_px.powi(2) - 1.0 / 12.0);
        let pad = kernel.radius() + 1;
        let (stride, lines) = (width + 2 * pad, height + 2 * pad);
        let px = |x: usize, y: usize| Point2::new(x as f64 - pad as f64, y as f64 - pad as f64);
        let (mut rays_x, mut rays_y) =
            (Vec::with_capacity(stride * lines), Vec::with_capacity(stride * lines));
        let mut widest_ray = 0.0_f64;
        for y in 0..lines {
            for x in 0..stride {
                let ray = scene.camera.normalized_from_px(&px(x, y));
                widest_ray = ray.map_or(widest_ray, |ray| widest_ray.max(ray.coords.norm()));
                rays_x.push(ray.map_or(f32::NAN, |ray| ray.x as f32));
                rays_y.push(ray.map_or(f32::NAN, |ray| ray.y as f32));
            }
        }
        let gain = (0..width * height)
            .map(|i| {
                let px = Point2::new((i % width) as f64, (i / width) as f64);
                scene.light.gain(&px, scene.image_size) as f32
            })
            .collect();
        let mut rng = RngStream::Noise.rng(scene.seed);
        let sigma = scene.noise_sigma.max(0.0) as f32;
        let noise = (0..NOISE_TABLE + width)
            .map(|_| sigma * rng.sample::<f32, _>(StandardNormal))
            .collect();
        let sharp_room = backdrop::draw(scene, stride, lines).levels;
        let mut renderer = Self {
            camera: scene.camera,
            print: Print::new(&scene.board, scene.board_id, scene.bend_m),
            dark_level: scene.light.dark_level as f32,
            light_level: scene.light.light_level as f32,
            seed: scene.seed,
            width,
            height,
            kernel,
            pad,
            stride,
            rays_x,
            rays_y,
            widest_ray,
            canvas: sharp_room.clone(),
            sharp_room,
            room: vec![0.0; width * height],
            gain,
            noise,
            half_blurred: vec![0.0; stride * lines],
            traced: Traced::default(),
            hand: None,
        };
        let everything = Region { x0: 0, x1: width, y0: 0, y1: height };
        renderer.blur_along_rows(&everything);
        let mut room = std::mem::take(&mut renderer.room);
        for (y, line) in room.chunks_exact_mut(width.max(1)).enumerate() {
            renderer.develop(&everything, y, line);
        }
        renderer.room = room;
        renderer
    }

    /// Hand covering a part of the board, from the next picture on.
    pub fn cover(&mut self, hand: Option<Hand>) {
        self.hand = hand;
    }

    /// Draws the board at `cam_from_board`, poses spread evenly over the exposure, into `out`.
    ///
    /// The same `noise_index` gives the same noise. A board seen from behind isn't drawn. `out` is
    /// resized to the scene's size.
    pub fn render(
        &mut self,
        cam_from_board: &[Isometry3<f64>],
        noise_index: u64,
        out: &mut GrayImage,
    ) {
        self.draw(&Shutter::Global(cam_from_board), noise_index, out);
    }

    /// As [`render`](Self::render), but with separate poses for each row of the picture:
    /// `cam_from_board_of_row` returns them from row 0 at the top to the last one, spread evenly
    /// over the row's exposure.
    pub fn render_rolling(
        &mut self,
        cam_from_board_of_row: &dyn Fn(u32) -> Vec<Isometry3<f64>>,
        noise_index: u64,
        out: &mut GrayImage,
    ) {
        self.draw(&Shutter::Rolling(cam_from_board_of_row), noise_index, out);
    }

    fn draw(&mut self, shutter: &Shutter<'_>, noise_index: u64, out: &mut GrayImage) {
        if (out.width() as usize, out.height() as usize) != (self.width, self.height) {
            *out = GrayImage::new(self.width as u32, self.height as u32);
        }
        let region = self.paint_board(shutter);
        if let Some(region) = &region {
            self.blur_along_rows(region);
        }
        let mut line = vec![0.0_f32; self.width];
        for (y, pixels) in out.chunks_exact_mut(self.width.max(1)).enumerate() {
            line.copy_from_slice(&self.room[y * self.width..(y + 1) * self.width]);
            if let Some(region) =
                region.as_ref().filter(|region| (region.y0..region.y1).contains(&y))
            {
                self.develop(region, y, &mut line[region.x0..region.x1]);
            }
            let start = scramble(self.seed, noise_index, y as u64) as usize % NOISE_TABLE;
            for ((pixel, level), noise) in pixels.iter_mut().zip(&line).zip(&self.noise[start..]) {
                *pixel = (level + noise + 0.5).clamp(0.0, 255.0) as i32 as u8;
            }
        }
    }

    /// Paints room and board onto the canvas. Returns the part of the picture possibly different
    /// from the room alone.
    fn paint_board(&mut self, shutter: &Shutter<'_>) -> Option<Region> {
        let outline = self.print.outline_in_board_m();
        let last_row = self.height.saturating_sub(1) as u32;
        let motion = shutter.motion(last_row, self.camera.f_px.max(), &outline)?;
        let smear_px = motion.over_row_px;
        let of_frame = Rc::new(self.row_views(&motion.middle_row, smear_px)?);
        let views_at = |renderer: &Self, y: usize| match shutter {
            Shutter::Rolling(of_row) if motion.over_picture_px > 0.0 => {
                let row = (y.saturating_sub(renderer.pad) as u32).min(last_row);
                renderer.row_views(&of_row(row), smear_px).map_or(Rc::clone(&of_frame), Rc::new)
            }
            _ => Rc::clone(&of_frame),
        };
        let region = self.surroundings(&motion.middle, &outline, motion.over_picture_px)?;
        let radius = self.kernel.radius();
        // Padded coordinates; one more pixel all around is left for the neighbours' rays.
        let area = Region {
            x0: region.x0 + self.pad - radius,
            x1: region.x1 + self.pad + radius,
            y0: region.y0 + self.pad - radius,
            y1: region.y1 + self.pad + radius,
        };
        // Samples reach a pixel to every side.
        let reach_px = (1.1 + 1.05 * smear_px) as f32;
        let mut traced = std::mem::take(&mut self.traced);
        for row in 0..3 {
            traced.us[row].resize(self.stride, 0.0);
            traced.vs[row].resize(self.stride, 0.0);
        }
        let above = views_at(self, area.y0 - 1);
        self.trace(&above.centre, &area, area.y0 - 1, &mut traced);
        let mut here = views_at(self, area.y0);
        self.trace(&here.centre, &area, area.y0, &mut traced);
        for y in area.y0..area.y1 {
            let below = views_at(self, y + 1);
            self.trace(&below.centre, &area, y + 1, &mut traced);
            self.paint_row(&here.exposure, &area, y, (&traced, reach_px));
            here = below;
        }
        self.traced = traced;
        Some(region)
    }

    /// Sheet at `poses`; a single view if it isn't smeared. `None` from behind or edge-on.
    fn row_views(&self, poses: &[Isometry3<f64>], smear_px: f64) -> Option<RowViews> {
        let centre = self.print.seen_at(&middle_pose(poses)?)?;
        let exposure = if smear_px > 0.0 {
            let views: Vec<_> = poses.iter().filter_map(|pose| self.print.seen_at(pose)).collect();
            Exposure::of(&views)
        } else {
            Exposure::of(&[centre])
        };
        Some(RowViews { centre, exposure })
    }

    fn trace(&self, view: &SheetView, area: &Region, y: usize, traced: &mut Traced) {
        let columns = area.x0 - 1..area.x1 + 1;
        let cells = y * self.stride + columns.start..y * self.stride + columns.end;
        view.trace_row(
            &self.rays_x[cells.clone()],
            &self.rays_y[cells],
            &mut traced.us[y % 3][columns.clone()],
            &mut traced.vs[y % 3][columns],
        );
    }

    fn paint_row(
        &mut self,
        exposure: &Exposure,
        area: &Region,
        y: usize,
        (traced, reach_px): (&Traced, f32),
    ) {
        let [above, here, below] = [(y + 2) % 3, y % 3, (y + 1) % 3];
        let start = y * self.stride;
        self.canvas[start + area.x0..start + area.x1]
            .copy_from_slice(&self.sharp_room[start + area.x0..start + area.x1]);
        let (u_above, u_here, u_below) =
            (&traced.us[above][..], &traced.us[here][..], &traced.us[below][..]);
        let (v_above, v_here, v_below) =
            (&traced.vs[above][..], &traced.vs[here][..], &traced.vs[below][..]);
        let half_reach = 0.5 * reach_px;
        for x in area.x0..area.x1 {
            let du = half_reach
                * ((u_here[x + 1] - u_here[x - 1]).abs() + (u_below[x] - u_above[x]).abs());
            let dv = half_reach
                * ((v_here[x + 1] - v_here[x - 1]).abs() + (v_below[x] - v_above[x]).abs());
            match self.print.around(u_here[x], v_here[x], du, dv) {
                Patch::Backdrop => continue,
                Patch::Dark => self.canvas[start + x] = self.dark_level,
                Patch::Light => self.canvas[start + x] = self.light_level,
                Patch::Crossing(_) | Patch::Mixed => {
                    let share = self.print.share(exposure, &self.pixel_ray(start + x));
                    self.canvas[start + x] = self.mixed(share, self.sharp_room[start + x]);
                }
            }
            if let Some(hand) = &self.hand {
                let (at, reach_m) = self.print.in_board_m(u_here[x], v_here[x], 0.5 * (du + dv));
                let level = &mut self.canvas[start + x];
                *level = covered(hand, &at, reach_m, [self.dark_level, self.light_level], *level);
            }
        }
    }

    fn mixed(&self, share: Share, room: f32) -> f32 {
        share.dark * self.dark_level
            + share.light * self.light_level
            + (1.0 - share.dark - share.light) * room
    }

    fn pixel_ray(&self, cell: usize) -> PixelRay {
        let change = |before: usize, after: usize| {
            [
                0.5 * (self.rays_x[after] - self.rays_x[before]),
                0.5 * (self.rays_y[after] - self.rays_y[before]),
            ]
        };
        PixelRay {
            ray: [self.rays_x[cell], self.rays_y[cell]],
            by_x: change(cell - 1, cell + 1),
            by_y: change(cell - self.stride, cell + self.stride),
        }
    }

    /// Part of the picture within reach of the board, blur included. `None` if the board is out of
    /// view.
    fn surroundings(
        &self,
        middle: &Isometry3<f64>,
        outline_in_board_m: &[Point3<f64>],
        movement_px: f64,
    ) -> Option<Region> {
        let everything = Region { x0: 0, x1: self.width, y0: 0, y1: self.height };
        let mut low = Point2::new(f64::INFINITY, f64::INFINITY);
        let mut high = Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY);
        for point in outline_in_board_m {
            let in_cam = middle * point;
            let ideal = Point2::new(in_cam.x / in_cam.z, in_cam.y / in_cam.z);
            // Behind the camera, or where the lens model may have folded back into the picture.
            if in_cam.z <= 1e-6 || ideal.coords.norm() > self.widest_ray {
                return Some(everything);
            }
            let px = self.camera.px_from_normalized(&ideal);
            low = low.inf(&px);
            high = high.sup(&px);
        }
        let around = movement_px + self.kernel.radius() as f64 + 4.0;
        let clip = |at: f64, end: usize| at.clamp(0.0, end as f64) as usize;
        let region = Region {
            x0: clip((low.x - around).floor(), self.width),
            x1: clip((high.x + around).ceil(), self.width),
            y0: clip((low.y - around).floor(), self.height),
            y1: clip((high.y + around).ceil(), self.height),
        };
        (region.x0 < region.x1 && region.y0 < region.y1).then_some(region)
    }

    fn blur_along_rows(&mut self, region: &Region) {
        let radius = self.kernel.radius();
        let (x0, x1) = (region.x0 + self.pad, region.x1 + self.pad);
        for y in region.y0 + self.pad - radius..region.y1 + self.pad + radius {
            let start = y * self.stride;
            self.kernel.along_row(
                &self.canvas[start + x0 - radius..start + x1 + radius],
                &mut self.half_blurred[start + x0..start + x1],
            );
        }
    }

    /// Blur across rows, then light: columns `[x0, x1)` of picture row `y`.
    fn develop(&self, region: &Region, y: usize, into: &mut [f32]) {
        self.kernel.across_rows(
            &self.half_blurred,
            self.stride,
            (y + self.pad, region.x0 + self.pad),
            into,
        );
        let start = y * self.width;
        for (level, gain) in into.iter_mut().zip(&self.gain[start + region.x0..start + region.x1]) {
            *level *= gain;
        }
    }
}

/// Grey level under a possible hand over the board's `level`: skin, darker towards its outline,
/// mixed with the board within `reach_m` on both sides of the outline.
fn covered(
    hand: &Hand,
    at_m: &Point2<f64>,
    reach_m: f64,
    [dark, light]: [f32; 2],
    level: f32,
) -> f32 {
    let distance_m = hand.distance_m(at_m);
    let share = (0.5 - 0.5 * distance_m / reach_m.max(1e-9)).clamp(0.0, 1.0) as f32;
    let depth = (-distance_m / hand.radius_m).clamp(0.0, 1.0) as f32;
    let skin = dark + (light - dark) * (0.4 + 0.25 * depth);
    level + share * (skin - level)
}

/// Hash of three numbers without visible pattern (SplitMix64's finaliser).
fn scramble(seed: u64, frame: u64, row: u64) -> u64 {
    let mut z = seed;
    for part in [frame, row] {
        z = (z ^ part).wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
    }
    z
}
