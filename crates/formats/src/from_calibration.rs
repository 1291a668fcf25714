//! Conversion of a calibration in memory to a file.

use nalgebra::{Point2, Point3};

use super::{
    board_entry::BoardEntry,
    calibration_file::{
        AcceptanceEntry, BoundEntry, CALIBRATION_SCHEMA, CalibrationFile, CandidateEntry,
        EstimateEntry, FindingEntry, FocalEntry, FocalLengths, IMPORTED, LensEntry, LineEntry,
        PoseEntry, PrincipalPointEntry, ProjectionEntry, SigmaEntry, ValidAreaEntry, ViewEntry,
    },
    import::OldCalibration,
    named_covariance::NamedCovariance,
};
use boresight_calibrate::{
    Acceptance, AcceptanceGoal, Calibration, Finding, Focal, LensModel, ModelFit, NotCalibrated,
    PrincipalPointEstimate, PrincipalPoints, Severity, Verdict, ViewResult, acceptance,
};
use boresight_geometry::{
    BoardOutline, Camera, LensParameter, LensParts, PrincipalLine, boards::Board, frame::ImageSize,
};

/// A picture, used or not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewName {
    /// File name of the picture.
    pub name: String,
    /// Number in the session; `None` for the index among all pictures, from 1.
    pub number: Option<usize>,
    /// Reason for not using the picture; `None` if used.
    pub reason: Option<String>,
}

