//! Names what differs from view to view, and what else the views share.

use boresight_geometry::frame::SceneScale;
use nalgebra::{DMatrix, DVector};

use super::{
    columns::{Derivatives, Products, RESIDUAL, SCALE, SCALE_R2, SHIFT, SHUTTER, solve},
    effects::{Marginalised, Whitened},
    evidence::{Gain, Size, range, visible},
    kinds::{Family, Kind, SMOOTH, Scope},
    model::{Fit, Shared},
    two_cameras::{TwoCameras, two_cameras},
    witness::{Testimony, Vetoed, testimony},
};

/// Rounds in which lens and smooth effects of the views are fitted in turn.
const SWEEPS: usize = 3;
/// Least number of views that name a cause.
const LEAST_VIEWS: usize = 8;
/// Standard deviations from which a cause that all views share is named.
const SHARED_SIGMAS: f64 = 4.0;
/// Standard deviations from which a course of the focal length is named, of [`COURSES`] tried.
const COURSE_SIGMAS: f64 = 2.6;
const COURSES: f64 = 3.0;
/// Standard deviations from which two cameras are named.
const GROUPS_SIGMAS: f64 = 3.5;
/// Least gain of predicted views, in twice the log likelihood, and in standard deviations.
const PREDICTED: f64 = 10.0;
const PREDICTED_SIGMAS: f64 = 3.0;
/// Least gain of a course, in twice the log likelihood.
const COURSE_GAIN: f64 = 4.0;
/// Standard deviations by which the best explanation must lead a rival.
const LEAD_SIGMAS: f64 = 2.0;

/// Cause named by the views.
#[derive(Clone, Debug)]
pub(super) struct Named {
    pub(super) kind: Kind,
    /// Values of the parameters; root mean squares over the views for a view's own.
    pub(super) size: Vec<f64>,
    pub(super) sigmas: f64,
    /// Kinds of other families that predict the views nearly as well.
    pub(super) rivals: Vec<Kind>,
    /// Factor on each view; empty if a cause has no course.
    pub(super) course: Vec<f64>,
    /// True if the scene confirms it.
    pub(super) in_scene: bool,
}

/// Causes named by the views, beside the corrected ones.
#[derive(Clone, Debug, Default)]
pub(super) struct Verdicts {
    pub(super) named: Vec<Named>,
    /// Change of the focal length that would have been named, but for the scene.
    pub(super) vetoed: Option<Vetoed>,
    /// Least named relative change of the focal length from the first view to the last. `None` if
    /// there are too few views.
    pub(super) visible_drift: Option<f64>,
}

impl Verdicts {
    /// Verdicts at the minimum of the bundle behind `derivatives`, with the `scene` of each view as
    /// a witness. The noise of a corner is at least `noise_floor` times the stated error.
    pub(super) fn of(
        derivatives: &Derivatives<'_>,
        noise_floor: f64,
        scene: &[Option<SceneScale>],
    ) -> Self {
        if derivatives.of_views.len() < LEAST_VIEWS {
            return Self::default();
        }
        let judge = Judge::of(derivatives, noise_floor, scene);
        judge.and_then(|judge| judge.verdicts()).unwrap_or_default()
    }
}

/// Evidence of a kind.
struct Evidence {
    kind: Kind,
    size: Option<Size>,
    /// Gain of each view, predicted by the others.
    gains: Vec<f64>,
    gain: Gain,
    values: Vec<f64>,
    /// See [`Named::course`].
    course: Vec<f64>,
    /// What the scene says about it.
    said: Testimony,
}

impl Evidence {
    /// The change of the focal length, if the scene vetoes it.
    fn vetoed(&self) -> Option<Vetoed> {
        let Testimony::Vetoed { allowed } = self.said else { return None };
        let factor = if self.course.is_empty() { 1.0 } else { range(&self.course) };
        let change = libm::expm1(self.values.first()? * factor);
        Some(Vetoed { change, allowed: allowed * factor })
    }
}

