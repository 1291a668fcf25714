//! Grids of circles: grown from ellipses, and placed on the board by their number.
//!
//! Circles look alike, so a grid is named only if it is the whole board or if the missing circles
//! have only one possible place, and if nothing like a circle follows it.

use image::GrayImage;

use super::{
    circle_blobs::Blob,
    lattice::{BESIDE, Lattice, Node},
    missing::why_missing,
    nearby::Nearby,
    outcome::{Miss, OtherBoard, Side},
    placement::TURNS,
    reduce::sample,
    track::Expected,
};
use boresight_geometry::{
    boards::{Circles, Target},
    markers::CircleRows,
};

/// Distance of neighbours, in radii of the circle.
const STEP_RADII: std::ops::Range<f32> = 2.04..9.0;
/// Number of nearest ellipses considered as neighbours of a seed, and least number of the four
/// neighbours.
const NEAREST: usize = 16;
const LEAST_BESIDE: usize = 3;
/// Largest ratio of the distances of nearest neighbours: diagonal neighbours are 1.4 times as far.
const EQUAL: f32 = 1.25;
/// Largest deviation of a neighbour from the expected place, in steps.
const OFF_STEPS: f32 = 0.3;
/// Ratio of the squared areas of neighbouring ellipses.
const ALIKE: std::ops::Range<f32> = 0.2..5.0;
/// Largest reach of a circle around the centre, in steps: half the way to the next.
const HALF_WAY: f32 = 0.5;
/// Most seeds tried in a picture.
const SEEDS: usize = 60;
/// Reciprocal of the largest share of missing circles.
const MISSING_SHARE: usize = 6;
/// Sampling places beyond the last circle, as shares of the way to the next: before and in its
/// middle.
const BEYOND: [f32; 2] = [Circles::GROUND as f32, 0.95];
/// Largest deviation from the colour between circles, as a share of the contrast.
const SAME: f32 = 0.35;

/// Grows grids from ellipses. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct CircleGrower {
    nearby: Nearby,
    taken: Vec<bool>,
    /// Blobs of the grid, in the order of addition to the lattice.
    members: Vec<usize>,
    /// Largest grid.
    pub(super) lattice: Lattice,
    /// Growing grid.
    growing: Lattice,
    /// Candidate neighbours of a seed: distances and places in its radii.
    near: Vec<(f32, [f32; 2], usize)>,
    frontier: Vec<Node>,
    added: Vec<(Node, usize)>,
}

impl CircleGrower {
    /// Starts with the blobs of a picture of the given width and height.
    pub(super) fn start(&mut self, blobs: &[Blob], size: [u32; 2]) {
        self.nearby.start(blobs.iter().map(|blob| blob.at), size);
    }

    /// Grows the largest grid of dark or light blobs, for a board whose grid is at most `longest`
    /// long.
    pub(super) fn grow(&mut self, blobs: &[Blob], is_dark: bool, longest: usize) {
        self.lattice.clear(longest);
        self.taken.clear();
        self.taken.extend(blobs.iter().map(|blob| blob.is_dark != is_dark));
        let mut seeds = 0;
        for seed in 0..blobs.len() {
            if self.taken[seed] || seeds == SEEDS {
                continue;
            }
            self.growing.clear(longest);
            self.members.clear();
            if !self.begin(blobs, seed) {
                continue;
            }
            seeds += 1;
            while self.extend(blobs) {}
            for &member in &self.members {
                self.taken[member] = true;
            }
            if self.growing.len() > self.lattice.len() {
                std::mem::swap(&mut self.growing, &mut self.lattice);
            }
        }
    }

    fn insert(&mut self, node: Node, blobs: &[Blob], index: usize) {
        if self.growing.insert(node, blobs[index].at) {
            self.members.push(index);
        }
    }

