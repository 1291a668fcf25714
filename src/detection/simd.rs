//! Vector widths, chosen when the program runs.

/// A plain loop that is worth the widest vectors.
///
/// `run` and all that it calls must be `#[inline(always)]`, or it is compiled for the least processor; a
/// closure cannot promise that.
pub(super) trait Loop {
    /// What the loop returns.
    type Output;

    /// The loop.
    fn run(self) -> Self::Output;
}

/// Runs `work` compiled for the widest vectors that this processor has.
///
/// The compiler neither fuses nor reorders floating-point operations, so that every width gives the same
/// bits.
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
