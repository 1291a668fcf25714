//! The live picture: one texture, overwritten in place, and its rectangle on the screen.

use std::{cell::RefCell, sync::Arc};

use egui::{
    Color32, ColorImage, Context, Pos2, Rect, TextureHandle, TextureId, TextureOptions, Vec2, pos2,
};
use image::GrayImage;
use nalgebra::Point2;

use boresight_geometry::frame::{CaptureTime, Frame, ImageSize};
use boresight_present::known::Known;

/// Pixels of a thumbnail.
pub(super) fn grey(image: &GrayImage) -> ColorImage {
    let size = [image.width() as usize, image.height() as usize];
    ColorImage::from_gray(size, image.as_raw())
}

/// Part of the picture inside a rim.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Points around the part, in pixels of a picture of [`Self::image_size`].
    pub rim_px: Vec<Point2<f64>>,
    /// Size of the picture in the units of the rim; the shown picture may be smaller.
    pub image_size: ImageSize,
}

/// Colours and brightness, mixed into the pixels: painting a pixel twice costs twice, most of all
/// without a graphics card.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dressing {
    /// What is known of the picture: the rest is dim.
    pub known: Option<Arc<Known>>,
    /// Part that is never dim.
    pub lit: Option<Part>,
    /// True for a dark lower part, behind a sentence.
    pub is_shaded: bool,
}

impl Part {
    /// Columns of row `y` with middles inside, each run from the first column to the end,
    /// exclusive, in a picture of `width` columns.
    fn runs(&self, y: usize, width: usize) -> Vec<[usize; 2]> {
        let scale = width as f64 / f64::from(self.image_size.width_px);
        let y = (y as f64 + 0.5) / scale - 0.5;
        let ends = self.rim_px.iter().cycle().skip(1);
        let sides = self.rim_px.iter().zip(ends).filter(|(a, b)| (a.y <= y) != (b.y <= y));
        let mut across: Vec<f64> =
            sides.map(|(a, b)| a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y)).collect();
        // A lens model may lead nowhere far outside the picture.
        across.retain(|x| x.is_finite());
        across.sort_by(f64::total_cmp);
        let column = |x: &f64| ((x + 0.5) * scale - 0.5).ceil().clamp(0.0, width as f64) as usize;
        across.chunks_exact(2).map(|ends| [column(&ends[0]), column(&ends[1])]).collect()
    }
}

/// The newest picture.
#[derive(Default)]
pub struct Picture {
    image: GrayImage,
    shown: RefCell<Option<Shown>>,
    /// Capture time of the shown picture.
    pub captured_at: Option<CaptureTime>,
    /// Arrival of the shown picture, by the window's clock.
    pub came_secs: Option<f64>,
    interval_secs: Option<f64>,
}

/// Last painted picture, with a note of its age.
struct Shown {
    texture: TextureHandle,
    pixels: Arc<ColorImage>,
    dressing: Dressing,
    /// Brightness by the dressing's map.
    gains: Option<Vec<Gains>>,
    /// True once a newer picture has come.
    is_old: bool,
}

impl Picture {
    /// Shows `frame`, arrived at `now_secs` by the window's clock.
    pub fn show_frame(&mut self, frame: &Frame, now_secs: f64) {
        self.show_image(&frame.image);
        if let Some(before) = self.captured_at {
            let secs = frame.captured_at.secs_since(before);
            if secs > 0.0 {
                let mean = self.interval_secs.map_or(secs, |mean| mean + 0.1 * (secs - mean));
                self.interval_secs = Some(mean);
            }
        }
        self.captured_at = Some(frame.captured_at);
        self.came_secs = Some(now_secs);
    }

    /// Shows `image` from now on.
    pub fn show_image(&mut self, image: &GrayImage) {
        if self.image.dimensions() == image.dimensions() {
            self.image.copy_from_slice(image);
        } else {
            self.image = image.clone();
        }
        if let Some(shown) = self.shown.get_mut() {
            shown.is_old = true;
        }
    }

    /// Grey picture.
    pub fn grey(&self) -> Option<&GrayImage> {
        Some(&self.image).filter(|image| !image.is_empty())
    }

    /// Pictures per second of the source, by time stamps.
    pub fn per_sec(&self) -> Option<f64> {
        self.interval_secs.map(|secs| 1.0 / secs)
    }

