//! Guard around sources of third-party code, which may panic on hostile files and devices.

use std::time::Duration;

use super::{Arrival, CaptureError, FrameSource, SourceIdentity};
use boresight_geometry::{
    device::{Adjustable, CameraInfo, Control, ControlBefore},
    panic_message::caught,
};

/// Opens the source `name` behind a guard: a panic, now or later, is an error of this source.
///
/// # Errors
///
/// Those of `open`, and [`CaptureError::GaveUp`] after a panic.
pub fn guarded<E: From<CaptureError>>(
    name: &str,
    open: impl FnOnce() -> Result<Box<dyn FrameSource>, E>,
) -> Result<Box<dyn FrameSource>, E> {
    let name = name.to_owned();
    match caught(open) {
        Ok(source) => Ok(Box::new(Guarded { name, source: Some(source?), panic: None })),
        Err(reason) => Err(CaptureError::GaveUp { reason, name }.into()),
    }
}

struct Guarded {
    name: String,
    /// `None` after a panic, which may leave the source in any state.
    source: Option<Box<dyn FrameSource>>,
    /// Message of the panic, until reported.
    panic: Option<String>,
}

impl Guarded {
    /// Result of the `call`; `otherwise` in case of a panic, now or earlier.
    fn call<T>(&mut self, otherwise: T, call: impl FnOnce(&mut dyn FrameSource) -> T) -> T {
        let Some(source) = &mut self.source else { return otherwise };
        caught(|| call(&mut **source)).unwrap_or_else(|panic| {
            self.panic = Some(panic);
            self.end();
            otherwise
        })
    }

    fn end(&mut self) {
        let source = self.source.take();
        caught(|| drop(source)).ok();
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        self.end();
    }
}

impl FrameSource for Guarded {
    fn identity(&self) -> SourceIdentity {
        let known = self.source.as_ref().and_then(|source| caught(|| source.identity()).ok());
        known.unwrap_or_else(|| SourceIdentity { name: self.name.clone(), image_size: None })
    }

    fn waits(&self) -> bool {
        self.source.as_ref().is_none_or(|source| caught(|| source.waits()).unwrap_or(true))
    }

    fn camera_facts(&self) -> Option<CameraInfo> {
        self.source.as_ref().and_then(|source| caught(|| source.camera_facts()).ok())?
    }

    fn adjustables(&mut self) -> Vec<Adjustable> {
        self.call(Vec::new(), |source| source.adjustables())
    }

    fn adjust(&mut self, control: Control, value: i64) {
        self.call((), |source| source.adjust(control, value));
    }

    fn put_back_at_end(&mut self, before: &[ControlBefore]) {
        self.call((), |source| source.put_back_at_end(before));
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        let next = self.call(Ok(Arrival::End), |source| source.next_frame(patience));
        match self.panic.take() {
            Some(reason) => Err(CaptureError::GaveUp { reason, name: self.name.clone() }),
            None => next,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Source that panics at its second picture, and again when dropped.
    struct Hostile(u32);

    impl FrameSource for Hostile {
        fn identity(&self) -> SourceIdentity {
            SourceIdentity { name: "hostile".into(), image_size: None }
        }

        fn next_frame(&mut self, _patience: Duration) -> Result<Arrival, CaptureError> {
            self.0 += 1;
            assert!(self.0 < 2, "its bytes");
            Ok(Arrival::NothingYet)
        }
    }

    impl Drop for Hostile {
        fn drop(&mut self) {
            assert!(self.0 < 2, "its memory");
        }
    }

    #[test]
    fn a_panic_ends_a_source_with_an_error_and_nothing_else() {
        let open = || Ok::<_, CaptureError>(Box::new(Hostile(0)) as Box<dyn FrameSource>);
        let mut source = guarded("a.bag", open).expect("opens");
        assert!(matches!(source.next_frame(Duration::ZERO), Ok(Arrival::NothingYet)));
        let gave_up = source.next_frame(Duration::ZERO).expect_err("a panic");
        assert!(gave_up.to_string().contains("its bytes"), "{gave_up}");
        assert!(matches!(source.next_frame(Duration::ZERO), Ok(Arrival::End)));
        assert_eq!(source.identity().name, "a.bag");
        let refused = guarded("b.bag", || -> Result<_, CaptureError> { panic!("at once") });
        assert!(matches!(refused, Err(CaptureError::GaveUp { name, .. }) if name == "b.bag"));
    }
}
