//! Why corners of a board are missing: cut off by the edge of the picture, or saturated.

use image::GrayImage;

use super::{
    lattice::{BESIDE, Lattice, Node, axes, height},
    outcome::Side,
    reduce::sample,
};

/// Sampling distances beyond the outermost corners, in squares (the board ends at 1): inside the outer squares, and in
/// the white margin.
const IN_OUTER_SQUARES: f32 = 0.75;
const IN_WHITE: f32 = 1.3;
/// Share of the step from dark to light squares above which a place counts as white.
const LIGHT_FROM: f32 = 0.75;
/// Least step from dark to light squares, in grey levels.
const LEAST_STEP: f32 = 8.0;

/// Brightness from which a square counts as saturated, in grey levels.
const SATURATED: f32 = 248.0;

/// The edge of the picture that the grid runs into, if any: beyond it, the next corners would lie outside.
pub(super) fn cut_off_by(image: &GrayImage, lattice: &Lattice) -> Option<Side> {
    let (width, height) = (image.width() as f32, image.height() as f32);
    let mut outside = [(Side::Left, 0), (Side::Right, 0), (Side::Top, 0), (Side::Bottom, 0)];
    for (i, j) in lattice.nodes() {
        for node in BESIDE.map(|(di, dj)| (i + di, j + dj)) {
            if lattice.contains(node) {
                continue;
            }
            let Some((guess, _)) = lattice.predict(node) else { continue };
            let margin = 6.0;
            outside[0].1 += usize::from(guess[0] < margin);
            outside[1].1 += usize::from(guess[0] > width - margin);
            outside[2].1 += usize::from(guess[1] < margin);
            outside[3].1 += usize::from(guess[1] > height - margin);
        }
    }
    let (side, count) = outside.into_iter().max_by_key(|(_, count)| *count)?;
    (count >= 2).then_some(side)
}

/// True if the grid ends where the picture is saturated: at least one in eight of the next three nodes beyond each end
/// of a line.
pub(super) fn glaring(image: &GrayImage, lattice: &Lattice) -> bool {
    let (mut missing, mut bright) = (0, 0);
    for &(i, j) in lattice.nodes() {
        let Some((here, (u, v))) =
            lattice.get((i, j)).and_then(|here| Some((here, axes(lattice, (i, j), here)?)))
        else {
            continue;
        };
        for (di, dj) in BESIDE {
            if lattice.contains((i + di, j + dj)) {
                continue;
            }
            let step: [f32; 2] = std::array::from_fn(|k| u[k] * di as f32 + v[k] * dj as f32);
            let reach = 0.3 * height((u, v));
            for ahead in [1.0, 2.0, 3.0] {
                let at = [here[0] + ahead * step[0], here[1] + ahead * step[1]];
                missing += 1;
                let glares = |dx: f32, dy: f32| sample(image, at[0] + dx, at[1] + dy) >= SATURATED;
                let across = [-reach, 0.0, reach];
                bright +=
                    usize::from(across.iter().all(|dx| across.iter().all(|dy| glares(*dx, *dy))));
            }
        }
    }
    bright >= 3 && 8 * bright >= missing
}

/// Steps out of a grid, through each of its sides.
pub(super) const SIDES: [Node; 4] = [(-1, 0), (1, 0), (0, -1), (0, 1)];
/// Sampling distances beyond a corner of the rim, in squares: in the outer square, and behind it, before a printed
/// code.
const IN_OUTER: [f32; 2] = [0.4, 0.75];
const BEHIND: [f32; 2] = [1.18, 1.34];
/// Sampling places between two corners of the rim.
const ALONG: [f32; 3] = [0.3, 0.5, 0.7];
/// Shares of the step from dark to light squares: a place is dark up to the first, and lighter than the board's white
/// from the second. Between the two, [`LIGHT_FROM`] is where it counts as light.
const DARK_TO: f32 = 0.35;
const GLARE_FROM: f32 = 1.6;

/// Kind of area behind the outer squares on one side of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Beyond {
    /// The white around the board.
    White,
    /// More squares of a larger board.
    Squares,
    /// Something else, or too little of it is seen.
    Unclear,
}

/// Kind of area behind the outer squares in the direction `out`. A dark square is followed by light in either case;
/// behind a light one, white or a dark square decides.
pub(super) fn beyond(image: &GrayImage, lattice: &Lattice, out: Node) -> Beyond {
    let Some((low, high)) = lattice.extent() else { return Beyond::Unclear };
    let (mut light_light, mut light_dark, mut dark_light, mut other) = (0, 0, 0, 0);
    for &(i, j) in lattice.nodes() {
        let on_rim = match out {
            (-1, _) => i == low.0,
            (1, _) => i == high.0,
            (_, -1) => j == low.1,
            _ => j == high.1,
        };
        let beside = (i + out.1.abs(), j + out.0.abs());
        if !on_rim || !lattice.contains(beside) {
            continue;
        }
        match outer_square(image, lattice, [(i, j), beside], out) {
            Some((true, Some(true))) => light_light += 1,
            Some((true, Some(false))) => light_dark += 1,
            Some((false, Some(true))) => dark_light += 1,
            _ => other += 1,
        }
    }
    let ends = light_light + dark_light;
    let goes_on = light_dark + dark_light;
    if light_light >= 1 && dark_light >= 1 && ends >= 3 && light_dark == 0 && 2 * other <= ends {
        Beyond::White
    } else if light_dark >= 1
        && dark_light >= 1
        && goes_on >= 3
        && 5 * light_light <= goes_on
        && 2 * other <= goes_on
    {
        Beyond::Squares
    } else {
        Beyond::Unclear
    }
}

