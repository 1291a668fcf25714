//! Page about several cameras: verdict, places, what each two measure, and residuals.

use nalgebra::{Isometry3, Point2, Point3};

use super::{
    Certificate,
    certificate::{self, COVERAGE_FACTOR as K},
    front,
    number::{brief_data, measured, plain, row},
    page::STYLE,
    row_pictures::RowPictures,
    section::{figure, missing, section, section_with},
};
use crate::{
    chart::{Canvas, Plot, Series, Stroke, escaped},
    grade::Grade,
    text::{
        certificate as certificate_words, grade as grade_said,
        report::{self as words, Section},
        rig as rig_words,
    },
};
use boresight_formats::{
    FindingEntry, PoseEntry, RigCameraEntry, RigFile, RigGoalEntry, RigPairEntry,
};
use boresight_geometry::frame::ImageSize;

/// Width of a drawing of places, in its own units.
const WIDE: f64 = 1000.0;
/// Length of a drawn camera as a share of the drawing's size.
const CAMERA: f64 = 0.07;
/// Distances shown, as multiples of the boards' mean distance.
const FAR: [f64; 10] = [0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0];

/// Page about `rig`, called `name`: one self-contained HTML file, and well-formed XML. The first
/// sheet is for the customer.
pub fn rig_page(
    name: &str,
    rig: &RigFile,
    rows: Option<&RowPictures>,
    certificate: &Certificate,
) -> String {
    let title = words::title_of_rig(name);
    let title = escaped(&title);
    let drawings = match rig.cameras.is_empty() {
        true => String::new(),
        false => {
            let drawings = [[0, 2], [2, 1]].map(|axes| places(rig, axes)).concat();
            section(Section::Places, &format!("<div class=\"two\">{drawings}</div>\n"))
        }
    };
    // Where the pictures contradict each other, no rows agree.
    let rows = rows.filter(|_| Grade::of_rig(rig) != Grade::NotTrustworthy);
    let rows = rows.map_or_else(String::new, |rows| section(Section::Rows, &rows.drawings()));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/><title>{title}</title><style>\n{STYLE}</style></head><body>\n{}<h1>{title}</h1>\n{}{drawings}{}{}{rows}<div class=\"two\">{}{}</div>\n</body></html>\n",
        sheet(rig, certificate),
        verdict(rig),
        pairs(rig),
        cameras(rig),
        distances(rig),
        residuals(rig)
    )
}

/// The customer's sheet: grade, error and goal, three answers, and the file's checksum. Empty
/// without a rig.
fn sheet(rig: &RigFile, certificate: &Certificate) -> String {
    if rig.cameras.is_empty() {
        return String::new();
    }
    let grade = Grade::of_rig(rig);
    let is_usable = matches!(grade, Grade::Good | Grade::Care);
    let certifies = is_usable && !rig.simulated;
    let names: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let (names, c) = (names.join(", "), certificate);
    let identity = [&c.site, &names, &c.customer, &c.date].into_iter().map(String::as_str);
    let identity: Vec<&str> = identity.filter(|part| !part.is_empty()).collect();
    let mut body = certificate::masthead(certificate, certifies, rig.simulated);
    body += &format!("<p class=\"identity\">{}</p>\n", escaped(&identity.join(" · ")));
    // A number of a rig that isn't usable is no answer.
    let error = match rig.goal.as_ref().filter(|_| is_usable) {
        Some(RigGoalEntry { unit, goal, reached }) => {
            let said = |value: &f64| rig_words::of_goal(*value, unit == "m");
            let number = reached.as_ref().map(|reached| format!("±{}", said(reached)));
            (number, certificate_words::of_goal(true, &said(goal)))
        }
        None => (None, String::new()),
    };
    body += &front::graded(words::verdict_sign(&rig.verdict), grade_said(grade), error);
    if is_usable {
        let due = certificate.check_due.as_deref();
        body += &front::table([
            (certificate_words::HOW_EXACT, how_exact(rig)),
            (certificate_words::WHERE, where_valid(rig)),
            (certificate_words::UNTIL_WHEN, rig_words::until_when(due)),
        ]);
    }
    body += &certificate::checksum(certificate);
    if certifies {
        body += &certificate::signatures(certificate);
    }
    section_with(Section::Certificate, "certificate", &body)
}