    /// Texture of the picture in its `dressing`, once there is a picture. Pixels are coloured when
    /// painted: faster pictures cost nothing.
    pub fn texture(&self, ctx: &Context, dressing: &Dressing) -> Option<TextureId> {
        let image = self.grey()?;
        let size = [image.width() as usize, image.height() as usize];
        let mut kept = self.shown.borrow_mut();
        let mut shown = match kept.take().filter(|shown| shown.pixels.size == size) {
            Some(shown) if !shown.is_old && shown.dressing == *dressing => {
                return Some(kept.insert(shown).texture.id());
            }
            Some(shown) => shown,
            None => {
                let pixels = Arc::new(ColorImage::filled(size, Color32::BLACK));
                let texture = ctx.load_texture("picture", Arc::clone(&pixels), OPTIONS);
                let (dressing, gains) = Default::default();
                Shown { texture, pixels, dressing, gains, is_old: true }
            }
        };
        if shown.dressing.known != dressing.known {
            shown.gains = dressing.known.as_deref().map(gains);
        }
        // Unshared once the last one is on the graphics card, which avoids an allocation.
        color(
            &mut Arc::make_mut(&mut shown.pixels).pixels,
            image,
            dressing,
            shown.gains.as_deref(),
        );
        shown.texture.set_partial([0, 0], Arc::clone(&shown.pixels), OPTIONS);
        (shown.dressing, shown.is_old) = (dressing.clone(), false);
        Some(kept.insert(shown).texture.id())
    }
}

const OPTIONS: TextureOptions = TextureOptions::LINEAR;

/// Columns and rows of the grid of brightness.
const GAINS: [usize; 2] = [41, 25];
/// Where the part behind a sentence begins, and from where on it's darkest.
const SHADED: [f32; 2] = [0.6, 0.84];
/// Brightness of the darkest rows.
const DARKEST: f32 = 0.2;
/// Brightness 1, in fixed point.
const WHOLE: u32 = 256;

/// A row of the grid of brightness.
type Gains = [u32; GAINS[0]];

/// Colours the pixels of `image` with `dressing`, by the `gains` of its map.
fn color(pixels: &mut [Color32], image: &GrayImage, dressing: &Dressing, gains: Option<&[Gains]>) {
    let Dressing { lit, is_shaded, .. } = dressing;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let rows = pixels.chunks_exact_mut(width).zip(image.as_raw().chunks_exact(width));
    for (y, (to, from)) in rows.enumerate() {
        let shade = if *is_shaded { shade((y as f32 + 0.5) / height as f32) } else { WHOLE };
        match gains {
            Some(gains) => {
                let gains = gains_of_row(gains, y, height);
                dim(to, from, &gains.map(|gain| gain * shade / WHOLE));
            }
            None => times(to, from, shade),
        }
        for [first, end] in lit.iter().filter(|_| gains.is_some()).flat_map(|it| it.runs(y, width))
        {
            times(&mut to[first..end], &from[first..end], shade);
        }
    }
}

/// Brightness of a row behind a sentence, by its place from top, 0, to bottom, 1.
fn shade(y: f32) -> u32 {
    let down = ((y - SHADED[0]) / (SHADED[1] - SHADED[0])).clamp(0.0, 1.0);
    (WHOLE as f32 * (1.0 - (1.0 - DARKEST) * down * (2.0 - down))) as u32
}

/// Greys of a row, each times `gain`.
fn times(to: &mut [Color32], from: &[u8], gain: u32) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = Color32::from_gray((u32::from(*from) * gain / WHOLE) as u8);
    }
}

/// Brightness at the points of the grid, from edge to edge of the picture.
fn gains(known: &Known) -> Vec<Gains> {
    let share = |at: usize, count: usize| at as f32 / (count - 1) as f32;
    let gain = |at| (WHOLE as f32 * known.brightness(at)).round() as u32;
    let row = |y| std::array::from_fn(|x| gain([share(x, GAINS[0]), share(y, GAINS[1])]));
    (0..GAINS[1]).map(row).collect()
}

fn gains_of_row(gains: &[Gains], y: usize, height: usize) -> Gains {
    let at = WHOLE as usize * y * (GAINS[1] - 1) / height;
    let (row, share) = (at / WHOLE as usize, at as u32 % WHOLE);
    std::array::from_fn(|x| ((WHOLE - share) * gains[row][x] + share * gains[row + 1][x]) / WHOLE)
}

/// Greys of a row, each times the brightness between its two points of the grid.
fn dim(to: &mut [Color32], from: &[u8], gains: &Gains) {
    let spans = GAINS[0] - 1;
    let column = |span: usize| span * from.len() / spans;
    for (span, ends) in gains.windows(2).enumerate() {
        let (first, end) = (column(span), column(span + 1));
        let (to, from) = (&mut to[first..end], &from[first..end]);
        if ends[0] == ends[1] {
            times(to, from, ends[0]);
            continue;
        }
        let step = (ends[1] as i32 - ends[0] as i32) * 256 / (end - first).max(1) as i32;
        let mut gain = ends[0] as i32 * 256;
        for (to, from) in to.iter_mut().zip(from) {
            *to = Color32::from_gray(((i32::from(*from) * (gain >> 8)) >> 8) as u8);
            gain += step;
        }
    }
}

/// A picture fitted into a rectangle of the screen.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Rectangle of the picture on the screen.
    pub rect: Rect,
    size_px: Vec2,
    mirrored: bool,
}

impl Placed {
    /// Picture as large as `area` allows.
    pub fn within(area: Rect, size: ImageSize, mirrored: bool) -> Self {
        let size_px = Vec2::new(size.width_px.max(1) as f32, size.height_px.max(1) as f32);
        let scale = (area.width() / size_px.x).min(area.height() / size_px.y).max(0.0);
        Self { rect: Rect::from_center_size(area.center(), size_px * scale), size_px, mirrored }
    }

