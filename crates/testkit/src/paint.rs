//! Paints the window's triangles on the processor, to need no graphics card.
//!
//! Bilinear textures, premultiplied colours blended in gamma space, pixel centres, top-left fill
//! rule: as OpenGL does for egui, up to rounding.

use std::collections::HashMap;

use egui::{
    Color32, Context, FullOutput, Visuals,
    epaint::{ImageData, Mesh, Primitive, TextureId, textures::TextureFilter},
};
use egui_kittest::TestRenderer;
use image::RgbaImage;

/// Red, green, blue, opacity; 0 to 1, premultiplied.
pub type Rgba = [f32; 4];

/// Renderer for a window's test.
pub struct Painter {
    /// Colour behind everything, of a theme.
    background: fn(&Visuals) -> Rgba,
    textures: HashMap<TextureId, Texture>,
}

impl Painter {
    /// Renderer that clears the window to `background`.
    pub fn new(background: fn(&Visuals) -> Rgba) -> Self {
        Self { background, textures: HashMap::new() }
    }
}

struct Texture {
    size: [usize; 2],
    pixels: Vec<Rgba>,
    linear: bool,
}

struct Canvas {
    size: [usize; 2],
    pixels: Vec<Rgba>,
}

impl Texture {
    fn at(&self, x: f32, y: f32) -> Rgba {
        let inside = |value: f32, size: usize| (value.max(0.0) as usize).min(size - 1);
        self.pixels[inside(y, self.size[1]) * self.size[0] + inside(x, self.size[0])]
    }

    fn sample(&self, u: f32, v: f32) -> Rgba {
        let (x, y) = (u * self.size[0] as f32, v * self.size[1] as f32);
        if !self.linear {
            return self.at(x.floor(), y.floor());
        }
        // Rounded down without a call: neither is below −1.
        let down = |value: f32| (value + 1.0) as i32 as f32 - 1.0;
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (down(x), down(y));
        let (across, down) = (x - left, y - top);
        let [a, b, c, d] = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
            .map(|(i, j)| self.at(left + i, top + j));
        std::array::from_fn(|k| {
            let upper = a[k] * (1.0 - across) + b[k] * across;
            let lower = c[k] * (1.0 - across) + d[k] * across;
            upper * (1.0 - down) + lower * down
        })
    }
}

fn rgba(color: &Color32) -> Rgba {
    color.to_array().map(|value| f32::from(value) / 255.0)
}

impl TestRenderer for Painter {
    #[expect(clippy::iter_over_hash_type, reason = "textures do not depend on each other")]
    fn handle_delta(&mut self, delta: &mut egui::TexturesDelta) {
        for (id, deltas) in delta.set.drain() {
            for change in deltas {
                let ImageData::Color(image) = &change.image;
                let pixels = image.pixels.iter().map(rgba);
                let Some([left, top]) = change.pos else {
                    let linear = change.options.magnification == TextureFilter::Linear;
                    let texture = Texture { size: image.size, pixels: pixels.collect(), linear };
                    self.textures.insert(id, texture);
                    continue;
                };
                let texture = self.textures.get_mut(&id).expect("a part of a known texture");
                for (i, pixel) in pixels.enumerate() {
                    let (x, y) = (left + i % image.size[0], top + i / image.size[0]);
                    texture.pixels[y * texture.size[0] + x] = pixel;
                }
            }
        }
        for id in delta.free.drain() {
            self.textures.remove(&id);
        }
    }

    fn render(&mut self, ctx: &Context, output: &FullOutput) -> Result<RgbaImage, String> {
        let scale = ctx.pixels_per_point();
        let points = ctx.content_rect().size() * scale;
        let size = [points.x.round() as usize, points.y.round() as usize];
        let ground = (self.background)(&ctx.style_of(ctx.theme()).visuals);
        let mut canvas = Canvas { size, pixels: vec![ground; size[0] * size[1]] };
        for clipped in ctx.tessellate(output.shapes.clone(), scale) {
            let Primitive::Mesh(mesh) = &clipped.primitive else { continue };
            let Some(texture) = self.textures.get(&mesh.texture_id) else { continue };
            let clip = clipped.clip_rect * scale;
            let bounds = [
                clip.min.x.round().max(0.0),
                clip.min.y.round().max(0.0),
                clip.max.x.round().min(size[0] as f32),
                clip.max.y.round().min(size[1] as f32),
            ];
            canvas.mesh(mesh, texture, bounds, scale);
        }
        let bytes =
            canvas.pixels.iter().flatten().map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8);
        RgbaImage::from_raw(size[0] as u32, size[1] as u32, bytes.collect())
            .ok_or_else(|| "no picture".into())
    }
}

