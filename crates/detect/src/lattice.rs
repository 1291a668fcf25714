//! Grid of corners by place on the board.

/// Position in a grid: steps from the seed along the first and the second axis.
pub(super) type Node = (i32, i32);

/// Largest excess of a grid over the board's longer side, in steps, to recognise a larger board.
const LARGEST_OVER: i32 = 6;
/// The four neighbouring nodes.
pub(super) const BESIDE: [Node; 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

/// Lengths of the steps between neighbouring nodes, in shorter steps: all are 1 on a checkerboard;
/// on an AprilGrid every second one is longer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steps {
    pub(super) longer: f32,
    /// Origin of the longer steps along both axes: even nodes (0) or odd nodes (1).
    pub(super) from: [i32; 2],
}

impl Default for Steps {
    fn default() -> Self {
        Self { longer: 1.0, from: [0, 0] }
    }
}

impl Steps {
    /// Distance along an axis from a node to the node `steps` further.
    pub(super) fn between(&self, axis: usize, from: i32, steps: i32) -> f32 {
        if self.longer == 1.0 {
            return steps as f32;
        }
        self.at(axis, from + steps) - self.at(axis, from)
    }

    fn at(&self, axis: usize, node: i32) -> f32 {
        let node = node - self.from[axis];
        node.div_euclid(2) as f32 * (1.0 + self.longer) + node.rem_euclid(2) as f32 * self.longer
    }

    /// True if the step from a node along an axis is longer, or all steps are equal.
    pub(super) fn is_longer(&self, axis: usize, from: i32) -> bool {
        self.longer == 1.0 || (from - self.from[axis]).rem_euclid(2) == 0
    }
}

/// Corners by node. Turning the first axis by +90° (clockwise on the screen) points to the side of
/// the second, so a grid is never a mirror image.
///
/// Holds nodes up to `reach` steps from the seed, and keeps its buffers when cleared.
#[derive(Clone, Debug, Default)]
pub(super) struct Lattice {
    reach: i32,
    pub(super) steps: Steps,
    /// Position of the corner, and number of earlier insertions.
    places: Vec<Option<([f32; 2], u32)>>,
    /// Occupied nodes, in order of insertion.
    nodes: Vec<Node>,
}

