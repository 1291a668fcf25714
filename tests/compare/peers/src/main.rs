//! calib-targets and vision-calibration on pictures of a board, each by the first example of the
//! documentation.
//!
//! - `peers detect COLUMNSxROWS PICTURE…` prints a table of corners, row by row, of each whole
//!   board: "file x y level". calib-targets doesn't get the board's size; a grid of another size
//!   isn't this board.
//! - `peers solve COLUMNSxROWS SQUARE_M TABLE` prints `fx fy cx cy k1 k2 p1 p2 k3`, and in the next
//!   line the stated standard deviations of fx, cx and cy. Lengths in metres, the rest in pixels.

use std::error::Error;
use std::fs;

use calib_targets::chessboard::{ChessboardDetection, ChessboardParams};
use calib_targets::{detect, image};
use vision_calibration::core::{DistortionParams, Uncertainty};
use vision_calibration::planar_intrinsics::run_calibration;
use vision_calibration::prelude::*;

struct Board {
    columns: usize,
    rows: usize,
}

impl Board {
    fn named(text: &str) -> Result<Self, Box<dyn Error>> {
        let (columns, rows) = text.split_once('x').ok_or("a board is COLUMNSxROWS")?;
        Ok(Self { columns: columns.parse()?, rows: rows.parse()? })
    }

    /// Corners row by row, if all of the board's corners are detected. A board on its side is
    /// turned by a quarter.
    fn whole(&self, seen: &ChessboardDetection) -> Option<Vec<[f32; 2]>> {
        let across = seen.corners.iter().map(|corner| corner.grid.u).max()? + 1;
        let down = seen.corners.iter().map(|corner| corner.grid.v).max()? + 1;
        let size = (self.columns as i32, self.rows as i32);
        let turned = (across, down) != size;
        if turned && (down, across) != size || seen.corners.len() != self.columns * self.rows {
            return None;
        }
        let mut grid = vec![[f32::NAN; 2]; seen.corners.len()];
        for corner in &seen.corners {
            let (column, row) = if turned {
                (corner.grid.v, across - 1 - corner.grid.u)
            } else {
                (corner.grid.u, corner.grid.v)
            };
            grid[row as usize * self.columns + column as usize] =
                [corner.position.x, corner.position.y];
        }
        Some(grid)
    }
}

fn detect_in(board: &Board, pictures: &[String]) -> Result<(), Box<dyn Error>> {
    println!("# filename x y level");
    for file in pictures {
        let picture = image::open(file)?.to_luma8();
        match detect::detect_chessboard(
            &picture,
            &detect::default_chess_config(),
            &ChessboardParams::default(),
        ) {
            Ok(seen) => board
                .whole(&seen)
                .into_iter()
                .flatten()
                .for_each(|[x, y]| println!("{file} {x} {y} 0")),
            Err(missed) if missed.is_not_found() => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

fn solve(board: &Board, square_m: f64, table: &str) -> Result<(), Box<dyn Error>> {
    let mut corners = Vec::new();
    for line in fs::read_to_string(table)?.lines().filter(|line| !line.starts_with('#')) {
        let fields: Vec<&str> = line.split(' ').collect();
        corners.push(Pt2::new(fields[1].parse()?, fields[2].parse()?));
    }
    let flat: Vec<Pt3> = (0..board.columns * board.rows)
        .map(|index| {
            Pt3::new(
                (index % board.columns) as f64 * square_m,
                (index / board.columns) as f64 * square_m,
                0.0,
            )
        })
        .collect();
    let views = corners
        .chunks(flat.len())
        .map(|seen| Ok(View::without_meta(CorrespondenceView::new(flat.clone(), seen.to_vec())?)));
    let mut session = CalibrationSession::<PlanarIntrinsicsProblem>::new();
    session.set_input(PlanarDataset::new(views.collect::<Result<_, Box<dyn Error>>>()?)?)?;
    run_calibration(&mut session)?;
    let result = session.export()?;

    let camera = &result.params.camera;
    let DistortionParams::BrownConrady5 { params: lens } = &camera.distortion else {
        return Err("another lens than Brown's".into());
    };
    let FxFyCxCy { fx, fy, cx, cy, .. } = camera.intrinsics;
    println!("{fx} {fy} {cx} {cy} {} {} {} {} {}", lens.k1, lens.k2, lens.p1, lens.p2, lens.k3);
    let Uncertainty::Available(stated) = &result.uncertainty else {
        return Err("no uncertainty is stated".into());
    };
    for name in ["fx", "cx", "cy"] {
        print!("{} ", stated.std_dev(name).ok_or("a parameter has no standard deviation")?);
    }
    println!();
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["detect", board, _, ..] => detect_in(&Board::named(board)?, &arguments[2..]),
        ["solve", board, square_m, table] => solve(&Board::named(board)?, square_m.parse()?, table),
        _ => Err(
            "usage: peers detect COLUMNSxROWS PICTURE… | peers solve COLUMNSxROWS SQUARE_M TABLE"
                .into(),
        ),
    }
}
