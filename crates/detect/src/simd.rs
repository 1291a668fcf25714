//! Selects the vector width at run time, and sums products lane by lane.

/// Plain loop that gains from wide vectors.
///
/// `run` and everything it calls must be `#[inline(always)]`, or it's compiled for the baseline
/// processor. Hence the trait: closures can't be marked.
pub(super) trait Loop {
    type Output;

    fn run(self) -> Self::Output;
}

/// Runs `work`, compiled for the widest vectors of the processor.
///
/// The compiler neither fuses nor reorders floating-point operations, so every width gives
/// identical results.
pub(super) fn widest<W: Loop>(work: W) -> W::Output {
    pulp::Arch::new().dispatch(Widened(work))
}

struct Widened<W>(W);

impl<W: Loop> pulp::WithSimd for Widened<W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> W::Output {
        self.0.run()
    }
}

/// Fixed number of accumulators, so that results don't depend on the vector width.
pub(super) const LANES: usize = 8;
/// Pixels processed together, so that the derivatives stay in the first-level cache.
pub(super) const CHUNK: usize = 16 * LANES;
pub(super) type Lanes = [f32; LANES];
/// Values of a chunk, in whole lines of the cache.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
pub(super) struct Row(pub(super) [Lanes; CHUNK / LANES]);

/// Adds the products of each of the `ones` and the `others`, of `count` pixels, lane by lane.
#[inline(always)]
#[expect(clippy::needless_range_loop, reason = "iterators keep no sums in registers: 3 x the time")]
pub(super) fn add_products<const I: usize, const J: usize>(
    ones: &[Row; I],
    others: &[Row; J],
    count: usize,
    sums: &mut [[Lanes; J]; I],
) {
    let mut totals = *sums;
    for at in 0..(count / LANES).min(CHUNK / LANES) {
        for i in 0..I {
            for j in 0..J {
                for lane in 0..LANES {
                    totals[i][j][lane] += ones[i].0[at][lane] * others[j].0[at][lane];
                }
            }
        }
    }
    *sums = totals;
}

pub(super) fn total(lanes: Lanes) -> f64 {
    lanes.iter().fold(0.0, |total, lane| total + f64::from(*lane))
}
