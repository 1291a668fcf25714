//! Independent streams of random numbers.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Random number stream of a scene, independent per purpose.
#[derive(Clone, Copy, Debug)]
pub(super) enum RngStream {
    Lens,
    Backdrop,
    Noise,
    Technician,
    Attention,
    Manner,
    Habits,
    Covers,
}

impl RngStream {
    /// Random number generator of the stream.
    pub(super) fn rng(self, seed: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(match self {
            Self::Lens => 1,
            Self::Backdrop => 2,
            Self::Noise => 3,
            Self::Technician => 4,
            Self::Attention => 5,
            Self::Manner => 6,
            Self::Habits => 7,
            Self::Covers => 8,
        });
        rng
    }
}
