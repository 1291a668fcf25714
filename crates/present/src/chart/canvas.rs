//! A drawing in the coordinates of its subject: a picture's pixels, or two axes.

use nalgebra::{Matrix2, Point2, SymmetricEigen, Vector2};

use super::{DASHES, escaped, push, short, ticks};

/// Width of a drawing in drawing units, which a page scales.
const WIDTH: f64 = 300.0;
const CHART_HEIGHT: f64 = 204.0;
/// Maximum height of a picture; leaves room beside tall pictures.
const PICTURE_HEIGHT: f64 = 230.0;
/// Width of a drawing in rows of two instead of three.
const LARGE_WIDTH: f64 = 450.0;
const LARGE_HEIGHT: f64 = 240.0;
const LEFT: f64 = 50.0;
const BOTTOM: f64 = 36.0;
const MARGIN: f64 = 8.0;
/// Width of a digit in the normal letter size.
const DIGIT: f64 = 6.4;
/// Vertices of an ellipse drawn as a polygon.
const ELLIPSE_POINTS: usize = 60;

/// Style of a line or an area.
#[derive(Clone, Copy, Debug)]
pub struct Stroke<'a> {
    /// CSS colour.
    pub colour: &'a str,
    /// Line width, in units of the drawing.
    pub width: f64,
    /// Index of the dash pattern; 0 is solid.
    pub dash: usize,
}

impl<'a> Stroke<'a> {
    /// Solid line of width 1.
    pub fn thin(colour: &'a str) -> Self {
        Self { colour, width: 1.0, dash: 0 }
    }

    fn attributes(&self) -> String {
        let Self { colour, width, dash } = self;
        let dash = DASHES[dash % DASHES.len()];
        format!("stroke=\"{colour}\" stroke-width=\"{width}\"{dash}")
    }
}

/// Axis labels.
#[derive(Clone, Copy, Debug)]
pub struct Axes<'a> {
    /// Label of the horizontal axis.
    pub x: &'a str,
    /// Label of the vertical axis.
    pub y: &'a str,
    /// True for pixels of a picture: y points down, and both axes have the same scale.
    pub pixels: bool,
}

/// Drawing under construction.
pub struct Canvas {
    width: f64,
    height: f64,
    /// Left, top, width and height of the data area.
    frame: [f64; 4],
    x: (f64, f64),
    y: (f64, f64),
    below: String,
    inside: String,
    above: String,
    title: String,
}

impl Canvas {
    /// Canvas over a whole picture up to the outer edges: the centre of its first pixel is (0, 0).
    pub fn picture(size_px: (f64, f64), title: &str) -> Self {
        Self::picture_of(WIDTH, PICTURE_HEIGHT, size_px, title)
    }

    /// Canvas over a picture for a wider place on the page, with letters of the same size.
    pub fn large_picture(size_px: (f64, f64), title: &str) -> Self {
        Self::picture_of(LARGE_WIDTH, PICTURE_HEIGHT, size_px, title)
    }

    fn picture_of(widest: f64, highest: f64, size_px: (f64, f64), title: &str) -> Self {
        let scale = ((widest - 2.0) / size_px.0).min(highest / size_px.1);
        let (width, height) = (scale * size_px.0, scale * size_px.1);
        let frame = [0.5 * (widest - width), 1.0, width, height];
        let mut canvas = Self {
            width: widest,
            height: height + 4.0,
            frame,
            x: (-0.5, size_px.0 - 0.5),
            y: (-0.5, size_px.1 - 0.5),
            below: String::new(),
            inside: String::new(),
            above: String::new(),
            title: title.into(),
        };
        let [left, top, width, height] = frame;
        push(
            &mut canvas.above,
            format_args!(
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"none\" stroke=\"#555\"/>\n"
            ),
        );
        canvas
    }

    /// Chart whose axes cover `points` with some margin.
    pub fn chart(points: &[Point2<f64>], axes: Axes<'_>, title: &str) -> Self {
        Self::chart_of((WIDTH, CHART_HEIGHT), points, axes, title)
    }

    /// Chart for a wider place on the page.
    pub fn large_chart(points: &[Point2<f64>], axes: Axes<'_>, title: &str) -> Self {
        Self::chart_of((LARGE_WIDTH, LARGE_HEIGHT), points, axes, title)
    }

