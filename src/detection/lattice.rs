//! Grows grids of junctions whose colours alternate.

use std::collections::BTreeMap;

use super::junction::{Junction, apart};

/// Place in a grid.
pub(super) type Node = (i32, i32);

/// Junctions by their place in a grid; the first axis turned by +90° (clockwise on the screen) points to
/// the side of the second, so that a grid is never a mirror image.
pub(super) type Lattice = BTreeMap<Node, [f32; 2]>;

/// Junctions sorted into square cells, for finding the nearest one.
pub(super) struct Neighbourhood<'a> {
    junctions: &'a [Junction],
    cells: Vec<Vec<u32>>,
    columns: usize,
    rows: usize,
}

const CELL_PX: f32 = 24.0;
/// Longest side of a square that is looked for, in pixels of the search level.
const REACH_PX: f32 = 240.0;

impl<'a> Neighbourhood<'a> {
    pub(super) fn new(junctions: &'a [Junction], width: u32, height: u32) -> Self {
        let columns = (width as f32 / CELL_PX) as usize + 1;
        let rows = (height as f32 / CELL_PX) as usize + 1;
        let mut cells = vec![Vec::new(); columns * rows];
        for (index, junction) in junctions.iter().enumerate() {
            let (column, row) = ((junction.x / CELL_PX) as usize, (junction.y / CELL_PX) as usize);
            cells[row.min(rows - 1) * columns + column.min(columns - 1)].push(index as u32);
        }
        Self { junctions, cells, columns, rows }
    }

