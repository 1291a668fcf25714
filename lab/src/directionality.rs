//! Deflection of a principal line from the principal point against the direction of shift. (The
//! paper's Fig. 2.)

use nalgebra::Vector2;

use super::{
    estimate::view,
    outcome::{Check, Claim, Figure, Outcome, Table, Verdict, Within},
    params::Params,
    setup::Setup,
};
use boresight_geometry::PrincipalLine;
use boresight_present::chart::{Plot, Series};

/// Principal line of a shifted board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Length of the shift.
    pub shift_m: f64,
    /// Direction of the shift, from across the line (0) to along the line (π/2), `[0, 2π)`.
    pub direction_rad: f64,
    /// Signed distance of the line from the true principal point.
    pub offset_px: f64,
    /// Angle between the line and the line of the board without shift, signed.
    pub angle_rad: f64,
}

/// Shifts of `shift_m` in `count` directions over the full turn.
pub fn rows(setup: &Setup, shift_m: f64, count: usize) -> Vec<Row> {
    (0..count)
        .filter_map(|i| deflection(setup, shift_m, std::f64::consts::TAU * i as f64 / count as f64))
        .collect()
}

/// Deflection of the line by a shift. `None` if the board has no line there.
pub fn deflection(setup: &Setup, shift_m: f64, direction_rad: f64) -> Option<Row> {
    let shift = Vector2::new(direction_rad.cos(), direction_rad.sin()) * shift_m;
    let straight = line(setup, &Vector2::zeros())?;
    let line = line(setup, &shift)?;
    // The sign of a line's normal is arbitrary; use the unshifted line's.
    let sign = line.normal().dot(&straight.normal()).signum();
    let normal = line.normal() * sign;
    let cross = straight.normal().perp(&normal);
    Some(Row {
        shift_m,
        direction_rad,
        offset_px: sign * line.c_px,
        angle_rad: cross.atan2(straight.normal().dot(&normal)),
    })
}

fn line(setup: &Setup, shift_m: &Vector2<f64>) -> Option<PrincipalLine> {
    let corners = setup.corners_px(&setup.pose(0.0, shift_m, &Vector2::zeros()))?;
    view(&setup.board, &corners, setup.camera.pp_px, 1e-6)?.line
}

pub(super) fn table(name: &str, rows: &[Row]) -> Table {
    let mut table = Table::new(name, &["direction_deg", "shift_m", "offset_px", "angle_deg"]);
    for row in rows {
        table.push(&[
            &row.direction_rad.to_degrees(),
            &row.shift_m,
            &row.offset_px,
            &row.angle_rad.to_degrees(),
        ]);
    }
    table
}

/// Runs the experiment with `params`.
pub fn outcome(params: &Params) -> Outcome {
    let setup = Setup::of(params);
    let rows = rows(&setup, params.shift_m, params.directions);
    let at = |direction_rad: f64| {
        deflection(&setup, params.shift_m, direction_rad)
            .map_or(f64::NAN, |row| row.offset_px.abs())
    };
    let (across, along) = (at(0.0), at(std::f64::consts::FRAC_PI_2));
    let off = |row: &Row| (row.offset_px.abs() - across * row.direction_rad.cos().abs()).abs();
    let worst = rows.iter().map(off).fold(0.0, f64::max);
    let degrees = |row: &Row| row.direction_rad.to_degrees();
    let plot = Plot::new(
        "Deflection by direction of the shift",
        "direction from across the line (deg)",
        "offset of the line from the PP (px)",
        vec![
            Series::line(
                "measured",
                rows.iter().map(|r| (degrees(r), r.offset_px.abs())).collect(),
            ),
            Series::line(
                "|cos|",
                rows.iter().map(|r| (degrees(r), across * r.direction_rad.cos().abs())).collect(),
            ),
        ],
    );
    let exact = !params.rendered;
    Outcome {
        name: "directionality".into(),
        title: "Directionality (Fig. 2)".into(),
        method: format!(
            "A tilted board is shifted by {:.0} mm in {} directions parallel to the picture; its principal line is computed from the distorted corners.",
            params.shift_m * 1e3,
            rows.len()
        ),
        claims: vec![Claim {
            claim: "A shift across the principal line deflects it most, a shift along it not at all.".into(),
            measured: format!(
                "{across:.2} px across, {along:.1e} px along; the offset follows |cos| of the direction to {worst:.2} px ({:.1} %).",
                100.0 * worst / across
            ),
            verdict: Verdict::of(along < 0.01 * across && worst < 0.02 * across),
        }],
        checks: if exact {
            vec![
                Check { what: "offset, 50 mm across (px)".into(), reference: 8.47, measured: at(0.0), within: Within::Share(0.01, 0.005) },
                Check { what: "offset, 50 mm at 45° (px)".into(), reference: 5.97, measured: at(std::f64::consts::FRAC_PI_4), within: Within::Share(0.01, 0.005) },
                Check { what: "offset, 50 mm along (px): none but rounding".into(), reference: 1e-11, measured: along, within: Within::AtMost },
            ]
        } else {
            Vec::new()
        },
        tables: vec![table("directionality", &rows)],
        figures: vec![Figure {
            name: "directionality".into(),
            caption: "The line leaves the principal point by the part of the shift that lies across it. The paper shows the directions 0°, 45° and 90°.".into(),
            svg: plot.svg(),
        }],
    }
}