/// Words for findings, each with an action.
#[derive(Clone, Copy, Debug)]
pub struct FindingWords {
    /// Words for a finding on a calibration from the given views.
    pub finding: fn(&Finding, &[ViewName]) -> (String, &'static str),
    /// Words for the reason of a missing calibration from the given views.
    pub not_calibrated: fn(&NotCalibrated, &[ViewName]) -> (String, String),
    /// Words for the verdict on a goal: the verdict, and the action, empty if none.
    pub acceptance: fn(&Acceptance) -> (String, &'static str),
}

impl CalibrationFile {
    /// The file of a calibration from pictures of `image_size`, with the used pictures of `views`
    /// in order.
    ///
    /// Without a calibration the verdict is `untrustworthy`, and the reason is the only finding.
    pub fn of(
        result: Result<&Calibration, &NotCalibrated>,
        image_size: ImageSize,
        board: &Board,
        views: &[ViewName],
        words: FindingWords,
    ) -> Self {
        let file = Self::without_result(image_size, board, views);
        match result {
            Ok(calibration) => Self {
                board: file
                    .board
                    .clone()
                    .map(|named| BoardEntry { points_mm: found_mm(calibration, board), ..named }),
                verdict: calibration.verdict.code().into(),
                findings: calibration
                    .findings
                    .iter()
                    .map(|finding| {
                        let severity = finding.severity;
                        entry(finding.code.code(), severity, (words.finding)(finding, views))
                    })
                    .collect(),
                result: Some(LensEntry::of(calibration)),
                candidates: Some(calibration.candidates.iter().map(CandidateEntry::of).collect()),
                principal_point: Some(PrincipalPointEntry::of(&calibration.principal_point)),
                projection_sd_px: Some(projection(calibration)),
                bound_px: Some(BoundEntry {
                    picture: calibration.picture_bound_px(),
                    covered: calibration.covered_bound_px,
                }),
                valid_area: Some(ValidAreaEntry {
                    goal_px: calibration.valid_area.goal_px,
                    share: calibration.valid_area.share,
                    bound_px: calibration.valid_area.bound_px,
                }),
                visible_drift: calibration.visible_drift,
                acceptance: calibration
                    .acceptance
                    .as_ref()
                    .map(|judged| AcceptanceEntry::of(judged, (words.acceptance)(judged))),
                coverage: Some(calibration.coverage),
                views: view_entries(calibration, board, views),
                ..file
            },
            Err(reason) => {
                let (message, action) = (words.not_calibrated)(reason, views);
                let reason = entry(reason.code(), Severity::Bad, (message, &action));
                Self { findings: vec![reason], ..file }
            }
        }
    }

    fn without_result(image_size: ImageSize, board: &Board, views: &[ViewName]) -> Self {
        let views = views.iter().map(unused).collect();
        Self { views, ..Self::empty(image_size, Some(BoardEntry::of(board))) }
    }

    fn empty(image_size: ImageSize, board: Option<BoardEntry>) -> Self {
        Self {
            schema: CALIBRATION_SCHEMA.into(),
            image_size: [image_size.width_px, image_size.height_px],
            board,
            verdict: Verdict::Untrustworthy.code().into(),
            findings: Vec::new(),
            result: None,
            candidates: None,
            principal_point: None,
            projection_sd_px: None,
            bound_px: None,
            valid_area: None,
            visible_drift: None,
            acceptance: None,
            typical_goal_px: None,
            coverage: None,
            views: Vec::new(),
            source: None,
            replaces: None,
            camera: None,
        }
    }
}

impl CalibrationFile {
    /// The file of another program's calibration, with the lens alone: `finding` lists the
    /// unknowns.
    pub fn of_imported(old: &OldCalibration, (message, action): (String, &str)) -> Self {
        Self {
            verdict: Verdict::Care.code().into(),
            findings: vec![entry(IMPORTED, Severity::Care, (message, action))],
            result: Some(LensEntry { rms_px: old.rms_px, ..LensEntry::alone(&old.camera) }),
            source: old.source.clone(),
            ..Self::empty(old.image_size, None)
        }
    }

    /// Judges the calibration by `goal`, with `scale_sd` the relative standard deviation of the
    /// board's square size. `None` if the file has no lens, or doesn't state its covariance.
    pub fn judged(&self, goal: AcceptanceGoal, scale_sd: f64) -> Option<Acceptance> {
        let lens = self.result.as_ref()?;
        let covariance = lens.full_covariance()?;
        let [width_px, height_px] = self.image_size;
        let image_size = ImageSize { width_px, height_px };
        Some(acceptance(goal, &lens.camera(), &covariance, image_size, scale_sd))
    }
}

impl AcceptanceEntry {
    /// The entry of a verdict, in words: the finding, and the action.
    pub fn of(judged: &Acceptance, (message, action): (String, &str)) -> Self {
        let (unit, per_unit) = match judged.goal {
            AcceptanceGoal::Projection { .. } => ("px", 1.0),
            AcceptanceGoal::Length { .. } => ("mm", 1000.0),
        };
        let bound = judged.bound;
        Self {
            goal: judged.goal.to_string(),
            met: judged.is_met(),
            unit: unit.into(),
            limit: per_unit * judged.goal.limit(),
            bound: bound.map(|bound| per_unit * bound.total),
            lens: bound.map(|bound| per_unit * bound.lens),
            scale: bound.map(|bound| per_unit * bound.scale),
            message,
            action: action.into(),
        }
    }
}

/// Points of a board with other dimensions than `board`.
fn found_mm(calibration: &Calibration, board: &Board) -> Option<Vec<[f64; 3]>> {
    let named_m = board.corners_in_board_m();
    let is_named =
        |(found, named): (&Point3<f64>, &Point2<f64>)| found.z == 0.0 && found.xy() == *named;
    let differs = !calibration.board_m.iter().zip(&named_m).all(is_named);
    differs
        .then(|| calibration.board_m.iter().map(|p| [p.x, p.y, p.z].map(|m| 1000.0 * m)).collect())
}

pub(super) fn entry(
    code: &str,
    severity: Severity,
    (message, action): (String, &str),
) -> FindingEntry {
    let severity = severity.code().into();
    FindingEntry { code: code.into(), severity, message, action: action.into() }
}

fn unused(view: &ViewName) -> ViewEntry {
    let ViewName { name, number, reason } = view.clone();
    ViewEntry { name, number, reason, ..ViewEntry::default() }
}

fn pair(px: Point2<f64>) -> [f64; 2] {
    [px.x, px.y]
}

impl LensEntry {
    /// The entry of a lens without any uncertainty.
    pub(super) fn alone(camera: &Camera) -> Self {
        Self {
            model: LensModel::simplest_with(camera).code().into(),
            focal: None,
            f_px: [camera.f_px.x, camera.f_px.y],
            pp_px: pair(camera.pp_px),
            distortion: camera.distortion.into(),
            sigma: None,
            covariance: None,
            covariance_all: None,
            rms_px: None,
            noise_px: None,
            excess_px: None,
            noise_factor: None,
            noise_floor_px: None,
        }
    }

    fn of(calibration: &Calibration) -> Self {
        let camera = &calibration.camera;
        let sd = calibration.sd();
        let sd = |of: LensParameter| sd[of.index()];
        let f_sd_px = LensParameter::F.map(sd);
        let square_pixels = f_sd_px[0] == f_sd_px[1] && camera.f_px.x == camera.f_px.y;
        let named = |covariance, keep: &dyn Fn(LensParameter) -> bool| {
            Some(NamedCovariance::of(covariance, square_pixels, keep))
        };
        Self {
            model: calibration.model.code().into(),
            focal: Some(match calibration.focal {
                Focal::Common => FocalEntry { varies: false, scatter_px: None },
                Focal::Varying { scatter_px } => {
                    FocalEntry { varies: true, scatter_px: Some(scatter_px) }
                }
            }),
            f_px: [camera.f_px.x, camera.f_px.y],
            pp_px: pair(camera.pp_px),
            distortion: camera.distortion.into(),
            sigma: Some(SigmaEntry {
                f_px: f_sd_px,
                pp_px: LensParameter::PP.map(sd),
                k1: sd(LensParameter::K1),
                k2: sd(LensParameter::K2),
                p1: sd(LensParameter::P1),
                p2: sd(LensParameter::P2),
                k3: sd(LensParameter::K3),
                k4: sd(LensParameter::K4),
                k5: sd(LensParameter::K5),
                k6: sd(LensParameter::K6),
            }),
            covariance: named(&calibration.covariance, &|of| sd(of) > 0.0),
            covariance_all: named(&calibration.covariance_all, &|of| {
                of.is_browns() || calibration.covariance_all.variance_of(of) > 0.0
            }),
            rms_px: Some(calibration.rms_px),
            noise_px: Some(calibration.noise_px),
            excess_px: Some(calibration.excess_px),
            noise_factor: Some(calibration.noise_factor),
            noise_floor_px: calibration.noise_floor_px,
        }
    }
}

impl CandidateEntry {
    fn of(fit: &ModelFit) -> Self {
        let camera = &fit.camera;
        Self {
            model: fit.model.code().into(),
            weight: Some(fit.weight),
            cost: Some(fit.cost),
            noise_factor: Some(fit.noise_factor),
            f_px: [camera.f_px.x, camera.f_px.y],
            pp_px: pair(camera.pp_px),
            distortion: camera.distortion.into(),
        }
    }
}

impl PrincipalPointEntry {
    fn of(points: &PrincipalPoints) -> Self {
        let entry = |estimate: &Option<PrincipalPointEstimate>| estimate.map(EstimateEntry::of);
        Self {
            pl_unweighted: entry(&points.pl_unweighted),
            pl_weighted: entry(&points.pl_weighted),
            pl_ring: entry(&points.pl_ring),
            free_homography: entry(&points.free_homography),
            bundle: entry(&points.bundle),
            zhang: entry(&points.zhang),
        }
    }
}

impl EstimateEntry {
    fn of(estimate: PrincipalPointEstimate) -> Self {
        let covariance = estimate.covariance_px2;
        let sd = |variance: f64| variance.max(0.0).sqrt();
        Self {
            px: pair(estimate.px),
            sigma_px: covariance.map(|c| [sd(c[(0, 0)]), sd(c[(1, 1)])]),
            covariance_px2: covariance.map(|c| [[c[(0, 0)], c[(0, 1)]], [c[(1, 0)], c[(1, 1)]]]),
            f_px: estimate.f_px.map(|f| {
                if f.x == f.y { FocalLengths::Common(f.x) } else { FocalLengths::Each([f.x, f.y]) }
            }),
        }
    }
}

fn projection(calibration: &Calibration) -> ProjectionEntry {
    let sd = &calibration.projection_sd;
    let grid = sd.grid.iter().map(|point| [point.px.x, point.px.y, point.sd_px]).collect();
    ProjectionEntry { mean: sd.mean_px, max: sd.max_px, grid }
}

/// Entries of all pictures. The used pictures have the values of the calibration's views, in the
/// same order.
fn view_entries(calibration: &Calibration, board: &Board, views: &[ViewName]) -> Vec<ViewEntry> {
    let mut results = calibration.views.iter().zip(calibration.outlines(board));
    views
        .iter()
        .map(|view| match if view.reason.is_none() { results.next() } else { None } {
            Some((result, outline)) => used(view, result, outline),
            None => unused(view),
        })
        .collect()
}

fn used(view: &ViewName, result: &ViewResult, outline: Option<BoardOutline>) -> ViewEntry {
    let t = &result.cam_from_board.translation.vector;
    let q = result.cam_from_board.rotation.quaternion();
    ViewEntry {
        name: view.name.clone(),
        number: view.number,
        used: true,
        reason: None,
        cam_from_board: Some(PoseEntry {
            rotation_wxyz: [q.w, q.i, q.j, q.k],
            translation_m: [t.x, t.y, t.z],
        }),
        outline_px: outline.map(|outline| outline.corners_px().map(pair)),
        tilt_deg: Some(result.tilt_rad.to_degrees()),
        slot_deg: Some(result.tilt_azimuth_rad.to_degrees()),
        rms_px: Some(result.residual_rms_px),
        noise: Some(result.noise),
        pl: result.principal_line.as_ref().map(LineEntry::of),
        pl_residual_px: result.pl_residual_px,
        focal_px: result.focal.map(|focal| focal.f_px),
        focal_sigma_px: result.focal.map(|focal| focal.sigma_px),
        focal_as_seen_px: result.focal_as_seen.map(|focal| focal.f_px),
    }
}

impl LineEntry {
    fn of(line: &PrincipalLine) -> Self {
        Self {
            phi_rad: line.phi_rad,
            c_px: line.c_px,
            sigma_phi_rad: Some(line.sigma_phi_rad()),
            sigma_c_px: Some(line.sigma_c_px()),
            x0_px: pair(line.origin_px),
            foot_px: Some(pair(line.origin_px + line.normal() * line.c_px)),
        }
    }
}
