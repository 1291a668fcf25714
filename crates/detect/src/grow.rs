//! Grows grids of junctions with alternating colours.

use super::{
    junction::{Junction, apart},
    lattice::{BESIDE, Lattice, Node},
    nearby::Nearby,
};

/// Longest side of a square, in pixels of the search level.
const REACH_PX: f32 = 240.0;

/// Limits of a grid for the board.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    /// Most corners in a row or column of the board.
    pub(super) longest: usize,
    /// Most corners.
    pub(super) largest: usize,
    /// Ratio of longer to shorter steps, 1 if all are equal.
    pub(super) longer: f32,
}

/// Grows grids from the junctions of a picture, strongest first. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct Grower {
    nearby: Nearby,
    /// True for each junction in a grid, and the last attempt to use each junction.
    taken: Vec<bool>,
    used_by: Vec<u32>,
    attempts: u32,
    next_seed: usize,
    members: Vec<u32>,
    frontier: Vec<Node>,
    added: Vec<(Node, u32)>,
}

impl Grower {
    /// Starts with the junctions of a new picture.
    pub(super) fn start(&mut self, junctions: &[Junction], width: u32, height: u32) {
        self.nearby.start(junctions.iter().map(|it| [it.x, it.y]), [width, height]);
        self.taken.clear();
        self.taken.resize(junctions.len(), false);
        self.used_by.clear();
        self.used_by.resize(junctions.len(), 0);
        (self.attempts, self.next_seed) = (0, 0);
    }

    /// Grows the next grid from the strongest unused junction; `None` after `seeds` attempts.
    pub(super) fn next_grid(
        &mut self,
        junctions: &[Junction],
        seeds: usize,
        Limits { longest, largest, longer }: Limits,
        into: &mut Lattice,
    ) -> Option<()> {
        while self.next_seed < junctions.len() && (self.attempts as usize) < seeds {
            let seed = self.next_seed;
            self.next_seed += 1;
            if self.taken[seed] {
                continue;
            }
            self.attempts += 1;
            into.clear(longest);
            into.steps.longer = longer;
            if self.grow(junctions, seed, largest, into) {
                for &index in &self.members {
                    self.taken[index as usize] = true;
                }
                return Some(());
            }
        }
        None
    }

    /// Nearest junction to `at` with edges close to the given edges.
    fn snap(
        &self,
        junctions: &[Junction],
        at: [f32; 2],
        radius_px: f32,
        edges_rad: [f32; 2],
    ) -> Option<usize> {
        self.nearby
            .near(at, radius_px)
            .filter(|(index, _)| fits(&junctions[*index], edges_rad))
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
            .map(|(index, _)| index)
    }

    /// Nearest neighbour of `from` within 20° of the direction `(cos, sin)`.
    fn step(&self, junctions: &[Junction], from: usize, towards: [f32; 2]) -> Option<usize> {
        let junction = &junctions[from];
        let [a, b] = junction.edges_rad;
        let mut radius_px = 32.0_f32;
        // Widening rings keep the search short for small squares.
        while radius_px <= REACH_PX {
            let found = self
                .nearby
                .near([junction.x, junction.y], radius_px)
                .filter(|&(index, distance)| {
                    let other = &junctions[index];
                    let (dx, dy) = (other.x - junction.x, other.y - junction.y);
                    index != from
                        && distance > 4.0
                        && dx * towards[0] + dy * towards[1] > 0.94 * distance
                        && fits(other, [b, a])
                        && other.contrast > 0.4 * junction.contrast
                })
                .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
            if let Some((index, _)) = found {
                return Some(index);
            }
            radius_px *= 2.0;
        }
        None
    }