/// Colour of the outer square beyond two neighbouring corners of the rim (`true`: light), and of the area beyond that
/// square: as light as light squares (`true`), as dark as dark ones (`false`), or neither. `None` outside of the
/// picture, or without a square.
fn outer_square(
    image: &GrayImage,
    lattice: &Lattice,
    corners: [Node; 2],
    (di, dj): Node,
) -> Option<(bool, Option<bool>)> {
    let between = |from: [f32; 2], to: [f32; 2], share: f32| -> [f32; 2] {
        std::array::from_fn(|k| from[k] + share * (to[k] - from[k]))
    };
    let rim = |(i, j): Node| {
        let here = lattice.get((i, j))?;
        Some((lattice.get((i - di, j - dj))?, here, lattice.predict((i + di, j + dj))?.0))
    };
    let [one, other] = [rim(corners[0])?, rim(corners[1])?];
    let (right, bottom) = (image.width() as f32 - 2.0, image.height() as f32 - 2.0);
    let level = |steps: f32, along: f32| {
        let at = |(inner, here, out)| match steps < 0.0 {
            true => between(here, inner, -steps),
            false => between(here, out, steps),
        };
        let [x, y] = between(at(one), at(other), along);
        let is_inside = (1.0..right).contains(&x) && (1.0..bottom).contains(&y);
        is_inside.then(|| sample(image, x, y))
    };
    let inside = level(-0.5, 0.5)?;
    let outer = [level(IN_OUTER[0], 0.5)?, level(IN_OUTER[1], 0.5)?];
    let outside = 0.5 * (outer[0] + outer[1]);
    let (dark, light) = (inside.min(outside), inside.max(outside));
    let step = light - dark;
    let share = |level: f32| (level - dark) / step;
    if step < LEAST_STEP || (share(outer[0]) - share(outer[1])).abs() > DARK_TO {
        return None;
    }
    let (mut least, mut most) = (f32::MAX, f32::MIN);
    for steps in BEHIND {
        for along in ALONG {
            let share = share(level(steps, along)?);
            (least, most) = (least.min(share), most.max(share));
        }
    }
    let is_light = (LIGHT_FROM..GLARE_FROM).contains(&least) && most < GLARE_FROM;
    let is_dark = most < DARK_TO;
    Some((outside > inside, (is_light || is_dark).then_some(is_light)))
}

/// True if white surrounds a full rectangle of corners: its outer squares keep their colours up to where the board must
/// end, and beyond all is as light as its light squares. A hand, or another row of squares, isn't.
pub(super) fn ends_in_white(image: &GrayImage, rectangle: &Lattice) -> bool {
    rectangle.nodes().iter().all(|&(i, j)| {
        BESIDE.into_iter().filter(|(di, dj)| !rectangle.contains((i + di, j + dj))).all(|out| {
            let beside = (i + out.1.abs(), j + out.0.abs());
            // The last corner of its side has no square beside it.
            !rectangle.contains(beside)
                || outer_square_ends_in_white(image, rectangle, [(i, j), beside], out) == Some(true)
        })
    })
}

/// See [`ends_in_white`], for the outer square beyond two neighbouring corners of the rim in the direction `out`.
fn outer_square_ends_in_white(
    image: &GrayImage,
    rectangle: &Lattice,
    corners: [Node; 2],
    (di, dj): Node,
) -> Option<bool> {
    let between = |from: [f32; 2], to: [f32; 2], share: f32| -> [f32; 2] {
        std::array::from_fn(|k| from[k] + share * (to[k] - from[k]))
    };
    let [(here, out), (beside, out_beside)] = {
        let rim =
            |(i, j): Node| Some((rectangle.get((i, j))?, rectangle.predict((i + di, j + dj))?.0));
        [rim(corners[0])?, rim(corners[1])?]
    };
    let inner = rectangle.get((corners[0].0 - di, corners[0].1 - dj))?;
    let beyond = |steps: f32| [between(here, out, steps), between(beside, out_beside, steps)];
    let middle = |[one, other]: [[f32; 2]; 2]| between(one, other, 0.5);
    let white = beyond(IN_WHITE);
    let (right, bottom) = (image.width() as f32 - 2.0, image.height() as f32 - 2.0);
    if !white.iter().all(|[x, y]| (1.0..right).contains(x) && (1.0..bottom).contains(y)) {
        return Some(false);
    }
    let at = |[x, y]: [f32; 2]| sample(image, x, y);
    // The square on this side of the rim has the other colour.
    let inside = at(middle([inner, beside]));
    let outside = at(middle(beyond(IN_OUTER_SQUARES)));
    let (dark, light) = (inside.min(outside), inside.max(outside));
    let is_light = |point: [f32; 2]| at(point) > dark + LIGHT_FROM * (light - dark);
    let contrasts = light - dark > LEAST_STEP;
    Some(contrasts && [white[0], middle(white), white[1]].into_iter().all(is_light))
}