    /// Begins a grid with a blob with neighbours on at least three sides, at equal distances in
    /// radii of the blob.
    fn begin(&mut self, blobs: &[Blob], seed: usize) -> bool {
        let blob = blobs[seed];
        let determinant = blob.determinant();
        // Ellipses further away are outside the radii.
        let reach = STEP_RADII.end * (blob.shape[0] + blob.shape[2]).sqrt();
        let possible = self.nearby.near(blob.at, reach).filter_map(|(index, _)| {
            let is_alike = ALIKE.contains(&(blobs[index].determinant() / determinant));
            let at = blob.radii_to(blobs[index].at);
            let radii = libm::hypotf(at[0], at[1]);
            let is_possible = !self.taken[index] && is_alike && STEP_RADII.contains(&radii);
            is_possible.then_some((radii, at, index))
        });
        self.near.clear();
        self.near.extend(possible);
        self.near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        self.near.truncate(NEAREST);
        let nearest = self.near.first().map_or(0.0, |it| it.0);
        let equal = self.near.iter().take_while(|it| it.0 < EQUAL * nearest);
        let mut begun = equal.map(|&(radii, [x, y], _)| {
            // Clockwise on the screen, as the map to a circle keeps the sense of rotation.
            [[x, y], [-y, x], [-x, -y], [y, -x]].map(|to| {
                let off = |at: &[f32; 2]| libm::hypotf(at[0] - to[0], at[1] - to[1]);
                let nearest = self.near.iter().min_by(|a, b| off(&a.1).total_cmp(&off(&b.1)));
                nearest.filter(|it| off(&it.1) < OFF_STEPS * radii).map(|it| it.2)
            })
        });
        let Some(found) = begun.find(|it| it.iter().flatten().count() >= LEAST_BESIDE) else {
            return false;
        };
        self.insert((0, 0), blobs, seed);
        for (node, index) in [(1, 0), (0, 1), (-1, 0), (0, -1)].into_iter().zip(found) {
            if let Some(index) = index {
                self.insert(node, blobs, index);
            }
        }
        true
    }

    /// Adds the blobs next to members; returns `false` if there are none.
    fn extend(&mut self, blobs: &[Blob]) -> bool {
        self.frontier.clear();
        for (i, j) in self.growing.nodes() {
            let beside = BESIDE.map(|(di, dj)| (i + di, j + dj));
            self.frontier.extend(beside.iter().filter(|node| !self.growing.contains(**node)));
        }
        self.frontier.sort_unstable();
        self.frontier.dedup();
        self.added.clear();
        for &node in &self.frontier {
            let Some((guess, side)) = self.growing.predict(node) else { continue };
            let next_to = BESIDE.iter().find_map(|(di, dj)| {
                self.growing.order((node.0 + di, node.1 + dj)).map(|order| self.members[order])
            });
            let Some(beside) = next_to.map(|index| blobs[index]) else { continue };
            let is_alike = |blob: &Blob| {
                blob.is_dark == beside.is_dark
                    && ALIKE.contains(&(blob.determinant() / beside.determinant()))
            };
            let alike = self.nearby.near(guess, OFF_STEPS * side);
            let alike = alike.filter(|(index, _)| is_alike(&blobs[*index]));
            let nearest = alike.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
            let is_free = |index: &usize| {
                !self.members.contains(index) && self.added.iter().all(|(_, other)| other != index)
            };
            if let Some(index) = nearest.map(|(index, _)| index).filter(is_free) {
                self.added.push((node, index));
            }
        }
        let before = self.members.len();
        for k in 0..self.added.len() {
            let (node, index) = self.added[k];
            self.insert(node, blobs, index);
        }
        self.members.len() > before
    }
}

/// Place of a circle on the lattice of nearest neighbours, which lies diagonally if every second
/// row is shifted.
fn node_of([x, y]: [i32; 2], circles: &Circles) -> [i32; 2] {
    if circles.step() == 1 { [x, y] } else { [(x + y).div_euclid(2), (y - x).div_euclid(2)] }
}

/// Inverse of [`node_of`].
fn place_of([i, j]: [i32; 2], layout: CircleRows) -> [i32; 2] {
    match layout {
        CircleRows::Symmetric => [i, j],
        CircleRows::Asymmetric => [i - j, i + j],
    }
}

/// Longest side of the lattice of a board.
pub(super) fn longest(circles: &Circles) -> usize {
    let [across, down] = circles.reach();
    if circles.step() == 1 { across.max(down) + 1 } else { (across + down) / 2 + 1 }
}

/// Placement of the board on the lattice: node = turn · node of the board + shift.
#[derive(Clone, Copy)]
struct Way {
    turn: [[i32; 2]; 2],
    shift: [i32; 2],
}

impl Way {
    fn node(&self, at: [i32; 2]) -> Node {
        let [i, j] = std::array::from_fn(|k| {
            self.turn[k][0] * at[0] + self.turn[k][1] * at[1] + self.shift[k]
        });
        (i, j)
    }
}