/// Expanded uncertainty (95 %) of rows and distances of the weakest pair, with the doubt in the
/// board's size.
fn how_exact(rig: &RigFile) -> String {
    let of = |pair: &RigPairEntry| {
        let at_m = pair.at_m?;
        let within_m = K * libm::hypot(pair.distance_sd?, rig.board_scale_sd) * at_m;
        let row_px = pair.row_sd_px.map(|px| K * px);
        let is_known = [Some(within_m), row_px].iter().flatten().all(|it| it.is_finite());
        is_known.then_some((within_m, at_m, row_px))
    };
    let share = |(within_m, at_m, _): &(f64, f64, _)| within_m / at_m;
    let weakest = rig.pairs.iter().filter_map(of).max_by(|a, b| share(a).total_cmp(&share(b)));
    weakest.map_or_else(
        || certificate_words::NOT_KNOWN.into(),
        |(within_m, at_m, row_px)| rig_words::how_exact(within_m, at_m, row_px),
    )
}

/// Distances of the boards' places from the nearest camera that saw them.
fn where_valid(rig: &RigFile) -> String {
    let far = |place: &PoseEntry| -> Option<f64> {
        let place = place.pose()?;
        let of = |camera: &RigCameraEntry| {
            Some((camera.cam_from_rig.pose()? * place).translation.vector.norm())
        };
        rig.cameras.iter().filter_map(of).reduce(f64::min)
    };
    let far = rig.instants.iter().filter_map(|it| far(&it.rig_from_board));
    let far: Vec<f64> = far.filter(|far_m| far_m.is_finite()).collect();
    let [near, far] = [f64::min, f64::max].map(|of| far.iter().copied().reduce(of));
    near.zip(far).map_or_else(
        || certificate_words::NOT_KNOWN.into(),
        |(near_m, far_m)| rig_words::where_valid(near_m, far_m),
    )
}

fn verdict(rig: &RigFile) -> String {
    let of = |finding: &FindingEntry| {
        format!("<li>{}. <b>{}</b></li>\n", escaped(&finding.message), escaped(&finding.action))
    };
    let findings: String = rig.findings.iter().map(of).collect();
    let findings = match findings.is_empty() {
        true => findings,
        false => format!("<ul>\n{findings}</ul>\n"),
    };
    let answer = format!(
        "<p class=\"lead\"><span class=\"sign\">{}</span> <strong>{}</strong></p>\n{findings}",
        words::verdict_sign(&rig.verdict),
        escaped(&rig_words::verdict(rig)),
    );
    section_with(Section::Verdict, "box", &answer)
}

