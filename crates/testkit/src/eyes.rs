//! A person's view of the painted pixels: the card, by its colour.

use egui::{Rect, pos2};
use image::RgbaImage;
use nalgebra::{Point2, Vector2};

/// Corners, clockwise on the screen from the upper left.
pub type Quad = [Point2<f64>; 4];

/// Sight in a picture.
#[derive(Debug)]
pub enum Sight {
    /// The flash after a view.
    Flash,
    /// Corners of the card, clockwise from the upper left.
    Card(Quad),
    /// Nothing of interest.
    Nothing,
}

/// Difference of the strongest and the weakest colour: zero in the camera's picture.
fn tint(pixel: &image::Rgba<u8>) -> u8 {
    let [r, g, b, _] = pixel.0;
    r.max(g).max(b) - r.min(g).min(b)
}

fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Convex hull, clockwise on the screen.
fn hull(mut points: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = Point2<f64>>| {
        let mut chain: Vec<Point2<f64>> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && cross(b - a, point - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut upper = half(&mut points.iter().copied());
    upper.extend(half(&mut points.iter().rev().copied()));
    upper
}

fn area(polygon: &[Point2<f64>]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon.iter().zip(next).map(|(a, b)| cross(a.coords, b.coords)).sum::<f64>()
}

/// Intersection of the neighbours of side `i` beyond, and the added area.
fn beyond(polygon: &[Point2<f64>], i: usize) -> Option<(Point2<f64>, f64)> {
    let at = |k: usize| polygon[(i + k + polygon.len() - 1) % polygon.len()];
    let (before, from, to, after) = (at(0), at(1), at(2), at(3));
    let (way, back) = (from - before, to - after);
    let turn = cross(way, back);
    let along = cross(to - from, back) / turn;
    let is_beyond = turn < -1e-9 && along > 0.0;
    let corner = from + way * along;
    is_beyond.then(|| (corner, area(&[from, corner, to])))
}

/// Four sides of a polygon with rounded corners, perhaps cut off by the edge of `picture`.
fn quad(mut polygon: Vec<Point2<f64>>, picture: Rect) -> Option<Quad> {
    let at_edge = |a: Point2<f64>, b: Point2<f64>| {
        let near = |a: f64, b: f64, edge: f32| {
            let edge = f64::from(edge);
            (a - edge).abs() < 3.0 && (b - edge).abs() < 3.0
        };
        near(a.x, b.x, picture.left())
            || near(a.x, b.x, picture.right())
            || near(a.y, b.y, picture.top())
            || near(a.y, b.y, picture.bottom())
    };
    while polygon.len() > 4 {
        let sides = (0..polygon.len()).filter_map(|i| {
            let (corner, added) = beyond(&polygon, i)?;
            let is_cut = at_edge(polygon[i], polygon[(i + 1) % polygon.len()]);
            Some((i, corner, if is_cut { 0.05 * added } else { added }))
        });
        let (i, corner, _) = sides.min_by(|a, b| a.2.total_cmp(&b.2))?;
        let next = (i + 1) % polygon.len();
        polygon[i] = corner;
        polygon.remove(next);
    }
    let first = (0..4).min_by(|a, b| {
        let down_right = |i: usize| polygon.get(i).map_or(f64::MAX, |at| at.x + at.y);
        down_right(*a).total_cmp(&down_right(*b))
    })?;
    (polygon.len() == 4).then(|| std::array::from_fn(|i| polygon[(first + i) % 4]))
}

/// A look at a painted window.
pub struct Look<'a> {
    /// The whole window.
    pub painted: &'a RgbaImage,
    /// The camera's picture, down to the sentence.
    pub picture: Rect,
    /// Around the board in the air.
    pub disc: Rect,
}

impl Look<'_> {
    fn tint(&self, x: f32, y: f32) -> u8 {
        let (x, y) = (x.max(0.0) as u32, y.max(0.0) as u32);
        tint(
            self.painted
                .get_pixel(x.min(self.painted.width() - 1), y.min(self.painted.height() - 1)),
        )
    }

    /// Pixels of the rim in the picture: from amber to almost green.
    fn rim_in_the_picture(&self) -> Vec<Point2<f64>> {
        let area = self.picture;
        let is_rim = |x: u32, y: u32| {
            let [r, g, b] = [0, 1, 2].map(|i| u32::from(self.painted.get_pixel(x, y).0[i]));
            r.max(g) > 90 && 10 * b < 7 * r.max(g) && 2 * r.min(b) < r.max(g) && 3 * r > g
        };
        (area.top() as u32..area.bottom() as u32)
            .flat_map(|y| (area.left() as u32..area.right() as u32).map(move |x| (x, y)))
            .filter(|(x, y)| is_rim(*x, *y) && self.is_visible(pos2(*x as f32, *y as f32)))
            .map(|(x, y)| Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))
            .collect()
    }

    /// True in the picture beside the board in the air.
    fn is_visible(&self, at: egui::Pos2) -> bool {
        self.picture.contains(at) && !self.disc.contains(at)
    }

    /// Pixels of the rim in the disc, not those of the ring.
    fn amber_in_the_disc(&self) -> Vec<Point2<f64>> {
        let (middle, reach) = (self.disc.center(), 0.43 * self.disc.width());
        let mut found = Vec::new();
        for y in self.disc.top().max(0.0) as u32..self.disc.bottom() as u32 {
            for x in self.disc.left() as u32..(self.disc.right() as u32).min(self.painted.width()) {
                let at = pos2(x as f32 + 0.5, y as f32 + 0.5);
                let [r, g, b, _] = self.painted.get_pixel(x, y).0;
                if at.distance(middle) < reach && r > g && g > b && r - b > 60 {
                    found.push(Point2::new(f64::from(at.x), f64::from(at.y)));
                }
            }
        }
        found
    }

    /// What stands out in the window.
    pub fn sees(&self) -> Sight {
        let picture = self.picture;
        let edge = picture.shrink(4.0);
        let corners = [edge.left_top(), edge.right_top(), edge.left_bottom(), edge.right_bottom()];
        if corners.iter().all(|at| self.tint(at.x, at.y) > 12) {
            return Sight::Flash;
        }
        let seen = self.rim_in_the_picture();
        let outline = hull(seen.clone());
        if outline.len() < 3 {
            return Sight::Nothing;
        }
        // A small board in the air tells the shape of a card that is cut off by the picture's edge.
        let is_cut =
            seen.iter().any(|at| !picture.shrink(3.0).contains(pos2(at.x as f32, at.y as f32)));
        let card = if is_cut {
            let small = hull(self.amber_in_the_disc());
            quad(small, self.disc).map(|small| self.placed(&small, &seen))
        } else {
            quad(outline, picture)
        };
        card.map_or(Sight::Nothing, Sight::Card)
    }

    /// The small card in the air, scaled and placed such that its rim is where rims are `seen`.
    fn placed(&self, small: &Quad, seen: &[Point2<f64>]) -> Quad {
        let seen: Vec<&Point2<f64>> = seen.iter().step_by(seen.len().div_ceil(250)).collect();
        let middle = Point2::from(small.iter().map(|at| at.coords).sum::<Vector2<f64>>() / 4.0);
        let large = |[scale, x, y]: [f64; 3]| {
            small.map(|at| Point2::new(x, y) + (at - middle) * scale.exp())
        };
        // 1 for nothing off, a half for 8 px.
        let near = |off_px: f64| 1.0 / (1.0 + off_px / 8.0);
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
            sum / f64::max(count, 1.0)
        };
        let common = |place: [f64; 3]| {
            let card = large(place);
            let sides = [0, 1, 2, 3].map(|i| (card[i], card[(i + 1) % 4] - card[i]));
            let from_side = |at: &Point2<f64>, (from, way): &(Point2<f64>, Vector2<f64>)| {
                let along = ((at - from).dot(way) / way.norm_squared()).clamp(0.0, 1.0);
                (at - (from + way * along)).norm()
            };
            let explained = mean(&mut seen.iter().map(|at| {
                near(sides.iter().map(|side| from_side(at, side)).fold(f64::MAX, f64::min))
            }));
            let along = sides
                .iter()
                .flat_map(|(from, way)| (0..32).map(move |i| from + way * (f64::from(i) / 32.0)));
            let visible = along.filter(|at| self.is_visible(pos2(at.x as f32, at.y as f32)));
            let found = mean(&mut visible.map(|at| {
                near(seen.iter().map(|pixel| (at - **pixel).norm()).fold(f64::MAX, f64::min))
            }));
            explained.min(found)
        };
        let reach = |axis: usize| {
            let values = seen.iter().map(|at| at[axis]);
            (values.clone().fold(f64::MAX, f64::min), values.fold(f64::MIN, f64::max))
        };
        let (across, down) = (reach(0), reach(1));
        let half = |axis: usize| {
            small.iter().map(|at| (at[axis] - middle[axis]).abs()).fold(0.0, f64::max)
        };
        // Who sees too little of the rim fills the picture with the board.
        let picture = self.picture;
        let scale = (picture.width() / (2.0 * half(0) as f32))
            .min(picture.height() / (2.0 * half(1) as f32));
        let (x, y) = (f64::from(picture.center().x), f64::from(picture.center().y));
        let filling = [f64::from(scale).ln(), x, y];
        let mut best = (common(filling), filling);
        for step in 0..16 {
            let scale = 0.4 + 0.15 * f64::from(step);
            let places = |(from, to): (f64, f64), half: f64| {
                let half = half * scale.exp();
                [from + half, 0.5 * (from + to), to - half]
            };
            for x in places(across, half(0)) {
                for y in places(down, half(1)) {
                    let score = common([scale, x, y]);
                    if score > best.0 {
                        best = (score, [scale, x, y]);
                    }
                }
            }
        }
        let mut steps = [0.1, 16.0, 16.0];
        for _ in 0..60 {
            let mut improved = false;
            for axis in 0..3 {
                for sign in [-1.0, 1.0] {
                    let mut place = best.1;
                    place[axis] += sign * steps[axis];
                    let score = common(place);
                    if score > best.0 {
                        (best, improved) = ((score, place), true);
                    }
                }
            }
            if !improved {
                steps = steps.map(|step| 0.6 * step);
            }
        }
        large(if best.0 > 0.5 { best.1 } else { filling })
    }
}