/// Writes the places of the board's circles to `into`, row by row; `None` for the few unseen ones.
///
/// # Errors
///
/// [`Miss`] if the grid isn't the board, or its place on the board is ambiguous.
pub(super) fn place_circles(
    picture: &GrayImage,
    lattice: &Lattice,
    circles: &Circles,
    expected: &Expected,
    into: &mut Vec<Option<[f32; 2]>>,
) -> Result<(), Miss> {
    let wanted = circles.point_count();
    let found = lattice.len();
    let partial = |found: usize| Miss::PartialBoard {
        found: found.min(wanted),
        wanted,
        size: [0; 2],
        cut_off_by: why_missing(picture, lattice, None, HALF_WAY).cut_off_by(),
    };
    let Some((low, high)) = lattice.extent() else { return Err(Miss::NoBoard) };
    let at = |index: usize| circles.at(index).map(|at| at as i32);
    let nodes: Vec<[i32; 2]> = (0..wanted).map(|index| node_of(at(index), circles)).collect();
    let mut ways: Vec<Way> = Vec::new();
    let mut may_hold = false;
    for turn in TURNS {
        let turned = |at: &[i32; 2]| Way { turn, shift: [0, 0] }.node(*at);
        let start = turned(&nodes[0]);
        let ends = nodes.iter().map(turned).fold((start, start), |(low, high), (i, j)| {
            ((low.0.min(i), low.1.min(j)), (high.0.max(i), high.1.max(j)))
        });
        may_hold |= high.0 - low.0 <= ends.1.0 - ends.0.0 && high.1 - low.1 <= ends.1.1 - ends.0.1;
        // Each outer row and column shows a circle, or the board is another one.
        let shift = [low.0 - ends.0.0, low.1 - ends.0.1];
        let way = Way { turn, shift };
        let seen = nodes.iter().filter(|at| lattice.contains(way.node(**at))).count();
        if seen == found && shift == [high.0 - ends.1.0, high.1 - ends.1.1] {
            ways.push(way);
        }
    }
    if ways.is_empty() {
        let part = (found < wanted && may_hold).then(|| partial(found));
        let is_cut_off = matches!(part, Some(Miss::PartialBoard { cut_off_by: Some(_), .. }));
        let other = whole_grid(lattice, circles.layout()).filter(|_| !is_cut_off);
        return Err(other.map(Miss::OtherBoard).or(part).unwrap_or(Miss::NoBoard));
    }
    // Exactly the turns that map the board to itself must fit.
    let symmetries = match (circles.looks_the_same_upside_down(), circles.grid()) {
        (false, _) => 1,
        (true, [columns, rows]) if circles.step() == 1 && columns == rows => 4,
        (true, _) => 2,
    };
    if found * MISSING_SHARE < wanted * (MISSING_SHARE - 1) || ways.len() != symmetries {
        return Err(partial(found));
    }
    // The first circle is at its previous place, or nearest to the top left.
    let first = |way: &Way| {
        let off = |index: usize| {
            let (x, y) = way.node(nodes[index]);
            let at = lattice.get((x, y));
            match (expected.corners.get(index), at) {
                (Some(to), Some([x, y])) => libm::hypotf(x - to[0], y - to[1]),
                (None, Some([x, y])) if index == 0 => x + y,
                _ => 0.0,
            }
        };
        (0..wanted).map(off).sum::<f32>()
    };
    let Some(way) = ways.iter().min_by(|a, b| first(a).total_cmp(&first(b))) else {
        return Err(Miss::NoBoard);
    };
    // A board previously seen whole may come nearer to the edge of the picture.
    let is_followed = !expected.corners.is_empty() && is_near(lattice, way, &nodes, expected);
    let needs = (found < wanted, !is_followed);
    check_ends(picture, lattice, circles, way, needs).map_err(|side| match side {
        Some(side) => Miss::PartialBoard { found, wanted, size: [0; 2], cut_off_by: Some(side) },
        None => partial(found),
    })?;
    into.clear();
    into.extend(nodes.iter().map(|at| lattice.get(way.node(*at))));
    Ok(())
}

/// True if the circles are at the expected places, to a third of the distance to the neighbours.
fn is_near(lattice: &Lattice, way: &Way, nodes: &[[i32; 2]], expected: &Expected) -> bool {
    let off_steps = |(at, to): (&[i32; 2], &[f32; 2])| {
        let here = lattice.get(way.node(*at))?;
        let beside =
            BESIDE.iter().filter_map(|(di, dj)| lattice.get(way.node([at[0] + di, at[1] + dj])));
        let apart =
            |one: [f32; 2], other: &[f32; 2]| libm::hypotf(one[0] - other[0], one[1] - other[1]);
        let step = beside.map(|other| apart(other, &here)).min_by(f32::total_cmp)?;
        Some(apart(here, to) / step)
    };
    let off = || nodes.iter().zip(&expected.corners).filter_map(off_steps);
    3.0 * off().sum::<f32>() < off().count() as f32
}

