//! The sheet at several poses during an exposure, laid out so that a pixel meets all of them at
//! once.

use super::{
    bend::BentView,
    sheet_view::{PixelRay, SheetView, Spot},
};

/// Number of views computed at once: two registers of four numbers.
const LANES: usize = 8;

/// 3 × 3 matrix of each view.
type Matrices = [[[f32; LANES]; 3]; 3];

/// Sheet as seen during the exposure of a row.
pub(super) struct Exposure {
    count: usize,
    groups: Vec<Group>,
}

/// Up to [`LANES`] views; the last one fills the rest. They differ only in these matrices.
struct Group {
    first: SheetView,
    rows: Matrices,
    /// Axes of a bent board.
    axes: Matrices,
}

/// A pixel's [`Spot`] in each view.
#[derive(Default)]
struct Spots {
    depth: [f32; LANES],
    at: [[f32; LANES]; 2],
    by_x: [[f32; LANES]; 2],
    by_y: [[f32; LANES]; 2],
}

impl Exposure {
    pub(super) fn of(views: &[SheetView]) -> Self {
        Self { count: views.len(), groups: views.chunks(LANES).map(Group::of).collect() }
    }

    pub(super) fn view_count(&self) -> usize {
        self.count
    }

    /// Positions of `pixel` on the sheet in each view, in order.
    #[inline]
    pub(super) fn for_each_spot(&self, pixel: &PixelRay, mut take: impl FnMut(usize, &Spot)) {
        for (group, first) in self.groups.iter().zip((0..self.count).step_by(LANES)) {
            if first + 1 == self.count {
                take(first, &group.first.spot(pixel));
                continue;
            }
            let spots = group.spots(pixel);
            for lane in 0..LANES.min(self.count - first) {
                take(first + lane, &spots.of_view(lane));
            }
        }
    }
}

impl Group {
    fn of(views: &[SheetView]) -> Self {
        let view = |lane: usize| &views[lane.min(views.len() - 1)];
        let matrices = |of: &dyn Fn(&SheetView, usize, usize) -> f32| -> Matrices {
            let lanes = |i, j| std::array::from_fn(|lane| of(view(lane), i, j));
            std::array::from_fn(|i| std::array::from_fn(|j| lanes(i, j)))
        };
        let axis = |view: &SheetView, i: usize, j: usize| {
            view.bent.map_or(0.0, |(_, BentView { axes, .. })| axes[i][j])
        };
        let rows = matrices(&|view, i, j| view.rows[i][j]);
        Self { first: views[0], rows, axes: matrices(&axis) }
    }

    #[inline(never)]
    fn spots(&self, pixel: &PixelRay) -> Spots {
        // Everything common to all views is decided outside of the loops, so that they become
        // vector instructions.
        let rows = |lane| of_lane(&self.rows, lane);
        match self.first.bent {
            None => spots(|lane| SheetView { rows: rows(lane), bent: None }, pixel),
            Some((middle, view)) => spots(
                |lane| {
                    let view = BentView { axes: of_lane(&self.axes, lane), ..view };
                    SheetView { rows: rows(lane), bent: Some((middle, view)) }
                },
                pixel,
            ),
        }
    }
}

#[inline(always)]
fn of_lane(from: &Matrices, lane: usize) -> [[f32; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| from[i][j][lane]))
}

#[inline(always)]
fn spots(view: impl Fn(usize) -> SheetView, pixel: &PixelRay) -> Spots {
    let mut spots = Spots::default();
    for lane in 0..LANES {
        let spot = view(lane).spot(pixel);
        spots.depth[lane] = spot.depth;
        spots.at[0][lane] = spot.u;
        spots.at[1][lane] = spot.v;
        for axis in 0..2 {
            spots.by_x[axis][lane] = spot.by_x[axis];
            spots.by_y[axis][lane] = spot.by_y[axis];
        }
    }
    spots
}

impl Spots {
    #[inline]
    fn of_view(&self, lane: usize) -> Spot {
        let pair = |from: &[[f32; LANES]; 2]| [from[0][lane], from[1][lane]];
        let [u, v] = pair(&self.at);
        let (by_x, by_y) = (pair(&self.by_x), pair(&self.by_y));
        Spot { depth: self.depth[lane], u, v, by_x, by_y }
    }
}