impl Canvas {
    fn mesh(&mut self, mesh: &Mesh, texture: &Texture, clip: [f32; 4], scale: f32) {
        for corners in mesh.indices.chunks_exact(3) {
            let vertices = [0, 1, 2].map(|i| &mesh.vertices[corners[i] as usize]);
            let at = vertices
                .map(|vertex| [f64::from(vertex.pos.x * scale), f64::from(vertex.pos.y * scale)]);
            let area = side(at[0], at[1], at[2]);
            if area == 0.0 {
                continue;
            }
            let turn = area.signum();
            let edges = [(at[1], at[2]), (at[2], at[0]), (at[0], at[1])];
            let owns = edges.map(|(from, to)| is_top_or_left(from, to, turn));
            let colors = vertices.map(|vertex| rgba(&vertex.color));
            let least = |k: usize| at.iter().map(|p| p[k]).fold(f64::MAX, f64::min).floor() as f32;
            let most = |k: usize| at.iter().map(|p| p[k]).fold(f64::MIN, f64::max).ceil() as f32;
            let range = |low: f32, high: f32| low.max(0.0) as usize..high.max(0.0) as usize;
            let color_of = |weights: [f32; 3]| -> Rgba {
                std::array::from_fn(|k| mix(weights, colors.map(|color| color[k])))
            };
            let is_plain = colors[0] == colors[1] && colors[0] == colors[2];
            let texel_at = |weights: [f32; 3]| {
                texture.sample(
                    mix(weights, vertices.map(|vertex| vertex.uv.x)),
                    mix(weights, vertices.map(|vertex| vertex.uv.y)),
                )
            };
            let one_texel = (vertices[0].uv == vertices[1].uv && vertices[0].uv == vertices[2].uv)
                .then(|| texel_at([1.0, 0.0, 0.0]));
            for y in range(least(1).max(clip[1]), most(1).min(clip[3])) {
                let middle = y as f64 + 0.5;
                let (left, right) = span(&edges, turn, middle);
                let from = least(0).max(clip[0]).max(left as f32);
                for x in range(from, most(0).min(clip[2]).min(right as f32)) {
                    let centre = [x as f64 + 0.5, middle];
                    let sides = edges.map(|(from, to)| side(from, to, centre) * turn);
                    let inside = |i: usize| sides[i] > 0.0 || (sides[i] == 0.0 && owns[i]);
                    if !(0..3).all(inside) {
                        continue;
                    }
                    let weights = sides.map(|value| (value / (area * turn)) as f32);
                    let texel = one_texel.unwrap_or_else(|| texel_at(weights));
                    let color = if is_plain { colors[0] } else { color_of(weights) };
                    let source: Rgba = std::array::from_fn(|k| texel[k] * color[k]);
                    let pixel = &mut self.pixels[y * self.size[0] + x];
                    *pixel = std::array::from_fn(|k| source[k] + pixel[k] * (1.0 - source[3]));
                }
            }
        }
    }
}

fn mix(weights: [f32; 3], values: [f32; 3]) -> f32 {
    values.iter().zip(weights).map(|(value, weight)| value * weight).sum()
}

/// Crossing of a row with a triangle, and a pixel more on either side.
fn span(edges: &[([f64; 2], [f64; 2]); 3], turn: f64, y: f64) -> (f64, f64) {
    let (mut left, mut right) = (f64::MIN, f64::MAX);
    for (from, to) in edges {
        // `side` is linear in x: its value at 0, and its slope.
        let at_0 = side(*from, *to, [0.0, y]) * turn;
        let slope = -(to[1] - from[1]) * turn;
        if slope > 0.0 {
            left = left.max(-at_0 / slope);
        } else if slope < 0.0 {
            right = right.min(-at_0 / slope);
        }
    }
    (left - 1.5, right + 1.5)
}

/// Twice the signed area of the triangle `from`, `to`, `point`.
fn side(from: [f64; 2], to: [f64; 2], point: [f64; 2]) -> f64 {
    (to[0] - from[0]) * (point[1] - from[1]) - (to[1] - from[1]) * (point[0] - from[0])
}

/// True if pixels exactly on the edge belong to the triangle: shared edges are drawn once.
fn is_top_or_left(from: [f64; 2], to: [f64; 2], turn: f64) -> bool {
    let (across, down) = ((to[0] - from[0]) * turn, (to[1] - from[1]) * turn);
    (down == 0.0 && across > 0.0) || down < 0.0
}