/// Board of any size for a grid without gaps of the given layout.
pub(super) fn whole_grid(lattice: &Lattice, layout: CircleRows) -> Option<OtherBoard> {
    let places = || lattice.nodes().iter().map(|&(i, j)| place_of([i, j], layout));
    let ends = |axis: usize| {
        Some((places().map(|at| at[axis]).min()?, places().map(|at| at[axis]).max()?))
    };
    let ((left, right), (top, bottom)) = (ends(0)?, ends(1)?);
    let [across, down] = [right - left + 1, bottom - top + 1];
    // Rows may lie along either axis.
    let sizes = match layout {
        CircleRows::Symmetric => [[across.max(down), across.min(down)]; 2],
        CircleRows::Asymmetric => [[across / 2, down], [down / 2, across]],
    };
    let is_whole = |size: &[i32; 2]| {
        lattice.len() as i32 == size[0] * size[1] && size.iter().all(|count| *count >= 3)
    };
    let [columns, rows] = sizes.into_iter().find(is_whole)?.map(|count| count as usize);
    Some(OtherBoard::Circles { columns, rows, layout })
}

/// Checks that nothing like a circle follows the board on any side. If circles are missing, the
/// ground must also be seen there, and the edge of the picture must leave room for it. The error is
/// the side that cuts the board off, if any.
fn check_ends(
    picture: &GrayImage,
    lattice: &Lattice,
    circles: &Circles,
    way: &Way,
    (needs_ground, needs_room): (bool, bool),
) -> Result<(), Option<Side>> {
    let [across, down] = circles.reach().map(|reach| reach as i32);
    // By side of the board: places beyond it, outside of the picture, and on the ground.
    let mut sides = [[0_usize; 3]; 4];
    // Places with a circle's colour behind ground, with the colour of the ground.
    let mut alike: [Vec<([f32; 2], f32, f32)>; 4] = Default::default();
    let mut outside = [[0.0_f32; 2]; 4];
    let inside = |[x, y]: [f32; 2]| {
        (0.0..picture.width() as f32 - 1.0).contains(&x)
            && (0.0..picture.height() as f32 - 1.0).contains(&y)
    };
    for index in 0..circles.point_count() {
        let board_node = node_of(circles.at(index).map(|at| at as i32), circles);
        let node = way.node(board_node);
        let Some(here) = lattice.get(node) else { continue };
        for (di, dj) in BESIDE {
            let next_board = [board_node[0] + di, board_node[1] + dj];
            let [x, y] = place_of(next_board, circles.layout());
            let side = match (x, y) {
                (_, y) if y < 0 => 0,
                (_, y) if y > down => 1,
                (x, _) if x < 0 => 2,
                (x, _) if x > across => 3,
                _ => continue,
            };
            let next = way.node(next_board);
            let back = (2 * node.0 - next.0, 2 * node.1 - next.1);
            let Some(inner) = lattice.get(back) else { continue };
            let beyond = match lattice.predict(next) {
                Some((guess, _)) => guess,
                None => std::array::from_fn(|k| 2.0 * here[k] - inner[k]),
            };
            let along = |from: [f32; 2], to: [f32; 2], share: f32| -> [f32; 2] {
                std::array::from_fn(|k| from[k] + share * (to[k] - from[k]))
            };
            let level = |[x, y]: [f32; 2]| sample(picture, x, y);
            let (disc, ground) = (level(here), level(along(here, inner, 0.5)));
            let contrast = ground - disc;
            sides[side][0] += 1;
            let places = BEYOND.map(|share| along(here, beyond, share));
            if !inside(places[0]) {
                sides[side][1] += 1;
                for k in 0..2 {
                    outside[side][k] += places[0][k];
                }
                continue;
            }
            let is = |at: [f32; 2], wanted: f32| (level(at) - wanted).abs() < SAME * contrast.abs();
            let is_ground = |at: [f32; 2]| is(at, ground);
            sides[side][2] +=
                usize::from(places.into_iter().filter(|at| inside(*at)).all(is_ground));
            if is(places[1], disc) && is_ground(along(here, beyond, 0.5)) {
                alike[side].push((beyond, ground, SAME * contrast.abs()));
            }
        }
    }
    for (([all, cut, ground], sum), alike) in sides.into_iter().zip(outside).zip(alike) {
        if needs_room && 2 * cut > all {
            let [x, y] = sum.map(|sum| sum / cut as f32);
            let (width, height) = (picture.width() as f32, picture.height() as f32);
            let ends = [
                (-x, Side::Left),
                (x - width, Side::Right),
                (-y, Side::Top),
                (y - height, Side::Bottom),
            ];
            let furthest = ends.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
            return Err(furthest.map(|(_, side)| side));
        }
        // Between circles there would be ground, too.
        let are_apart = |pair: &&[([f32; 2], f32, f32)]| {
            let [(one, ground, same), (other, ..)] = pair else { return false };
            let [x, y] = std::array::from_fn(|k| 0.5 * (one[k] + other[k]));
            (sample(picture, x, y) - ground).abs() < *same
        };
        let like = alike.windows(2).filter(are_apart).count();
        // A side without visible places doesn't show an end of the board.
        if 3 * like > all || (needs_ground && 3 * ground < all.max(1)) {
            return Err(None);
        }
    }
    Ok(())
}
