//! Input of mrcal's own estimate of uncertainty: `optimization_inputs`, an archive of numpy arrays
//! in base 85.

use std::fmt::Write;

use nalgebra::{Isometry3, Point3};

use boresight_geometry::{Corner, boards::Board};

/// A view used by a calibration.
#[derive(Clone, Copy, Debug)]
pub struct SolvedView<'a> {
    /// Name of the picture.
    pub name: &'a str,
    /// Corners in the board's numbering order.
    pub corners: &'a [Corner],
    /// Pose of the board, with the origin in the middle of the inner corners, in metres.
    pub cam_from_board: Isometry3<f64>,
}

/// Most corners written: larger files of mrcal grow beyond the reach of programs.
const MOST_CORNERS: usize = 400_000;

/// Digits of Python's `base64.b85encode`.
const DIGITS: &[u8; 85] =
    b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;<=>?@^_`{|}~";

/// The `optimization_inputs` of a camera with `views` of `board`, as an ASCII text; `None` if there
/// are none, too many, or any of another board; and for an AprilGrid or shifted rows, because
/// mrcal's boards have even steps.
pub(super) fn optimization_inputs(
    lensmodel: &str,
    intrinsics: &[f64],
    size_px: [u32; 2],
    board: &Board,
    views: &[SolvedView<'_>],
) -> Option<String> {
    let (columns, rows) = (board.columns(), board.rows());
    let per_view = columns * rows;
    let fits = views.iter().all(|view| view.corners.len() == per_view);
    let [step_m, other_m] = board.target().steps_m();
    // The second point of a board with even steps is one step away.
    let is_even = step_m == other_m && board.target().place_in_steps(1) == [1.0, 0.0];
    if !is_even || views.is_empty() || !fits || views.len() * per_view > MOST_CORNERS {
        return None;
    }
    let first = *board.corners_in_board_m().first()?;
    let frames = views.iter().flat_map(|view| {
        // mrcal's board begins at its first corner.
        let at = view.cam_from_board * Point3::new(first.x, first.y, 0.0);
        let turn = view.cam_from_board.rotation.scaled_axis();
        [turn.x, turn.y, turn.z, at.x, at.y, at.z]
    });
    let observed = views.iter().flat_map(|view| view.corners).flat_map(|corner| {
        // A negative weight marks an unseen corner.
        let is_seen = corner.is_seen() && corner.px.iter().all(|px| px.is_finite());
        if is_seen { [corner.px.x, corner.px.y, 1.0] } else { [0.0, 0.0, -1.0] }
    });
    let indices = (0..).zip(views).flat_map(|(frame, _)| [frame, 0, -1]);
    let names: Vec<&str> = views.iter().map(|view| view.name).collect();
    let count = views.len();
    let doubles = |shape: &[usize], values: Vec<f64>| {
        let data: Vec<u8> = values.into_iter().flat_map(f64::to_le_bytes).collect();
        array("<f8", shape, &data)
    };
    let wholes = |shape: &[usize], values: Vec<i32>| {
        let data: Vec<u8> = values.into_iter().flat_map(i32::to_le_bytes).collect();
        array("<i4", shape, &data)
    };
    let truth = |value: bool| array("|b1", &[], &[u8::from(value)]);
    let size_px = size_px.map(|side| i32::try_from(side).unwrap_or(i32::MAX));
    let none = || text(&[""], &[]);
    let files = [
        ("intrinsics", doubles(&[1, intrinsics.len()], intrinsics.to_vec())),
        ("extrinsics_rt_fromref", doubles(&[0, 6], Vec::new())),
        ("frames_rt_toref", doubles(&[count, 6], frames.collect())),
        ("points", none()),
        ("observations_board", doubles(&[count, rows, columns, 3], observed.collect())),
        ("indices_frame_camintrinsics_camextrinsics", wholes(&[count, 3], indices.collect())),
        ("observations_point", none()),
        ("indices_point_camintrinsics_camextrinsics", none()),
        ("lensmodel", text(&[lensmodel], &[])),
        ("imagersizes", wholes(&[1, 2], size_px.to_vec())),
        ("calobject_warp", doubles(&[2], vec![0.0; 2])),
        ("calibration_object_spacing", doubles(&[], vec![board.square_m()])),
        ("verbose", truth(false)),
        ("do_optimize_intrinsics_core", truth(true)),
        ("do_optimize_intrinsics_distortions", truth(true)),
        ("do_optimize_extrinsics", truth(true)),
        ("do_optimize_frames", truth(true)),
        ("do_optimize_calobject_warp", truth(false)),
        ("do_apply_regularization", truth(true)),
        ("do_apply_outlier_rejection", truth(false)),
        ("imagepaths", text(&names, &[count])),
    ];
    Some(base85(&archive(&files)))
}

/// An array in numpy's `.npy` format, of elements described by `descr`.
fn array(descr: &str, shape: &[usize], data: &[u8]) -> Vec<u8> {
    const START: &[u8] = b"\x93NUMPY\x01\x00";
    let mut sides = String::new();
    for side in shape {
        // Writing to a string cannot fail.
        let _ = write!(sides, "{side}, ");
    }
    let mut header =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({sides}), }}");
    // The data begin at a multiple of 64 bytes, after the header's line end.
    let before = START.len() + 2 + header.len() + 1;
    header += &" ".repeat(before.next_multiple_of(64) - before);
    header.push('\n');
    let length = u16::try_from(header.len()).unwrap_or(u16::MAX).to_le_bytes();
    [START, &length, header.as_bytes(), data].concat()
}

/// An array of texts, four bytes a letter.
fn text(texts: &[&str], shape: &[usize]) -> Vec<u8> {
    let longest = texts.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
    let mut data = Vec::new();
    for text in texts {
        let letters = text.chars().map(u32::from).chain(std::iter::repeat(0)).take(longest);
        data.extend(letters.flat_map(u32::to_le_bytes));
    }
    array(&format!("<U{longest}"), shape, &data)
}

/// A ZIP archive of uncompressed files.
fn archive(files: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let (mut bytes, mut listed) = (Vec::new(), Vec::new());
    for (name, data) in files {
        let name = format!("{name}.npy");
        let size = (data.len() as u32).to_le_bytes();
        // Version, flags, method, time, date (1 January 1980), checksum, sizes, lengths of name and
        // extra.
        let common = [
            &[20, 0, 0, 0, 0, 0, 0, 0, 0x21, 0][..],
            &crc32fast::hash(data).to_le_bytes(),
            &size,
            &size,
            &(name.len() as u16).to_le_bytes(),
            &[0, 0],
        ]
        .concat();
        let at = (bytes.len() as u32).to_le_bytes();
        bytes.extend([b"PK\x03\x04", &common[..], name.as_bytes(), data].concat());
        let rest = [&[0; 10][..], &at, name.as_bytes()].concat();
        listed.extend([b"PK\x01\x02", &[20, 0][..], &common, &rest].concat());
    }
    let count = (files.len() as u16).to_le_bytes();
    let (length, at) = ((listed.len() as u32).to_le_bytes(), (bytes.len() as u32).to_le_bytes());
    let end = [b"PK\x05\x06", &[0; 4][..], &count, &count, &length, &at, &[0, 0]].concat();
    [bytes, listed, end].concat()
}

/// Five digits for each four bytes; digits of missing bytes at the end are left out.
fn base85(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len() / 4 * 5 + 5);
    for chunk in bytes.chunks(4) {
        let mut four = [0; 4];
        four[..chunk.len()].copy_from_slice(chunk);
        let mut number = u32::from_be_bytes(four);
        let mut digits = [0; 5];
        for digit in digits.iter_mut().rev() {
            *digit = DIGITS[(number % 85) as usize];
            number /= 85;
        }
        text.extend(digits[..=chunk.len()].iter().map(|digit| char::from(*digit)));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_those_of_python() {
        // base64.b85encode of the same bytes.
        assert_eq!(base85(b"boresight"), "VsCO~b7^O2bN");
        assert_eq!(base85(&[0, 0, 0, 0, 255]), "00000{{");
    }

    #[test]
    fn arrays_begin_where_numpy_expects_them() {
        let array = array("<f8", &[2], &[0; 16]);
        assert_eq!((array.len() - 16) % 64, 0);
        assert!(String::from_utf8_lossy(&array).contains("'shape': (2, )"));
        assert_eq!(text(&["ab"], &[]).len() % 64, 8);
    }
}
