use nalgebra::Vector2;

use crate::{
    Params,
    explore::{Boards, ExploreSetup, Seen, look},
    setup::Setup,
};

/// Settings and result of the exploration.
#[derive(Clone, Debug)]
pub struct Explored {
    pub(super) wish: ExploreSetup,
    pub(super) seen: Seen,
}

impl Default for Explored {
    fn default() -> Self {
        let wish = ExploreSetup {
            setup: Setup::of(&Params::default()),
            slot_rad: 0.0,
            shift_m: Vector2::new(0.05, 0.0),
            boards: Boards::One,
            skipped: 0,
        };
        Self { seen: look(&wish), wish }
    }
}

impl Explored {
    /// Current drawing with its numbers.
    pub fn seen(&self) -> &Seen {
        &self.seen
    }

    /// Changes the exploration's settings.
    pub fn change(&mut self, change: impl FnOnce(&mut ExploreSetup)) {
        change(&mut self.wish);
        self.seen = look(&self.wish);
    }
}