    fn chart_of(
        (full_width, full_height): (f64, f64),
        points: &[Point2<f64>],
        axes: Axes<'_>,
        title: &str,
    ) -> Self {
        let frame = [LEFT, MARGIN, full_width - LEFT - MARGIN, full_height - MARGIN - BOTTOM];
        let [left, top, width, height] = frame;
        let mut x = range(points.iter().map(|point| point.x));
        let mut y = range(points.iter().map(|point| point.y));
        if axes.pixels {
            let per_unit = ((x.1 - x.0) / width).max((y.1 - y.0) / height);
            let around = |(low, high): (f64, f64), length: f64| {
                let (middle, half) = (0.5 * (low + high), 0.5 * per_unit * length);
                (middle - half, middle + half)
            };
            (x, y) = (around(x, width), around(y, height));
        } else {
            // From the top down.
            y = (y.1, y.0);
        }
        let mut canvas = Self {
            width: full_width,
            height: full_height,
            frame,
            x,
            y,
            below: String::new(),
            inside: String::new(),
            above: String::new(),
            title: title.into(),
        };
        let (bottom, right) = (top + height, left + width);
        let mut below = String::new();
        for tick in ticks(x.0, x.1) {
            let (at, _) = canvas.at(Point2::new(tick, y.0));
            let label = short(tick);
            // Keep a number at the right end from being cut off.
            let half = 0.5 * DIGIT * label.chars().count() as f64;
            push(
                &mut below,
                format_args!(
                    "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{top}\" y2=\"{bottom}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>\n",
                    at.min(full_width - half),
                    bottom + 13.0,
                ),
            );
        }
        for tick in ticks(y.0.min(y.1), y.0.max(y.1)) {
            let (_, at) = canvas.at(Point2::new(x.0, tick));
            push(
                &mut below,
                format_args!(
                    "<line x1=\"{left}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\n",
                    left - 4.0,
                    at + 4.0,
                    short(tick)
                ),
            );
        }
        push(
            &mut below,
            format_args!(
                "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#888\"/>\n<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text><text transform=\"translate(10 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                left + 0.5 * width,
                full_height - 7.0,
                escaped(axes.x),
                top + 0.5 * height,
                escaped(axes.y)
            ),
        );
        canvas.below = below;
        canvas
    }

    /// Position of `point` on the drawing.
    fn at(&self, point: Point2<f64>) -> (f64, f64) {
        let [left, top, width, height] = self.frame;
        let share = |value: f64, (from, to): (f64, f64)| (value - from) / (to - from);
        (left + width * share(point.x, self.x), top + height * share(point.y, self.y))
    }

    fn places(&self, points: &[Point2<f64>]) -> String {
        let finite = points.iter().filter(|point| point.x.is_finite() && point.y.is_finite());
        let places: Vec<String> = finite
            .map(|point| {
                let (x, y) = self.at(*point);
                // Clamped, to stay readable.
                format!("{:.1},{:.1}", x.clamp(-1e5, 1e5), y.clamp(-1e5, 1e5))
            })
            .collect();
        places.join(" ")
    }

    /// Polyline through `points`.
    pub fn curve(&mut self, points: &[Point2<f64>], stroke: Stroke<'_>) {
        let places = self.places(points);
        push(
            &mut self.inside,
            format_args!("<polyline points=\"{places}\" fill=\"none\" {}/>\n", stroke.attributes()),
        );
    }

    /// Infinite line, clipped to the drawing.
    pub fn line(&mut self, through: Point2<f64>, along: Vector2<f64>, stroke: Stroke<'_>) {
        let middle = Point2::new(0.5 * (self.x.0 + self.x.1), 0.5 * (self.y.0 + self.y.1));
        let reach = (self.x.1 - self.x.0).abs() + (self.y.1 - self.y.0).abs();
        let nearest = through + along * along.dot(&(middle - through));
        self.curve(&[nearest - along * reach, nearest + along * reach], stroke);
    }

    /// Filled polygon.
    pub fn area(&mut self, points: &[Point2<f64>], fill: &str, stroke: Stroke<'_>) {
        let places = self.places(points);
        push(
            &mut self.inside,
            format_args!(
                "<polygon points=\"{places}\" fill=\"{fill}\" {}/>\n",
                stroke.attributes()
            ),
        );
    }

    /// Diagonal hatching of a rectangle, given by its corners in order.
    pub fn hatch(&mut self, corners: &[Point2<f64>; 4]) {
        let [first, second, third, fourth] = *corners;
        let thin = Stroke { colour: "#999", width: 0.6, dash: 0 };
        let half = nalgebra::center::<f64, 2>;
        self.curve(&[fourth, second], thin);
        self.curve(&[half(&first, &fourth), half(&first, &second)], thin);
        self.curve(&[half(&fourth, &third), half(&second, &third)], thin);
    }

    /// Cross, `size` units of the drawing wide.
    pub fn cross(&mut self, point: Point2<f64>, size: f64) {
        let (x, y) = self.at(point);
        let half = 0.5 * size;
        push(
            &mut self.inside,
            format_args!(
                "<path d=\"M{:.1} {:.1}h{size}m-{half} -{half}v{size}\" stroke=\"#000\" stroke-width=\"1.4\" fill=\"none\"/>\n",
                x - half,
                y
            ),
        );
    }