    /// Bars of `area` left free by the picture, before and after the picture. Painted instead of
    /// all of `area`: painting a pixel twice costs twice, most of all without a graphics card.
    pub fn bars(&self, area: Rect) -> [Rect; 2] {
        if self.rect.width() < area.width() {
            [area.with_max_x(self.rect.left()), area.with_min_x(self.rect.right())]
        } else {
            [area.with_max_y(self.rect.top()), area.with_min_y(self.rect.bottom())]
        }
    }

    /// Screen position of a pixel; pixel (0, 0) is the centre of the top-left pixel.
    pub fn pos(&self, px: &Point2<f64>) -> Pos2 {
        let share = Vec2::new(px.x as f32 + 0.5, px.y as f32 + 0.5) / self.size_px;
        self.pos_of_share(share.into())
    }

    /// Screen position of a place in shares of the picture.
    pub fn pos_of_share(&self, [x, y]: [f32; 2]) -> Pos2 {
        let across = if self.mirrored { 1.0 - x } else { x };
        self.rect.min + Vec2::new(across, y) * self.rect.size()
    }

    /// Pixel at a screen position.
    pub fn px(&self, pos: Pos2) -> Point2<f64> {
        let share = (pos - self.rect.min) / self.rect.size();
        let across = if self.mirrored { 1.0 - share.x } else { share.x };
        let px = Vec2::new(across, share.y) * self.size_px - Vec2::splat(0.5);
        Point2::new(f64::from(px.x), f64::from(px.y))
    }

    /// Points of the screen for a pixel.
    pub fn scale(&self) -> f32 {
        self.rect.width() / self.size_px.x
    }

    /// Texture coordinates, mirrored or not.
    pub fn uv(&self) -> Rect {
        let (left, right) = if self.mirrored { (1.0, 0.0) } else { (0.0, 1.0) };
        Rect { min: pos2(left, 0.0), max: pos2(right, 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    #[test]
    fn a_lit_part_is_bright_inside_its_rim() {
        let image = GrayImage::from_fn(20, 10, |x, y| image::Luma([(10 * x + y) as u8]));
        let dark = [[WHOLE / 2; GAINS[0]]; GAINS[1]];
        let color_of_all = |lit: Option<Part>| {
            let mut pixels = vec![Color32::BLACK; 200];
            color(&mut pixels, &image, &Dressing { lit, ..Dressing::default() }, Some(&dark));
            pixels
        };
        let plain = color_of_all(None);
        assert_eq!(plain[3 * 20 + 7], Color32::from_gray(36));
        // A quadrilateral with a side bent inwards, extending beyond the picture on the right.
        let rim = [[2.5, 1.5], [30.0, 1.5], [30.0, 7.5], [9.5, 4.4], [2.5, 7.5]];
        let rim_px: Vec<Point2<f64>> = rim.into_iter().map(Point2::from).collect();
        let image_size = ImageSize { width_px: 20, height_px: 10 };
        let mut part = Part { rim_px, image_size };
        let color_of_part = |part: &Part| color_of_all(Some(part.clone()));
        let lit = color_of_part(&part);
        let inside = |x: usize, y: usize| lit[20 * y + x] != plain[20 * y + x];
        assert_eq!(lit[2 * 20 + 5], Color32::from_gray(52));
        for (x, y, is_inside) in [
            (2, 3, false),
            (3, 3, true),
            (19, 2, true),
            (9, 1, false),
            (9, 4, true),
            (9, 6, false),
            (3, 7, true),
            (19, 8, false),
        ] {
            assert_eq!(inside(x, y), is_inside, "{x}, {y}");
        }
        // The same part of a smaller picture of the same scene.
        part.image_size = ImageSize { width_px: 80, height_px: 40 };
        for px in &mut part.rim_px {
            *px = (*px * 4.0) + Vector2::new(1.5, 1.5);
        }
        assert_eq!(color_of_part(&part), lit);
        for nowhere in [f64::NAN, f64::INFINITY] {
            part.rim_px[2] = Point2::new(nowhere, nowhere);
            assert_eq!(color_of_part(&part)[0], plain[0]);
            part.rim_px.swap(2, 3);
            assert_eq!(color_of_part(&part)[0], plain[0]);
        }
    }

    #[test]
    fn pixels_and_places_belong_to_each_other() {
        let size = ImageSize { width_px: 640, height_px: 480 };
        for mirrored in [false, true] {
            let area = Rect::from_min_size(pos2(10.0, 20.0), Vec2::new(1000.0, 480.0));
            let placed = Placed::within(area, size, mirrored);
            assert!((placed.rect.width() - 640.0).abs() < 1e-3, "as high as the area");
            let px = Point2::new(100.0, 200.0);
            assert!((placed.px(placed.pos(&px)) - px).norm() < 1e-2);
            let middle = placed.pos(&size.centre_px());
            assert!((middle - placed.rect.center()).length() < 1e-3);
        }
    }
}
