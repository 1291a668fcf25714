//! The scene behind the board as a witness of the focal length: what stands still keeps its scale.

use super::kinds::MAX_CHANGE;
use boresight_geometry::frame::SceneScale;

/// Standard deviations of what the scene leaves open.
const SIGMAS: f64 = 4.0;
/// Share of an alleged change below which the scene's own change vetoes the cause, and above which
/// it may confirm it.
const VETOED: f64 = 1.0 / 3.0;
/// Least number of usable views on each side of a change.
const LEAST_EACH: usize = 2;

/// Testimony of the scene about a change of the focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Testimony {
    /// Too few usable pictures, or nothing clear.
    Silent,
    /// The scene clearly changed its scale in the same direction.
    Confirmed,
    /// The scene kept its scale.
    Vetoed {
        /// Largest relative change that the scene allows, per unit of the course.
        allowed: f64,
    },
}

/// Cause that the views suggested and the scene vetoed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vetoed {
    /// Relative change of the focal length that the views suggested.
    pub(super) change: f64,
    /// Largest relative change that the scene allows.
    pub(super) allowed: f64,
}

/// Testimony of `scene`, view by view, about a log focal length of `size` times `course`; about one
/// that scatters by `size` from view to view, if `course` is empty.
pub(super) fn testimony(scene: &[Option<SceneScale>], size: f64, course: &[f64]) -> Testimony {
    let usable: Vec<(usize, SceneScale)> =
        scene.iter().enumerate().filter_map(|(view, scale)| Some((view, (*scale)?))).collect();
    let found = if course.is_empty() { scatter(&usable) } else { slope(&usable, course) };
    let Some((own, sd)) = found else { return Testimony::Silent };
    let least = VETOED * size.abs();
    let (allowed, is_alike) = (own.abs() + SIGMAS * sd, own * size > 0.0);
    if allowed < least.min(MAX_CHANGE) {
        Testimony::Vetoed { allowed }
    } else if is_alike && own.abs() > least.max(SIGMAS * sd) {
        Testimony::Confirmed
    } else {
        Testimony::Silent
    }
}

/// Scatter of the scene's log scale about its mean, with its standard deviation. `None` for few
/// views.
fn scatter(usable: &[(usize, SceneScale)]) -> Option<(f64, f64)> {
    let count = usable.len() as f64;
    let rms = |of: &dyn Fn(&SceneScale) -> f64| {
        (usable.iter().map(|(_, scale)| of(scale).powi(2)).sum::<f64>() / count).sqrt()
    };
    let mean = usable.iter().map(|(_, scale)| scale.log_focal).sum::<f64>() / count;
    (usable.len() > 2 * LEAST_EACH)
        .then(|| (rms(&|scale| scale.log_focal - mean), rms(&|scale| scale.sd) / count.sqrt()))
}

/// Slope of the scene's log scale over `course` by the best straight line, with its standard
/// deviation. `None` if few views lie on one side of the course's middle.
fn slope(usable: &[(usize, SceneScale)], course: &[f64]) -> Option<(f64, f64)> {
    let least = course.iter().copied().reduce(f64::min)?;
    let middle = 0.5 * (least + course.iter().copied().reduce(f64::max)?);
    let at = |view: usize| course.get(view).copied().unwrap_or_default();
    let after = usable.iter().filter(|(view, _)| at(*view) > middle).count();
    if after < LEAST_EACH || usable.len() - after < LEAST_EACH {
        return None;
    }
    let mean = usable.iter().map(|(view, _)| at(*view)).sum::<f64>() / usable.len() as f64;
    let (mut along, mut across, mut variance) = (0.0, 0.0, 0.0);
    for (view, scale) in usable {
        let off = at(*view) - mean;
        along += off * off;
        across += off * scale.log_focal;
        variance += (off * scale.sd).powi(2);
    }
    Some((across / along, variance.sqrt() / along))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(of: impl Fn(usize) -> Option<f64>) -> Vec<Option<SceneScale>> {
        (0..12).map(|view| Some(SceneScale { log_focal: of(view)?, sd: 4e-4 })).collect()
    }

    fn jump() -> Vec<f64> {
        (0..12).map(|view| if view < 6 { 0.0 } else { 1.0 }).collect()
    }

    #[test]
    fn a_scene_that_keeps_its_scale_vetoes_a_moved_focus() {
        let still = scene(|view| Some(1e-4 * (view % 3) as f64));
        for course in [jump(), Vec::new()] {
            let said = testimony(&still, -0.011, &course);
            assert!(matches!(said, Testimony::Vetoed { allowed } if allowed < 2e-3), "{said:?}");
        }
        // A change below what it can see.
        assert_eq!(testimony(&still, 0.001, &jump()), Testimony::Silent);
    }

    #[test]
    fn a_scene_that_follows_confirms_it() {
        let follows = scene(|view| Some(if view < 6 { 0.0 } else { 0.011 }));
        assert_eq!(testimony(&follows, 0.0115, &jump()), Testimony::Confirmed);
        // The views scatter; the scene shows by how much.
        assert_eq!(testimony(&follows, 0.02, &[]), Testimony::Silent);
        assert_eq!(testimony(&follows, 0.008, &[]), Testimony::Confirmed);
        // The other way round, or much less than the views suggest: neither.
        for size in [-0.0115, 0.04] {
            assert_eq!(testimony(&follows, size, &jump()), Testimony::Silent, "{size}");
        }
    }

    #[test]
    fn few_pictures_on_one_side_say_nothing() {
        let early = scene(|view| (view < 7).then_some(0.0));
        assert_eq!(testimony(&early, 0.02, &jump()), Testimony::Silent);
        assert_eq!(testimony(&[], 0.02, &jump()), Testimony::Silent);
    }
}