impl Lattice {
    /// Clears the grid and sizes it for boards of up to `longest` corners a side, with equal steps.
    pub(super) fn clear(&mut self, longest: usize) {
        self.steps = Steps::default();
        self.retain(|_, _| false);
        self.reach = longest as i32 + LARGEST_OVER;
        let side = (2 * self.reach + 1) as usize;
        self.places.resize(side * side, None);
        // Grids are swapped; any grid may become the largest.
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

    /// Number of corners inserted before the corner at `node`; meaningless after
    /// [`retain`](Self::retain).
    pub(super) fn order(&self, node: Node) -> Option<usize> {
        self.places[self.index(node)?].map(|(_, order)| order as usize)
    }

    pub(super) fn contains(&self, node: Node) -> bool {
        self.get(node).is_some()
    }

    /// Inserts a corner at a free node; returns `false` if the node is taken or out of reach.
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

    /// Undoes the last [`insert`](Self::insert).
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

    /// Writes the corners to `into`, in order of insertion.
    pub(super) fn write(&self, into: &mut Vec<[f32; 2]>) {
        into.clear();
        into.extend(self.nodes.iter().filter_map(|node| self.get(*node)));
    }

    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// True if a node of the grid lies at the largest distance for growing.
    pub(super) fn is_at_reach(&self) -> bool {
        self.nodes.iter().any(|(i, j)| i.abs().max(j.abs()) >= self.reach)
    }

    /// True if the grid has all nodes of its extent.
    pub(super) fn is_full(&self) -> bool {
        self.len() > 0 && self.len() == self.size().iter().product()
    }

    /// Number of nodes from end to end along both axes.
    pub(super) fn size(&self) -> [usize; 2] {
        self.extent().map_or([0; 2], |(low, high)| {
            [high.0 - low.0, high.1 - low.1].map(|span| span as usize + 1)
        })
    }

    /// Lowest and highest node along both axes; `None` if the grid is empty.
    pub(super) fn extent(&self) -> Option<(Node, Node)> {
        let first = *self.nodes.first()?;
        Some(self.nodes.iter().fold((first, first), |(low, high), &(i, j)| {
            ((low.0.min(i), low.1.min(j)), (high.0.max(i), high.1.max(j)))
        }))
    }

    /// Mean width of a square with sides of a shorter step, across the narrower side; NaN without
    /// squares.
    pub(super) fn mean_height(&self) -> f64 {
        self.mean(height)
    }

    /// Mean length of the squares' longer sides.
    pub(super) fn mean_length(&self) -> f64 {
        self.mean(|(u, v)| libm::hypotf(u[0], u[1]).max(libm::hypotf(v[0], v[1])))
    }

    /// Mean of `size` over the steps along both axes.
    fn mean(&self, size: impl Fn(([f32; 2], [f32; 2])) -> f32) -> f64 {
        let size = |node: &Node| Some(size(axes(self, *node, self.get(*node)?)?));
        let sizes = || self.nodes.iter().filter_map(&size);
        f64::from(sizes().sum::<f32>()) / sizes().count() as f64
    }

    /// Predicts the position of the corner at `node`, and the length of the shortest step used: the
    /// mean of linear or parabolic extrapolations and completed parallelograms.
    pub(super) fn predict(&self, (i, j): Node) -> Option<([f32; 2], f32)> {
        let get = |di: i32, dj: i32| self.get((i + di, j + dj));
        let mut sum = [0.0_f32; 2];
        let mut weight = 0.0_f32;
        let mut side = f32::MAX;
        // Guesses count alike with equal steps, less for a longer step guessed from shorter ones.
        let mut add = |guess: [f32; 2], from: [f32; 2], share: f32| {
            sum = [sum[0] + share * guess[0], sum[1] + share * guess[1]];
            weight += share;
            let (dx, dy) = (guess[0] - from[0], guess[1] - from[1]);
            side = side.min((dx * dx + dy * dy).sqrt());
        };
        for (di, dj) in BESIDE {
            let (Some(one), Some(two)) = (get(di, dj), get(2 * di, 2 * dj)) else { continue };
            let (axis, from) = if dj == 0 { (0, i) } else { (1, j) };
            let at = |steps: i32| self.steps.between(axis, from, steps * (di + dj));
            match get(3 * di, 3 * dj) {
                // Perspective changes the length of steps; three members show the change.
                Some(three) => {
                    let [a, b, c] = extrapolating([at(1), at(2), at(3)]);
                    let guess = std::array::from_fn(|k| a * one[k] + b * two[k] + c * three[k]);
                    add(guess, one, 19.0 / (a * a + b * b + c * c));
                }
                None => {
                    let (a, b) = (at(2) / (at(2) - at(1)), at(1) / (at(1) - at(2)));
                    add(
                        std::array::from_fn(|k| a * one[k] + b * two[k]),
                        one,
                        5.0 / (a * a + b * b),
                    );
                }
            }
        }
        for (di, dj) in [(1, 1), (1, -1), (-1, 1), (-1, -1)] {
            if let (Some(p), Some(q), Some(r)) = (get(di, 0), get(0, dj), get(di, dj)) {
                add(std::array::from_fn(|k| p[k] + q[k] - r[k]), p, 1.0);
            }
        }
        (weight > 0.0 && side > 2.0).then(|| (sum.map(|value| value / weight), side))
    }
}

/// True if a node is among the last ones, in the direction `out`, of those from `low` to `high`.
pub(super) fn is_at_end((low, high): (Node, Node), out: Node, (i, j): Node) -> bool {
    match out {
        (-1, _) => i == low.0,
        (1, _) => i == high.0,
        (_, -1) => j == low.1,
        _ => j == high.1,
    }
}

/// Weights of the values at three places for a parabola's value at 0.
fn extrapolating([a, b, c]: [f32; 3]) -> [f32; 3] {
    [b * c / ((a - b) * (a - c)), a * c / ((b - a) * (b - c)), a * b / ((c - a) * (c - b))]
}

/// Shorter steps along both axes at a node, from the existing neighbours; `here` is the position of
/// the node's corner, known or predicted.
pub(super) fn axes(
    lattice: &Lattice,
    (i, j): Node,
    here: [f32; 2],
) -> Option<([f32; 2], [f32; 2])> {
    let step = |(i, j): Node, here: Option<[f32; 2]>, di: i32, dj: i32| {
        let ahead = lattice.get((i + di, j + dj));
        let behind = lattice.get((i - di, j - dj));
        let (axis, from) = if dj == 0 { (0, i) } else { (1, j) };
        let (from, to, steps) = match (ahead, here, behind) {
            (Some(a), _, Some(b)) => (b, a, lattice.steps.between(axis, from - 1, 2)),
            (Some(a), Some(here), None) => (here, a, lattice.steps.between(axis, from, 1)),
            (None, Some(here), Some(b)) => (b, here, lattice.steps.between(axis, from - 1, 1)),
            _ => return None,
        };
        let share = 1.0 / steps;
        Some([share * (to[0] - from[0]), share * (to[1] - from[1])])
    };
    // The first corner of a new row has no neighbour in it; the previous row has the same
    // direction.
    let side = |di: i32, dj: i32| {
        let next = |(i, j): Node| step((i, j), lattice.get((i, j)), di, dj);
        step((i, j), Some(here), di, dj)
            .or_else(|| next((i + dj, j + di)))
            .or_else(|| next((i - dj, j - di)))
    };
    Some((side(1, 0)?, side(0, 1)?))
}

/// Smallest width of the parallelogram spanned by `u` and `v`: the width of a sheared square.
pub(super) fn height((u, v): ([f32; 2], [f32; 2])) -> f32 {
    let longest = libm::hypotf(u[0], u[1]).max(libm::hypotf(v[0], v[1]));
    (u[0] * v[1] - u[1] * v[0]).abs() / longest.max(1e-6)
}
