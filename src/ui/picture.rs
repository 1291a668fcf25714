//! The live picture: one texture, overwritten in place, and its rectangle on the screen.

use std::sync::Arc;

use egui::{Color32, ColorImage, Context, Pos2, Rect, TextureHandle, TextureOptions, Vec2, pos2};
use image::GrayImage;
use nalgebra::Point2;

use boresight_geometry::frame::{CaptureTime, Frame, ImageSize};

/// The pixels of a small picture.
pub(super) fn grey(image: &GrayImage) -> ColorImage {
    let size = [image.width() as usize, image.height() as usize];
    ColorImage::from_gray(size, image.as_raw())
}

/// The newest picture.
#[derive(Default)]
pub struct Picture {
    texture: Option<TextureHandle>,
    pixels: Option<Arc<ColorImage>>,
    /// Capture time of the shown picture.
    pub captured_at: Option<CaptureTime>,
    /// Arrival of the shown picture, by the window's clock.
    pub came_secs: Option<f64>,
    interval_secs: Option<f64>,
}

impl Picture {
    /// Shows `frame`, which came at `now_secs` by the window's clock.
    pub fn show_frame(&mut self, ctx: &Context, frame: &Frame, now_secs: f64) {
        self.show_image(ctx, &frame.image);
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
    pub fn show_image(&mut self, ctx: &Context, image: &GrayImage) {
        let size = [image.width() as usize, image.height() as usize];
        let pixels = match &mut self.pixels {
            // Unshared once the last one is on the graphics card, so that nothing is allocated.
            Some(pixels) if pixels.size == size => {
                let shown = Arc::make_mut(pixels);
                for (to, from) in shown.pixels.iter_mut().zip(image.as_raw()) {
                    *to = Color32::from_gray(*from);
                }
                Arc::clone(pixels)
            }
            pixels => {
                Arc::clone(pixels.insert(Arc::new(ColorImage::from_gray(size, image.as_raw()))))
            }
        };
        let options = TextureOptions::LINEAR;
        match &mut self.texture {
            Some(texture) if texture.size() == size => {
                texture.set_partial([0, 0], pixels, options);
            }
            texture => *texture = Some(ctx.load_texture("picture", pixels, options)),
        }
    }

    /// The picture itself.
    pub fn grey(&self) -> Option<GrayImage> {
        let pixels = self.pixels.as_ref()?;
        let [width, height] = pixels.size.map(|side| side as u32);
        GrayImage::from_raw(width, height, pixels.pixels.iter().map(Color32::r).collect())
    }

    /// Pictures per second of the source, by its time stamps.
    pub fn per_sec(&self) -> Option<f64> {
        self.interval_secs.map(|secs| 1.0 / secs)
    }

    /// Texture of the picture, once there is one.
    pub fn texture(&self) -> Option<&TextureHandle> {
        self.texture.as_ref()
    }
}

/// A picture as large as fits within a rectangle of the screen.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Rectangle of the picture on the screen.
    pub rect: Rect,
    size_px: Vec2,
    mirrored: bool,
}

impl Placed {
    /// The picture as large as `area` allows.
    pub fn within(area: Rect, size: ImageSize, mirrored: bool) -> Self {
        let size_px = Vec2::new(size.width_px.max(1) as f32, size.height_px.max(1) as f32);
        let scale = (area.width() / size_px.x).min(area.height() / size_px.y).max(0.0);
        Self { rect: Rect::from_center_size(area.center(), size_px * scale), size_px, mirrored }
    }

    /// Bars that the picture leaves free of `area`, before and after it. Painted instead of all of `area`: a pixel that
    /// is painted twice costs twice, most of all where there is no graphics card.
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
        let across = if self.mirrored { 1.0 - share.x } else { share.x };
        self.rect.min + Vec2::new(across, share.y) * self.rect.size()
    }

    /// The pixel at a place on the screen.
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

    /// The texture coordinates that show it, mirrored or not.
    pub fn uv(&self) -> Rect {
        let (left, right) = if self.mirrored { (1.0, 0.0) } else { (0.0, 1.0) };
        Rect { min: pos2(left, 0.0), max: pos2(right, 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
