//! Selects the vector width at run time.

/// Plain loop that gains from wide vectors.
///
/// A function in the loop without `#[inline(always)]`, `run` included, is compiled for the baseline
/// processor. Hence the trait: closures can't be marked.
pub trait Loop {
    type Output;

    fn run(self) -> Self::Output;
}

/// Runs `work`, compiled for the widest vectors of the processor.
///
/// The compiler neither fuses nor reorders floating-point operations, so every width gives
/// identical results.
pub fn widest<W: Loop>(work: W) -> W::Output {
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