/// Drawing along two axes of the rig's frame, the second one upwards.
fn places(rig: &RigFile, [across, up]: [usize; 2]) -> String {
    let is_from_above = up == 2;
    let boards: Vec<Vec<Point3<f64>>> = rig
        .instants
        .iter()
        .filter_map(|instant| Some(outline(rig, &instant.rig_from_board.pose()?)))
        .collect();
    let cameras: Vec<(&str, Isometry3<f64>, Vec<_>)> = rig
        .cameras
        .iter()
        .filter_map(|camera| {
            let rig_from_cam = camera.cam_from_rig.pose()?.inverse();
            let [width, height] = camera.image_size.map(f64::from);
            let edges = match is_from_above {
                true => [[0.0, 0.5 * height], [width, 0.5 * height]],
                false => [[0.5 * width, 0.0], [0.5 * width, height]],
            };
            let lens = camera.lens.camera();
            let rays = edges.iter().filter_map(|edge| lens.ray_from_px(&Point2::from(*edge)));
            let rays = rays.map(|ray| Point3::from(ray.normalize()));
            Some((camera.name.as_str(), rig_from_cam, rays.collect()))
        })
        .collect();
    // Depth points away from the cameras, and the second axis of a frame points down.
    let flat = |point: &Point3<f64>| {
        let sign = if is_from_above { -1.0 } else { 1.0 };
        Point2::new(point[across], sign * point[up])
    };
    let centres = cameras.iter().map(|(_, pose, _)| flat(&(pose * Point3::origin())));
    let all: Vec<Point2<f64>> = centres.chain(boards.iter().flatten().map(flat)).collect();
    let low = all.iter().fold(Point2::new(f64::INFINITY, f64::INFINITY), |a, b| a.inf(b));
    let high = all.iter().fold(Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY), |a, b| a.sup(b));
    let size_m = (high - low).max().max(1e-3);
    let margin_m = 2.0 * CAMERA * size_m;
    let (low, size) = (low.map(|side| side - margin_m), (high - low).map(|it| it + 2.0 * margin_m));
    let scale = WIDE / size.x.max(size.y);
    let at = |point: &Point3<f64>| Point2::from((flat(point) - low) * scale);
    let title = if is_from_above { rig_words::FROM_ABOVE } else { rig_words::FROM_THE_SIDE };
    let mut canvas = Canvas::picture((scale * size.x, scale * size.y), title);
    for board in &boards {
        let rim: Vec<Point2<f64>> = board.iter().map(at).collect();
        canvas.area(&rim, "#9ab", Stroke::thin("#356"));
    }
    let mut labels: Vec<(Point2<f64>, String)> = Vec::new();
    for (name, pose, rays) in &cameras {
        let end = |ray: &Point3<f64>| at(&(pose * Point3::from(ray.coords * CAMERA * size_m)));
        let centre = at(&(pose * Point3::origin()));
        let rim: Vec<Point2<f64>> = [centre].into_iter().chain(rays.iter().map(end)).collect();
        canvas.area(&rim, "#f4c542", Stroke::thin("#111"));
        match labels.iter_mut().find(|(at, _)| (*at - centre).norm() < 0.5 * CAMERA * WIDE) {
            Some((_, names)) => *names += &format!(", {name}"),
            None => labels.push((centre, (*name).to_owned())),
        }
    }
    for (at, names) in labels {
        canvas.label(at, (0.0, -6.0), &names);
    }
    let bar_m = [0.01, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0].into_iter();
    let bar_m = bar_m.filter(|bar| *bar < 0.4 * size_m).fold(0.01, f64::max);
    let to = Point2::new(scale * size.x - 0.03 * WIDE, scale * size.y - 0.03 * WIDE);
    let from = Point2::new(to.x - scale * bar_m, to.y);
    canvas.curve(&[from, to], Stroke { colour: "#111", width: 2.0, dash: 0 });
    canvas.label(nalgebra::center(&from, &to), (0.0, -4.0), &rig_words::length(bar_m));
    format!("<figure>{}<p class=\"note\">{title}</p></figure>\n", canvas.svg())
}

/// Corners of the observed board at `rig_from_board`.
fn outline(rig: &RigFile, rig_from_board: &Isometry3<f64>) -> Vec<Point3<f64>> {
    let points: Vec<Point3<f64>> = rig
        .board
        .points_mm
        .iter()
        .flatten()
        .map(|mm| Point3::from(mm.map(|mm| 1e-3 * mm)))
        .collect();
    let low = points.iter().fold(Point3::origin(), |a: Point3<f64>, b| a.inf(b));
    let high = points.iter().fold(Point3::origin(), |a: Point3<f64>, b| a.sup(b));
    [[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]]
        .map(|[x, y]| rig_from_board * Point3::new(x, y, 0.0))
        .into()
}

fn named(pair: &RigPairEntry) -> String {
    rig_words::pair_name(&pair.of[0], &pair.of[1])
}

/// Numbers of each two cameras, the weakest pair first.
fn pairs(rig: &RigFile) -> String {
    let mut pairs: Vec<&RigPairEntry> = rig.pairs.iter().filter(|pair| pair.instants > 0).collect();
    if pairs.is_empty() {
        return String::new();
    }
    let weakness = |pair: &RigPairEntry| pair.length_bound_m.or(pair.row_sd_px);
    pairs.sort_by(|a, b| {
        let [a, b] = [a, b].map(|pair| weakness(pair).unwrap_or(f64::INFINITY));
        b.total_cmp(&a)
    });
    let unknown = || rig_words::UNKNOWN.to_owned();
    let rows: String = pairs
        .iter()
        .map(|pair| {
            let mm = |m: f64| 1000.0 * m;
            let cells = [
                match pair.baseline_sd_m {
                    Some(sd_m) => measured(mm(pair.baseline_m), Some(mm(sd_m))),
                    None => plain(mm(pair.baseline_m), 1),
                },
                pair.row_sd_px.map_or_else(unknown, |px| brief_data(px, 2)),
                pair.row_rms_px.map_or_else(unknown, |px| brief_data(px, 2)),
                pair.distance_sd.map_or_else(unknown, |share| brief_data(100.0 * share, 2)),
                pair.at_m.map_or_else(unknown, |at_m| plain(at_m, 2)),
                pair.instants.to_string(),
            ];
            row(&named(pair), &cells)
        })
        .collect();
    let head: String = rig_words::PAIR_COLUMNS
        .iter()
        .map(|name| format!("<th scope=\"col\">{name}</th>"))
        .collect();
    let body = format!(
        "<table><thead><tr><th></th>{head}</tr></thead><tbody>\n{rows}</tbody></table>\n<p class=\"note\">{}</p>\n",
        rig_words::PAIR_NOTE
    );
    section(Section::Pairs, &body)
}