    /// Junctions within `radius_px` of a place.
    fn near(&self, at: [f32; 2], radius_px: f32) -> impl Iterator<Item = (usize, f32)> + '_ {
        let cell = |value: f32, count: usize| ((value / CELL_PX).max(0.0) as usize).min(count - 1);
        let columns = cell(at[0] - radius_px, self.columns)..=cell(at[0] + radius_px, self.columns);
        let rows = cell(at[1] - radius_px, self.rows)..=cell(at[1] + radius_px, self.rows);
        rows.flat_map(move |row| columns.clone().map(move |column| (row, column)))
            .flat_map(|(row, column)| &self.cells[row * self.columns + column])
            .filter_map(move |&index| {
                let junction = &self.junctions[index as usize];
                let distance = (junction.x - at[0]).hypot(junction.y - at[1]);
                (distance <= radius_px).then_some((index as usize, distance))
            })
    }

    /// The nearest junction to `at` that could be a neighbour with the given edges.
    fn snap(&self, at: [f32; 2], radius_px: f32, edges_rad: [f32; 2]) -> Option<usize> {
        self.near(at, radius_px)
            .filter(|(index, _)| fits(&self.junctions[*index], edges_rad))
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
            .map(|(index, _)| index)
    }

    /// The neighbour of `from` in direction `(sin, cos)`: the nearest one within 20° of it.
    fn step(&self, from: usize, towards: [f32; 2]) -> Option<usize> {
        let junction = &self.junctions[from];
        let [a, b] = junction.edges_rad;
        let mut radius_px = 32.0_f32;
        // Widening rings, so that the search stays short for small squares.
        while radius_px <= REACH_PX {
            let found = self
                .near([junction.x, junction.y], radius_px)
                .filter(|&(index, distance)| {
                    let other = &self.junctions[index];
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
}

fn fits(junction: &Junction, edges_rad: [f32; 2]) -> bool {
    apart(junction.edges_rad[0], edges_rad[0]) < 0.5
        && apart(junction.edges_rad[1], edges_rad[1]) < 0.5
}

/// Grids grown from the strongest junctions that are in no earlier grid, largest first.
pub(super) fn grow_all(near: &Neighbourhood<'_>, seeds: usize, largest: usize) -> Vec<Lattice> {
    let mut taken = vec![false; near.junctions.len()];
    let mut lattices = Vec::new();
    let mut tried = 0;
    for seed in 0..near.junctions.len() {
        if taken[seed] {
            continue;
        }
        tried += 1;
        if tried > seeds {
            break;
        }
        let Some(members) = grow(near, seed, largest) else { continue };
        for &index in members.values() {
            taken[index] = true;
        }
        if members.len() >= 6 {
            let at = |index: usize| [near.junctions[index].x, near.junctions[index].y];
            lattices.push(members.iter().map(|(node, index)| (*node, at(*index))).collect());
        }
    }
    lattices.sort_by_key(|lattice: &Lattice| std::cmp::Reverse(lattice.len()));
    lattices
}

/// Grows a grid from a square of four junctions around `seed`.
fn grow(near: &Neighbourhood<'_>, seed: usize, largest: usize) -> Option<BTreeMap<Node, usize>> {
    let at = |index: usize| [near.junctions[index].x, near.junctions[index].y];
    let [a, b] = near.junctions[seed].edges_rad;
    let first = [a.cos(), a.sin()];
    let mut second = [b.cos(), b.sin()];
    if first[0] * second[1] - first[1] * second[0] < 0.0 {
        second = [-second[0], -second[1]];
    }
    let mut members = BTreeMap::new();
    let square = [(1, 1), (1, -1), (-1, 1), (-1, -1)].into_iter().find_map(|(i, j)| {
        let along = near.step(seed, first.map(|v| v * i as f32))?;
        let across = near.step(seed, second.map(|v| v * j as f32))?;
        let (p, q, r) = (at(seed), at(along), at(across));
        let far = [q[0] + r[0] - p[0], q[1] + r[1] - p[1]];
        let side = (q[0] - p[0]).hypot(q[1] - p[1]).min((r[0] - p[0]).hypot(r[1] - p[1]));
        let opposite = near.snap(far, 0.4 * side, [a, b])?;
        Some([((0, 0), seed), ((i, 0), along), ((0, j), across), ((i, j), opposite)])
    })?;
    members.extend(square);
    let mut used: std::collections::BTreeSet<usize> = members.values().copied().collect();
    loop {
        let mut added = Vec::new();
        for node in frontier(&members) {
            let Some((guess, side)) = predict(&members, node, &at) else { continue };
            let edges = local_edges(near, &members, node);
            let Some(index) = near.snap(guess, 0.33 * side, edges) else { continue };
            if used.insert(index) {
                added.push((node, index));
            }
        }
        if added.is_empty() || members.len() > largest {
            return Some(members);
        }
        members.extend(added);
    }
}

/// Free places next to members, in order.
fn frontier(members: &BTreeMap<Node, usize>) -> std::collections::BTreeSet<Node> {
    members
        .keys()
        .flat_map(|&(i, j)| [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)])
        .filter(|node| !members.contains_key(node))
        .collect()
}

/// Edges expected at `node`: those of its nearest member, exchanged if the colours are.
fn local_edges(near: &Neighbourhood<'_>, members: &BTreeMap<Node, usize>, node: Node) -> [f32; 2] {
    let (i, j) = node;
    for (di, dj) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
        if let Some(&index) = members.get(&(i + di, j + dj)) {
            let [a, b] = near.junctions[index].edges_rad;
            return [b, a];
        }
    }
    [0.0, 0.0]
}

/// Where the junction at `node` should be, and the length of the shortest step used: the mean of linear
/// continuations and completed parallelograms.
pub(super) fn predict<T: Copy>(
    members: &BTreeMap<Node, T>,
    (i, j): Node,
    at: &impl Fn(T) -> [f32; 2],
) -> Option<([f32; 2], f32)> {
    let get = |di: i32, dj: i32| members.get(&(i + di, j + dj)).map(|&member| at(member));
    let mut sum = [0.0_f32; 2];
    let mut weight = 0.0_f32;
    let mut side = f32::MAX;
    let mut add = |guess: [f32; 2], from: [f32; 2], w: f32| {
        sum = [sum[0] + w * guess[0], sum[1] + w * guess[1]];
        weight += w;
        side = side.min((guess[0] - from[0]).hypot(guess[1] - from[1]));
    };
    for (di, dj) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
        let (Some(one), Some(two)) = (get(di, dj), get(2 * di, 2 * dj)) else { continue };
        match get(3 * di, 3 * dj) {
            // Perspective changes the steps; three members tell how.
            Some(three) => {
                let guess = std::array::from_fn(|k| 3.0 * one[k] - 3.0 * two[k] + three[k]);
                add(guess, one, 1.0);
            }
            None => add(std::array::from_fn(|k| 2.0 * one[k] - two[k]), one, 1.0),
        }
    }
    for (di, dj) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
        if let (Some(p), Some(q), Some(r)) = (get(di, 0), get(0, dj), get(di, dj)) {
            add(std::array::from_fn(|k| p[k] + q[k] - r[k]), p, 1.0);
        }
    }
    (weight > 0.0 && side > 2.0).then(|| (sum.map(|value| value / weight), side))
}
