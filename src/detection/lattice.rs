//! A grid of corners by their place on the board.

use super::board_match::LARGEST_OVER;

/// Place in a grid: steps from the seed along the first and the second axis.
pub(super) type Node = (i32, i32);

/// The four next places.
pub(super) const BESIDE: [Node; 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

/// Corners by their place; the first axis turned by +90° (clockwise on the screen) points to the side of
/// the second, so that a grid is never a mirror image.
///
/// Holds places up to `reach` steps from the seed, and keeps its buffers when it is emptied.
#[derive(Clone, Debug, Default)]
pub(super) struct Lattice {
    reach: i32,
    /// Where the corner is, and how many came before it.
    places: Vec<Option<([f32; 2], u32)>>,
    /// Places that are taken, in the order in which they were.
    nodes: Vec<Node>,
}

impl Lattice {
    /// Empties the grid, for boards of up to `longest` corners a side.
    pub(super) fn clear(&mut self, longest: usize) {
        self.reach = longest as i32 + LARGEST_OVER;
        let side = (2 * self.reach + 1) as usize;
        self.places.clear();
        self.places.resize(side * side, None);
        self.nodes.clear();
        // Grids are exchanged; any of them may become the largest.
        self.nodes.reserve(side * side);
    }

    fn index(&self, (i, j): Node) -> Option<usize> {
        let reach = self.reach;
        let inside = i.abs() <= reach && j.abs() <= reach;
        inside.then(|| ((i + reach) * (2 * reach + 1) + j + reach) as usize)
    }

    pub(super) fn get(&self, node: Node) -> Option<[f32; 2]> {
        self.places[self.index(node)?].map(|(at, _)| at)
    }

    /// How many corners were put in before the one at `node`; meaningless once some were dropped.
    pub(super) fn order(&self, node: Node) -> Option<usize> {
        self.places[self.index(node)?].map(|(_, order)| order as usize)
    }

    pub(super) fn contains(&self, node: Node) -> bool {
        self.get(node).is_some()
    }

    /// Puts a corner at a free place; `false` if the place is taken or out of reach.
    pub(super) fn insert(&mut self, node: Node, at: [f32; 2]) -> bool {
        match self.index(node) {
            Some(index) if self.places[index].is_none() => {
                self.places[index] = Some((at, self.nodes.len() as u32));
                self.nodes.push(node);
                true
            }
            _ => false,
        }
    }

    /// Takes back what [`insert`](Self::insert) put last.
    pub(super) fn take_back(&mut self) {
        if let Some(index) = self.nodes.pop().and_then(|node| self.index(node)) {
            self.places[index] = None;
        }
    }

    pub(super) fn retain(&mut self, keep: impl Fn(&Self, Node) -> bool) {
        let mut nodes = std::mem::take(&mut self.nodes);
        nodes.retain(|&node| {
            let kept = keep(self, node);
            if let (false, Some(index)) = (kept, self.index(node)) {
                self.places[index] = None;
            }
            kept
        });
        self.nodes = nodes;
    }

    pub(super) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Lowest and highest place along both axes.
    pub(super) fn extent(&self) -> Option<(Node, Node)> {
        let first = *self.nodes.first()?;
        Some(self.nodes.iter().fold((first, first), |(low, high), &(i, j)| {
            ((low.0.min(i), low.1.min(j)), (high.0.max(i), high.1.max(j)))
        }))
    }

    /// Where the corner at `node` should be, and the length of the shortest step used: the mean of linear
    /// or parabolic continuations and completed parallelograms.
    pub(super) fn predict(&self, (i, j): Node) -> Option<([f32; 2], f32)> {
        let get = |di: i32, dj: i32| self.get((i + di, j + dj));
        let mut sum = [0.0_f32; 2];
        let mut weight = 0.0_f32;
        let mut side = f32::MAX;
        let mut add = |guess: [f32; 2], from: [f32; 2]| {
            sum = [sum[0] + guess[0], sum[1] + guess[1]];
            weight += 1.0;
            let (dx, dy) = (guess[0] - from[0], guess[1] - from[1]);
            side = side.min((dx * dx + dy * dy).sqrt());
        };
        for (di, dj) in BESIDE {
            let (Some(one), Some(two)) = (get(di, dj), get(2 * di, 2 * dj)) else { continue };
            match get(3 * di, 3 * dj) {
                // Perspective changes the steps; three members tell how.
                Some(three) => {
                    add(std::array::from_fn(|k| 3.0 * one[k] - 3.0 * two[k] + three[k]), one);
                }
                None => add(std::array::from_fn(|k| 2.0 * one[k] - two[k]), one),
            }
        }
        for (di, dj) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
            if let (Some(p), Some(q), Some(r)) = (get(di, 0), get(0, dj), get(di, dj)) {
                add(std::array::from_fn(|k| p[k] + q[k] - r[k]), p);
            }
        }
        (weight > 0.0 && side > 2.0).then(|| (sum.map(|value| value / weight), side))
    }
}