fn cameras(rig: &RigFile) -> String {
    if rig.cameras.is_empty() {
        return String::new();
    }
    let of = |camera: &RigCameraEntry| {
        let lens = camera.lens.camera();
        let sd = |name: &str| {
            let all = camera.lens.covariance_all.as_ref()?;
            let at = all.order.iter().position(|parameter| parameter == name)?;
            Some((*all.matrix.get(at)?.get(at)?)?.max(0.0).sqrt())
        };
        let cells = [
            measured(lens.f_px.x, sd("fx")),
            measured(lens.f_px.y, sd("fy")),
            measured(lens.pp_px.x, sd("cx")),
            measured(lens.pp_px.y, sd("cy")),
            camera.lens.rms_px.map_or_else(String::new, |px| plain(px, 3)),
            camera.alone_rms_px.map_or_else(String::new, |px| plain(px, 3)),
            camera.views.to_string(),
        ];
        row(&camera.name, &cells)
    };
    let rows: String = rig.cameras.iter().map(of).collect();
    let head: String = rig_words::CAMERA_COLUMNS
        .iter()
        .map(|name| format!("<th scope=\"col\">{name}</th>"))
        .collect();
    let body =
        format!("<table><thead><tr><th></th>{head}</tr></thead><tbody>\n{rows}</tbody></table>\n");
    section(Section::Cameras, &body)
}

/// Standard deviation of a distance against the distance, for each pair.
fn distances(rig: &RigFile) -> String {
    let Some(known) = rig.known() else {
        return figure(Section::Distances, &missing(rig_words::NO_UNCERTAINTY), "");
    };
    let place = |name: &String| rig.cameras.iter().position(|camera| camera.name == *name);
    let of = |pair: &RigPairEntry| {
        let of = [place(&pair.of[0])?, place(&pair.of[1])?];
        let sizes = of.map(|camera| {
            let [width_px, height_px] = rig.cameras[camera].image_size;
            ImageSize { width_px, height_px }
        });
        let at_m = pair.at_m?;
        let points = FAR.iter().filter_map(|times| {
            let at_m = times * at_m;
            Some((at_m, 1000.0 * at_m * known.distance_sd(of, sizes, at_m)?))
        });
        Some(Series::line(named(pair), points.collect()))
    };
    let series: Vec<Series> =
        rig.pairs.iter().filter_map(of).filter(|it| !it.points.is_empty()).collect();
    if series.is_empty() {
        return figure(Section::Distances, &missing(rig_words::NO_UNCERTAINTY), "");
    }
    let [x, y] = rig_words::DISTANCE_AXES;
    let plot = Plot::new("", x, y, series);
    figure(Section::Distances, &plot.svg(), rig_words::DISTANCE_NOTE)
}

/// Residual of each picture, by place of the board.
fn residuals(rig: &RigFile) -> String {
    let of = |camera: &RigCameraEntry| {
        let points = rig.instants.iter().filter_map(|instant| {
            Some((instant.number as f64, *instant.residual_px.get(&camera.name)?))
        });
        Series::cloud(&camera.name, points.collect())
    };
    let series: Vec<Series> = rig.cameras.iter().map(of).collect();
    if series.is_empty() {
        return String::new();
    }
    let [x, y] = rig_words::RESIDUAL_AXES;
    figure(Section::Residuals, &Plot::new("", x, y, series).svg(), rig_words::RESIDUAL_NOTE)
}
