//! Growth of a principal line's deflection with the board's shift. (The paper's Fig. 3.)

use super::{
    directionality::{Row, deflection, table},
    outcome::{Check, Claim, Figure, Outcome, Verdict, Within},
    params::Params,
    setup::Setup,
};
use boresight_present::chart::{Plot, Series};

/// Directions of the paper's figure: across the line, at 45° to it, along it.
pub const DIRECTIONS_RAD: [f64; 3] =
    [0.0, std::f64::consts::FRAC_PI_4, std::f64::consts::FRAC_PI_2];

/// Shifts from zero to `longest_m` in steps of `step_m`, in each of [`DIRECTIONS_RAD`].
pub fn rows(setup: &Setup, longest_m: f64, step_m: f64) -> Vec<Row> {
    let steps = (longest_m / step_m).round() as usize;
    DIRECTIONS_RAD
        .iter()
        .flat_map(|direction| {
            (0..=steps).filter_map(|i| deflection(setup, step_m * i as f64, *direction))
        })
        .collect()
}

/// Shift in mm, offset in px and angle in degrees across the line, offset in px at 45° to it.
const KNOWN: [(f64, f64, f64, f64); 6] = [
    (50.0, 8.47, 0.303, 5.97),
    (100.0, 16.95, 0.607, 11.94),
    (150.0, 25.48, 0.913, 17.90),
    (200.0, 34.06, 1.220, 23.88),
    (300.0, 51.46, 1.845, 35.93),
    (400.0, 69.33, 2.488, 48.20),
];

/// Runs the experiment with `params`.
pub fn outcome(params: &Params) -> Outcome {
    let setup = Setup::of(params);
    let rows = rows(&setup, params.longest_shift_m, params.shift_step_m);
    let along_direction =
        |direction_rad: f64| rows.iter().filter(move |row| row.direction_rad == direction_rad);
    let series = DIRECTIONS_RAD.map(|direction_rad| {
        Series::line(
            format!("{:.0}° from across", direction_rad.to_degrees()),
            along_direction(direction_rad).map(|r| (1e3 * r.shift_m, r.offset_px.abs())).collect(),
        )
    });
    let across: Vec<&Row> = along_direction(0.0).collect();
    let grows = across.windows(2).all(|pair| pair[1].offset_px.abs() > pair[0].offset_px.abs());
    let slope = |row: &Row| row.offset_px.abs() / row.shift_m;
    let moved = || across.iter().filter(|row| row.shift_m > 0.0);
    let (least, most) = moved().fold((f64::MAX, 0.0_f64), |(least, most), row| {
        (least.min(slope(row)), most.max(slope(row)))
    });
    let mut checks = Vec::new();
    for (shift, lateral_offset_px, angle_deg, diagonal_px) in KNOWN {
        let measured = |direction_rad| deflection(&setup, shift * 1e-3, direction_rad);
        if params.rendered {
            break;
        }
        let (Some(across), Some(diagonal)) = (measured(0.0), measured(DIRECTIONS_RAD[1])) else {
            continue;
        };
        let within = |rounding| Within::Share(0.01, rounding);
        for (what, reference, measured, rounding) in [
            ("offset across (px)", lateral_offset_px, across.offset_px.abs(), 0.005),
            ("angle across (deg)", angle_deg, across.angle_rad.to_degrees().abs(), 0.0005),
            ("offset at 45° (px)", diagonal_px, diagonal.offset_px.abs(), 0.005),
        ] {
            let what = format!("{shift:.0} mm: {what}");
            checks.push(Check { what, reference, measured, within: within(rounding) });
        }
    }
    Outcome {
        name: "monotonicity".into(),
        title: "Monotonicity (Fig. 3)".into(),
        method: format!(
            "The shift grows to {:.0} mm in three directions.",
            1e3 * params.longest_shift_m
        ),
        claims: vec![Claim {
            claim: "The deflection grows with the shift.".into(),
            measured: format!(
                "Yes, and practically in proportion: {least:.1} to {most:.1} px per metre across the line."
            ),
            verdict: Verdict::of(grows),
        }],
        checks,
        tables: vec![table("monotonicity", &rows)],
        figures: vec![Figure {
            name: "monotonicity".into(),
            caption: "Offset of the line from the principal point against the board's shift."
                .into(),
            svg: Plot::new(
                "Deflection by length of the shift",
                "shift (mm)",
                "offset of the line from the PP (px)",
                series.into(),
            )
            .svg(),
        }],
    }
}