struct Judge<'a> {
    derivatives: &'a Derivatives<'a>,
    scene: &'a [Option<SceneScale>],
    whitened: Whitened,
    /// Every cause that all views share.
    every: Vec<Kind>,
    smooth: Marginalised,
    /// Residual of each view at the smooth effects.
    pull: Vec<DVector<f64>>,
    /// Fit of the lens and [`Self::every`].
    fit: Fit,
    left_out: Vec<DVector<f64>>,
    /// Minus twice the log likelihood of each view under [`Self::fit`].
    predicted: Vec<f64>,
}

impl<'a> Judge<'a> {
    fn of(
        derivatives: &'a Derivatives<'a>,
        noise_floor: f64,
        scene: &'a [Option<SceneScale>],
    ) -> Option<Self> {
        let coordinates: Vec<f64> = (0..derivatives.of_views.len())
            .map(|view| 2.0 * derivatives.observations.view(view).len() as f64)
            .collect();
        let mut absorbed = SMOOTH.to_vec();
        absorbed.extend([SCALE, SCALE_R2, SHIFT, SHIFT + 1, SHUTTER, SHUTTER + 1]);
        let whitened = Whitened::of(&derivatives.of_views, &coordinates, &absorbed, noise_floor)?;
        // Beside free focal lengths along x and y, the squares' shape is the pair's only parameter.
        let pair = if derivatives.square_pixels { Kind::PixelAspect } else { Kind::BoardStretched };
        let every = vec![pair, Kind::PixelSkew, Kind::BoardBent, Kind::LensShape];
        let shared = shared(derivatives, &every);
        let residual = |products: &Products| {
            DVector::from_fn(SMOOTH.len(), |i, _| products[(SMOOTH[i], RESIDUAL)])
        };
        let mut pull: Vec<DVector<f64>> = whitened.products.iter().map(residual).collect();
        let mut variance = whitened.guess(&SMOOTH);
        let mut settled = None;
        for _ in 0..SWEEPS {
            variance = whitened.variances(&SMOOTH, &pull, variance)?;
            let smooth = Marginalised::of(&whitened, &SMOOTH, variance.clone())?;
            let fit = Fit::of(&smooth.products, &derivatives.lens, &shared)?;
            pull = fit.pull(&whitened.products, &SMOOTH);
            settled = Some((smooth, fit));
        }
        let (smooth, fit) = settled?;
        let left_out = fit.left_out()?;
        let predicted = with_log_determinant(fit.predicted(&left_out), &smooth);
        Some(Self { derivatives, scene, whitened, every, smooth, pull, fit, left_out, predicted })
    }
}