    /// Dot with a radius in units of the drawing.
    pub fn dot(&mut self, point: Point2<f64>, radius: f64) {
        let (x, y) = self.at(point);
        push(
            &mut self.inside,
            format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"#222\"/>\n"),
        );
    }

    /// Text at the top, left of `x`.
    pub fn at_top(&mut self, x: f64, text: &str) {
        let (at, _) = self.at(Point2::new(x, self.y.0));
        push(
            &mut self.above,
            format_args!(
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" paint-order=\"stroke\" stroke=\"#fff\" stroke-width=\"3\">{}</text>\n",
                at - 3.0,
                self.frame[1] + 12.0,
                escaped(text)
            ),
        );
    }

    /// Mark of one of four kinds.
    pub fn mark(&mut self, kind: usize, point: Point2<f64>, colour: &str) {
        let (x, y) = self.at(point);
        if x.is_finite() && y.is_finite() {
            push(&mut self.inside, format_args!("{}\n", super::mark(kind, x, y, colour)));
        }
    }

    /// Text beside a point, outlined in white to stay readable on lines.
    pub fn label(&mut self, point: Point2<f64>, shift: (f64, f64), text: &str) {
        let (x, y) = self.at(point);
        if x.is_finite() && y.is_finite() {
            push(
                &mut self.above,
                format_args!(
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" paint-order=\"stroke\" stroke=\"#fff\" stroke-width=\"3\">{}</text>\n",
                    x + shift.0,
                    y + shift.1,
                    escaped(text)
                ),
            );
        }
    }

    /// Small text in the colour `fill`.
    pub fn number(&mut self, point: Point2<f64>, fill: &str, text: &str) {
        let (x, y) = self.at(point);
        push(
            &mut self.above,
            format_args!(
                "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"8\" fill=\"{fill}\">{}</text>\n",
                y + 3.0,
                escaped(text)
            ),
        );
    }

    /// Legend of the marks below the drawing, in two columns.
    pub fn legend(&mut self, entries: &[(usize, &str, String)]) {
        let top = self.height;
        for (i, (kind, colour, text)) in entries.iter().enumerate() {
            let x = 12.0 + (i % 2) as f64 * 0.5 * self.width;
            let y = top + 10.0 + 13.0 * (i / 2) as f64;
            push(
                &mut self.above,
                format_args!(
                    "{}<text x=\"{:.1}\" y=\"{y:.1}\">{}</text>\n",
                    super::mark(*kind, x, y - 4.0, colour),
                    x + 8.0,
                    escaped(text)
                ),
            );
        }
        self.height += 13.0 * entries.len().div_ceil(2) as f64 + 2.0;
    }

    /// Outline of the `sds`-deviation ellipse of a normally distributed point. Empty if the
    /// covariance is invalid.
    pub fn ellipse_points(
        centre: Point2<f64>,
        covariance: &Matrix2<f64>,
        sds: f64,
    ) -> Vec<Point2<f64>> {
        if !covariance.iter().all(|value| value.is_finite()) {
            return Vec::new();
        }
        let eigen = SymmetricEigen::new(*covariance);
        let axis = |i: usize| eigen.eigenvectors.column(i) * eigen.eigenvalues[i].max(0.0).sqrt();
        (0..ELLIPSE_POINTS)
            .map(|k| {
                let (sin, cos) =
                    libm::sincos(std::f64::consts::TAU * k as f64 / ELLIPSE_POINTS as f64);
                centre + (axis(0) * cos + axis(1) * sin) * sds
            })
            .collect()
    }

    /// The drawing as SVG.
    pub fn svg(self) -> String {
        let [left, top, width, height] = self.frame;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {:.1}\" font-family=\"sans-serif\" font-size=\"11\" role=\"img\" aria-label=\"{}\">\n{}<svg x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" viewBox=\"{left:.1} {top:.1} {width:.1} {height:.1}\">\n{}</svg>\n{}</svg>\n",
            self.width,
            self.height,
            escaped(&self.title),
            self.below,
            self.inside,
            self.above
        )
    }
}

/// Range of the finite values, with some margin; never empty.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return (0.0, 1.0);
    }
    let spare = (0.08 * (high - low)).max(1e-6 * high.abs().max(low.abs())).max(1e-9);
    (low - spare, high + spare)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_s_corners_are_the_frame_s() {
        let canvas = Canvas::picture((640.0, 480.0), "t");
        let (left, top) = canvas.at(Point2::new(-0.5, -0.5));
        let (right, bottom) = canvas.at(Point2::new(639.5, 479.5));
        assert!((left - 1.0).abs() < 4.0 && (top - 1.0).abs() < 1e-9);
        assert!(((right - left) / (bottom - top) - 4.0 / 3.0).abs() < 1e-9);
    }

    #[test]
    fn an_ellipse_holds_two_deviations() {
        let covariance = Matrix2::new(4.0, 0.0, 0.0, 1.0);
        let points = Canvas::ellipse_points(Point2::new(10.0, 5.0), &covariance, 2.0);
        let widest = points.iter().map(|p| (p.x - 10.0).abs()).fold(0.0, f64::max);
        let highest = points.iter().map(|p| (p.y - 5.0).abs()).fold(0.0, f64::max);
        assert!((widest - 4.0).abs() < 1e-9 && (highest - 2.0).abs() < 1e-9);
        let none = Matrix2::new(f64::NAN, 0.0, 0.0, 1.0);
        assert!(Canvas::ellipse_points(Point2::origin(), &none, 2.0).is_empty());
    }
}
