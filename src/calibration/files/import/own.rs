use nalgebra::{Point2, SMatrix};
use serde_json::Value;

use super::{LockedLens, NotImported, OldCalibration, OldFormat};
use crate::{
    board::Checkerboard,
    calibration::Verdict,
    geometry::{BoardOutline, LENS_PARAMETERS},
};

/// Reads `boresight.calibration/1`.
pub(super) fn read(report: &Value) -> Result<OldCalibration, NotImported> {
    let schema = report["schema"].as_str().unwrap_or_default();
    if schema != "boresight.calibration/1" {
        return Err(NotImported::Schema { found: schema.into() });
    }
    let result = &report["result"];
    if result.is_null() {
        return Err(NotImported::NoResult);
    }
    let number = |name: &'static str, pointer: &str| {
        let value = report.pointer(pointer).and_then(Value::as_f64);
        value.ok_or(NotImported::Missing { name, wanted: "a finite number" })
    };
    let lens = [
        number("f_px", "/result/f_px/0")?,
        number("f_px", "/result/f_px/1")?,
        number("pp_px", "/result/pp_px/0")?,
        number("pp_px", "/result/pp_px/1")?,
        number("k1", "/result/distortion/k1")?,
        number("k2", "/result/distortion/k2")?,
        number("p1", "/result/distortion/p1")?,
        number("p2", "/result/distortion/p2")?,
        number("k3", "/result/distortion/k3")?,
    ];
    let size = [number("image_size", "/image_size/0")?, number("image_size", "/image_size/1")?];
    let mut old = OldCalibration::new(OldFormat::Own, &lens, size)?;
    old.rms_px = result["rms_px"].as_f64();
    // The doubt about coefficients held at zero moves with that of the others: cut off, it would grow.
    old.covariance = named_covariance(&result["covariance_all"])
        .or_else(|| named_covariance(&result["covariance"]));
    old.outlines = report["views"].as_array().into_iter().flatten().filter_map(outline).collect();
    old.verdict = [Verdict::Good, Verdict::Care, Verdict::Untrustworthy]
        .into_iter()
        .find(|verdict| report["verdict"] == verdict.code());
    old.board = board(&report["board"]);
    old.source = report["source"].as_str().map(Into::into);
    old.locked = LockedLens {
        focus: report["camera"]["focus"].as_i64(),
        zoom: report["camera"]["zoom"].as_i64(),
    };
    old.focal_varies = result["focal"]["varies"] == true;
    Ok(old)
}

fn board(named: &Value) -> Option<Checkerboard> {
    let count = |name: &str| named[name].as_u64().and_then(|count| count.try_into().ok());
    let square_m = named["square_mm"].as_f64()? / 1000.0;
    Checkerboard::new(count("columns")?, count("rows")?, square_m).ok()
}

/// The full matrix from its named rows, as `boresight.calibration/1` writes it: `order` and `matrix`.
///
/// `None` if there is none, a name is unknown or a number is missing.
pub fn named_covariance(named: &Value) -> Option<SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>> {
    // One f stands for fx and fy, which then move together.
    let indices = |name: &Value| -> Option<&'static [usize]> {
        Some(match name.as_str()? {
            "f" => &[0, 1],
            "fx" => &[0],
            "fy" => &[1],
            "cx" => &[2],
            "cy" => &[3],
            "k1" => &[4],
            "k2" => &[5],
            "p1" => &[6],
            "p2" => &[7],
            "k3" => &[8],
            _ => return None,
        })
    };
    let order: Vec<&[usize]> =
        named["order"].as_array()?.iter().map(indices).collect::<Option<_>>()?;
    let mut covariance = SMatrix::<f64, LENS_PARAMETERS, LENS_PARAMETERS>::zeros();
    for (row, rows) in order.iter().enumerate() {
        for (column, columns) in order.iter().enumerate() {
            let value = named["matrix"][row][column].as_f64().filter(|value| value.is_finite())?;
            for i in *rows {
                for j in *columns {
                    covariance[(*i, *j)] = value;
                }
            }
        }
    }
    let usable = !order.is_empty() && covariance.diagonal().iter().all(|variance| *variance >= 0.0);
    usable.then_some(covariance)
}

fn outline(view: &Value) -> Option<BoardOutline> {
    let corner = |i: usize| -> Option<Point2<f64>> {
        let at = &view["outline_px"][i];
        Some(Point2::new(at[0].as_f64()?, at[1].as_f64()?))
    };
    BoardOutline::around([corner(0)?, corner(1)?, corner(2)?, corner(3)?])
}