impl Judge<'_> {
    fn verdicts(&self) -> Option<Verdicts> {
        let mut named = Vec::new();
        for kind in [Kind::PixelSkew, Kind::LensShape] {
            named.extend(self.shared_by_views(kind)?);
        }
        let courses = self.courses()?;
        let drift = courses.iter().find(|it| it.kind == Kind::FocusDrift);
        let visible_drift = drift
            .and_then(|it| Some(it.size.as_ref()?.covariance[(0, 0)].sqrt()))
            .zip(visible(self.predicted.len(), COURSE_SIGMAS, COURSES))
            .map(|(sd, sigmas)| sd * sigmas);
        let effects = self.effects()?;
        let between = self.between_views(&courses, &effects, |_| true);
        let all = || courses.iter().chain(&effects);
        let vetoed = between.iter().find_map(|it| {
            let is_named = |kind| it.kind == kind || it.rivals.contains(&kind);
            all().filter(|it| is_named(it.kind)).find_map(Evidence::vetoed)
        });
        named.extend(match vetoed {
            Some(_) => self.between_views(&courses, &effects, |it| it.vetoed().is_none()),
            None => between,
        });
        Some(Verdicts { named, vetoed, visible_drift })
    }

    /// A cause that all views share, if it stands out from its scatter and predicts views that it
    /// wasn't fitted to.
    fn shared_by_views(&self, kind: Kind) -> Option<Option<Named>> {
        let place = self.place(kind);
        let Some(size) = self.fit.size(&self.left_out, place, 1.0) else { return Some(None) };
        if size.sigmas <= SHARED_SIGMAS {
            return Some(None);
        }
        let others = self.every.iter().copied().filter(|other| *other != kind);
        let shared = shared(self.derivatives, &others.collect::<Vec<_>>());
        let without = Fit::of(&self.smooth.products, &self.derivatives.lens, &shared)?;
        let without = without.predicted(&without.left_out()?);
        let gain = Gain::between(&without, &self.fit.predicted(&self.left_out));
        let values = self.fit.value.rows(place.0, place.1).iter().copied().collect();
        Some((gain.sum > PREDICTED).then_some(Named {
            kind,
            size: values,
            sigmas: size.sigmas,
            rivals: Vec::new(),
            course: Vec::new(),
            in_scene: false,
        }))
    }

    /// Index and count of the parameters of `kind` in the fit of every cause.
    fn place(&self, kind: Kind) -> (usize, usize) {
        let before = self.every.iter().take_while(|it| **it != kind);
        let before: usize = before.map(|it| it.columns().len()).sum();
        (self.derivatives.lens.len() + before, kind.columns().len())
    }

    /// Excess of each view's inverse distance over the mean, relative.
    fn nearness(&self) -> Vec<f64> {
        let poses = self.derivatives.state.cam_from_board.iter();
        let near: Vec<f64> = poses.map(|pose| pose.translation.z.recip()).collect();
        let mean = near.iter().sum::<f64>() / near.len().max(1) as f64;
        near.iter().map(|near| near / mean - 1.0).collect()
    }

    /// Evidence for courses of the focal length.
    fn courses(&self) -> Option<Vec<Evidence>> {
        let count = self.predicted.len();
        let drift = (0..count).map(|view| view as f64 / (count - 1) as f64 - 0.5).collect();
        let mut all = vec![
            self.course(Kind::FocusDrift, drift, 1.0)?,
            self.course(Kind::FocusBreathes, self.nearness(), 1.0)?,
        ];
        if let Some(from) = self.likeliest_jump() {
            let course = (0..count).map(|view| indicator(view >= from)).collect();
            all.push(self.course(Kind::FocusJump, course, count as f64 / COURSES)?);
        }
        Some(all)
    }

    fn course(&self, kind: Kind, course: Vec<f64>, tries: f64) -> Option<Evidence> {
        let fit = self.fit_with(kind, &course)?;
        let left_out = fit.left_out()?;
        let size = fit.size(&left_out, (fit.value.len() - 1, 1), COURSES * tries);
        let predicted = with_log_determinant(fit.predicted(&left_out), &self.smooth);
        let values = vec![fit.value[fit.value.len() - 1]];
        Some(self.evidence(kind, size, &predicted, values, course))
    }

    /// Fit of every cause that all views share, and of `kind` with a factor on each view.
    fn fit_with(&self, kind: Kind, course: &[f64]) -> Option<Fit> {
        let mut shared = shared(self.derivatives, &self.every);
        let sd = kind.sd(self.derivatives.image_size);
        shared.push(Shared { columns: kind.columns(), sd, course: Some(course.to_vec()) });
        Fit::of(&self.smooth.products, &self.derivatives.lens, &shared)
    }

    fn evidence(
        &self,
        kind: Kind,
        size: Option<Size>,
        predicted: &[f64],
        values: Vec<f64>,
        course: Vec<f64>,
    ) -> Evidence {
        let gains: Vec<f64> = self.predicted.iter().zip(predicted).map(|(a, b)| a - b).collect();
        let gain = Gain::of(&gains);
        let said = match (kind.row().family, values.first()) {
            (Family::Focus | Family::Mixed, Some(size)) => testimony(self.scene, *size, &course),
            _ => Testimony::Silent,
        };
        Evidence { kind, size, gains, gain, values, course, said }
    }

    /// First view of the jump of the focal length that gains most, from one fit.
    fn likeliest_jump(&self) -> Option<usize> {
        let count = self.predicted.len();
        let (information, _) = self.fit.total();
        let every = DMatrix::identity(information.nrows(), information.ncols());
        let settled = solve(&information, &every)?;
        let shared = shared(self.derivatives, &self.every);
        let columns = self.derivatives.lens.iter().copied();
        let columns: Vec<usize> =
            columns.chain(shared.iter().flat_map(|it| it.columns.iter().copied())).collect();
        let sd = Kind::FocusJump.sd(self.derivatives.image_size)[0];
        let mut across = DVector::<f64>::zeros(columns.len());
        let (mut own, mut pull) = (sd.powi(-2), 0.0);
        let mut best: Option<(f64, usize)> = None;
        for view in (3..count).rev() {
            let products = &self.smooth.products[view];
            across += DVector::from_fn(columns.len(), |i, _| products[(columns[i], SCALE)]);
            own += products[(SCALE, SCALE)];
            pull += products[(SCALE, RESIDUAL)];
            if view + 2 >= count {
                continue;
            }
            let left = own - across.dot(&(&settled * &across));
            let gain = (pull - across.dot(&self.fit.value)).powi(2) / left;
            if left > 0.0 && best.is_none_or(|best| gain > best.0) {
                best = Some((gain, view));
            }
        }
        best.map(|(_, view)| view)
    }

    /// Effects that each view or each group of views has by itself.
    fn effects(&self) -> Option<Vec<Evidence>> {
        let own = Kind::OWN.into_iter().map(|kind| self.own_effect(kind));
        self.two_cameras().map(Some).into_iter().chain(own).collect()
    }

    /// What differs from view to view, of what `counts`: the best course of the focal length, or
    /// the best effect with all rivals that it doesn't lead. An effect that the scene confirms
    /// leads all.
    fn between_views(
        &self,
        courses: &[Evidence],
        effects: &[Evidence],
        counts: impl Fn(&Evidence) -> bool,
    ) -> Vec<Named> {
        let sigmas = |evidence: &Evidence| evidence.size.as_ref().map_or(0.0, |size| size.sigmas);
        let is_course =
            |it: &&Evidence| counts(it) && sigmas(it) > COURSE_SIGMAS && it.gain.sum > COURSE_GAIN;
        let course =
            courses.iter().filter(is_course).max_by(|a, b| sigmas(a).total_cmp(&sigmas(b)));
        let predicts = |it: &&Evidence| {
            counts(it)
                && it.gain.sum > PREDICTED
                && it.gain.sigmas > least_sigmas(self.predicted.len())
                && (it.kind != Kind::Mixed || sigmas(it) > GROUPS_SIGMAS)
        };
        let leads = |it: &Evidence| it.said == Testimony::Confirmed;
        let best = effects
            .iter()
            .filter(predicts)
            .max_by(|a, b| leads(a).cmp(&leads(b)).then(a.gain.sum.total_cmp(&b.gain.sum)))
            .filter(|best| course.is_none() || best.kind.row().family != Family::Focus);
        let rivals = |best: &Evidence| -> Vec<Kind> {
            let hides_shutter = self.hides_shutter();
            let is_close = |it: &Evidence| {
                it.gain.sum > PREDICTED
                    && Gain::between(&best.gains, &it.gains).sigmas < LEAD_SIGMAS
            };
            let is_rival = |it: &&Evidence| {
                let is_hidden = hides_shutter && it.kind == Kind::RollingShutter;
                let is_other = it.kind.row().family != best.kind.row().family;
                is_other && counts(it) && !leads(best) && (is_hidden || is_close(it))
            };
            effects.iter().filter(is_rival).map(|it| it.kind).collect()
        };
        let named = |it: &Evidence, rivals| Named {
            kind: it.kind,
            size: it.values.clone(),
            sigmas: if it.kind.row().scope == Scope::Own { it.gain.sigmas } else { sigmas(it) },
            rivals,
            course: it.course.clone(),
            in_scene: leads(it),
        };
        let course = course.map(|it| named(it, Vec::new()));
        course.into_iter().chain(best.map(|it| named(it, rivals(it)))).collect()
    }

    /// True if in most views the error common to all corners exceeds their own noise: what is left
    /// of a corrected rolling shutter then explains as much as any effect of the views.
    fn hides_shutter(&self) -> bool {
        let views = self.predicted.len();
        let common = (0..views).filter_map(|view| self.derivatives.observations.common(view));
        2 * common.filter(|common| common.exceeds_noise()).count() > views
    }

    fn two_cameras(&self) -> Option<Evidence> {
        let kind = Kind::Mixed;
        let fit = self.fit_with(kind, &vec![1.0; self.predicted.len()])?;
        let pulls: Vec<Vec<f64>> = kind
            .columns()
            .iter()
            .map(|column| {
                let pull = self.fit.pull(&self.smooth.products, &[*column]);
                let size = |(view, pull): (usize, &DVector<f64>)| {
                    pull[0] / self.smooth.products[view][(*column, *column)].max(1e-9).sqrt()
                };
                pull.iter().enumerate().map(size).collect()
            })
            .collect();
        let TwoCameras { is_second, predicted } = two_cameras(&fit, kind.columns().len(), &pulls)?;
        let course: Vec<f64> = is_second.into_iter().map(indicator).collect();
        let divided = self.fit_with(kind, &course)?;
        let count = kind.columns().len();
        let own = (divided.value.len() - count, count);
        let size = divided.size(&divided.left_out()?, own, 1.0);
        let values = divided.value.rows(own.0, own.1).iter().copied().collect();
        let predicted = with_log_determinant(predicted, &self.smooth);
        Some(self.evidence(kind, size, &predicted, values, course))
    }

    /// Evidence for an effect that each view has by itself, beside the smooth ones.
    fn own_effect(&self, kind: Kind) -> Option<Evidence> {
        let own = kind.columns();
        let columns: Vec<usize> = SMOOTH.iter().chain(own).copied().collect();
        let pull = self.fit.pull(&self.whitened.products, own);
        let pull: Vec<DVector<f64>> = self
            .pull
            .iter()
            .zip(&pull)
            .map(|(smooth, own)| {
                let all = smooth.iter().chain(own).copied();
                DVector::from_iterator(columns.len(), all)
            })
            .collect();
        let mut start = self.smooth.variance.clone();
        start.extend(self.whitened.guess(own));
        let variance = self.whitened.variances(&columns, &pull, start)?;
        let values = variance[SMOOTH.len()..].iter().map(|it| it.sqrt()).collect();
        let marginalised = Marginalised::of(&self.whitened, &columns, variance)?;
        let shared = shared(self.derivatives, &self.every);
        let fit = Fit::of(&marginalised.products, &self.derivatives.lens, &shared)?;
        let predicted = with_log_determinant(fit.predicted(&fit.left_out()?), &marginalised);
        Some(self.evidence(kind, None, &predicted, values, Vec::new()))
    }
}

fn shared(derivatives: &Derivatives<'_>, kinds: &[Kind]) -> Vec<Shared> {
    let of = |kind: &Kind| Shared {
        columns: kind.columns(),
        sd: kind.sd(derivatives.image_size),
        course: None,
    };
    kinds.iter().map(of).collect()
}

fn with_log_determinant(mut predicted: Vec<f64>, marginalised: &Marginalised) -> Vec<f64> {
    predicted.iter_mut().zip(&marginalised.log_determinant).for_each(|(it, more)| *it += more);
    predicted
}

/// Standard deviations by which a gain must stand out. Few views can't reach [`PREDICTED_SIGMAS`]:
/// equal gains of `views` views have `√(2 N ln 2)`.
fn least_sigmas(views: usize) -> f64 {
    const SHARE: f64 = 0.7;
    let most = (2.0 * views as f64 * std::f64::consts::LN_2).sqrt();
    PREDICTED_SIGMAS.min(SHARE * most)
}

fn indicator(is_concerned: bool) -> f64 {
    if is_concerned { 1.0 } else { 0.0 }
}