    /// Start of the longer steps along both axes: at the seed (0) or after it (1). `None` without
    /// neighbours on both sides; equal distances count as 0.
    fn longer_from(
        &self,
        junctions: &[Junction],
        seed: usize,
        axes: [[f32; 2]; 2],
    ) -> Option<[i32; 2]> {
        let away_px = |towards: [f32; 2]| {
            let other = &junctions[self.step(junctions, seed, towards)?];
            Some(libm::hypotf(other.x - junctions[seed].x, other.y - junctions[seed].y))
        };
        let mut from = [0; 2];
        for (from, axis) in from.iter_mut().zip(axes) {
            let (ahead, behind) = (away_px(axis)?, away_px(axis.map(|v| -v))?);
            *from = i32::from(ahead < behind);
        }
        Some(from)
    }

    /// Grows a grid from a square of four junctions around `seed`, and sets `members` to the
    /// junctions.
    fn grow(
        &mut self,
        junctions: &[Junction],
        seed: usize,
        largest: usize,
        into: &mut Lattice,
    ) -> bool {
        let at = |index: usize| [junctions[index].x, junctions[index].y];
        let [a, b] = junctions[seed].edges_rad;
        let first = [libm::cosf(a), libm::sinf(a)];
        let mut second = [libm::cosf(b), libm::sinf(b)];
        if first[0] * second[1] - first[1] * second[0] < 0.0 {
            second = [-second[0], -second[1]];
        }
        if into.steps.longer > 1.0 {
            let Some(from) = self.longer_from(junctions, seed, [first, second]) else {
                return false;
            };
            into.steps.from = from;
        }
        let square = [(1, 1), (1, -1), (-1, 1), (-1, -1)].into_iter().find_map(|(i, j)| {
            let along = self.step(junctions, seed, first.map(|v| v * i as f32))?;
            let across = self.step(junctions, seed, second.map(|v| v * j as f32))?;
            let (p, q, r) = (at(seed), at(along), at(across));
            let far = [q[0] + r[0] - p[0], q[1] + r[1] - p[1]];
            let side =
                libm::hypotf(q[0] - p[0], q[1] - p[1]).min(libm::hypotf(r[0] - p[0], r[1] - p[1]));
            let opposite = self.snap(junctions, far, 0.4 * side, [a, b])?;
            Some([((0, 0), seed), ((i, 0), along), ((0, j), across), ((i, j), opposite)])
        });
        let Some(square) = square else { return false };
        self.members.clear();
        self.added.clear();
        self.added.extend(square.map(|(node, index)| (node, index as u32)));
        loop {
            for &(node, index) in &self.added {
                if into.insert(node, at(index as usize)) {
                    self.members.push(index);
                    self.used_by[index as usize] = self.attempts;
                }
            }
            if self.added.is_empty() || into.len() > largest {
                return true;
            }
            self.added.clear();
            // Free places next to members, in order.
            self.frontier.clear();
            for (i, j) in into.nodes() {
                let beside = BESIDE.map(|(di, dj)| (i + di, j + dj));
                self.frontier.extend(beside.iter().filter(|node| !into.contains(**node)));
            }
            self.frontier.sort_unstable();
            self.frontier.dedup();
            for &node in &self.frontier {
                let Some((guess, side)) = into.predict(node) else { continue };
                let Some(edges) = self.expected_edges(junctions, into, node) else { continue };
                let Some(index) = self.snap(junctions, guess, 0.33 * side, edges) else { continue };
                if self.used_by[index] != self.attempts {
                    self.used_by[index] = self.attempts;
                    self.added.push((node, index as u32));
                }
            }
        }
    }

    /// Expected edges at `node`: a neighbour's edges, exchanged like the colours.
    fn expected_edges(
        &self,
        junctions: &[Junction],
        lattice: &Lattice,
        (i, j): Node,
    ) -> Option<[f32; 2]> {
        let order = BESIDE.iter().find_map(|(di, dj)| lattice.order((i + di, j + dj)))?;
        let [a, b] = junctions[*self.members.get(order)? as usize].edges_rad;
        Some([b, a])
    }
}

fn fits(junction: &Junction, edges_rad: [f32; 2]) -> bool {
    apart(junction.edges_rad[0], edges_rad[0]) < 0.5
        && apart(junction.edges_rad[1], edges_rad[1]) < 0.5
}
