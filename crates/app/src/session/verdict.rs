//! Verdict on a result, in sentences and as an exit status.

use boresight_calibrate::{Calibration, Focal, NotCalibrated, Verdict};
use boresight_formats::{CalibrationFile, FindingEntry};
use boresight_geometry::{LensParameter, LensValues};
use boresight_present::{known::Known, text};

use crate::Announcer;

/// Outcome of a command, from good to bad; the number is the exit code of the process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    /// 0: done, and usable.
    Good,
    /// 3: ended, but the result isn't trustworthy, or misses its goal.
    NotTrustworthy,
    /// 6: an installed camera can't be judged.
    CannotTell,
    /// 5: an installed camera points elsewhere; its lens is unchanged.
    Moved,
    /// 4: an installed camera has changed.
    Recalibrate,
    /// 1: the command failed.
    Failed,
}

impl From<Exit> for std::process::ExitCode {
    fn from(exit: Exit) -> Self {
        match exit {
            Exit::Good => Self::SUCCESS,
            Exit::Failed => Self::from(1),
            Exit::NotTrustworthy => Self::from(3),
            Exit::Recalibrate => Self::from(4),
            Exit::Moved => Self::from(5),
            Exit::CannotTell => Self::from(6),
        }
    }
}

/// Announces a result and `file`: the verdict first, then the objections, then the numbers. Returns
/// the exit status: good only if a goal is met, too. The verdict is marked if the file's source is
/// the simulated camera.
pub fn announce_result(
    result: Result<&Calibration, &NotCalibrated>,
    file: &CalibrationFile,
    announcer: &Announcer,
) -> Exit {
    let say = |line: &str| announcer.say(line);
    let source = file.source.as_deref().unwrap_or_default();
    let Ok(calibration) = result else {
        for FindingEntry { message, action, .. } in &file.findings {
            say(&text::of_source(source, &format!("No calibration: {message}. {action}")));
        }
        return Exit::NotTrustworthy;
    };
    let [fx, fy, cx, cy] = calibration.camera.lens_parameters().of(LensParameter::F_THEN_PP);
    let [sd_fx, sd_fy, sd_cx, sd_cy] = calibration.sd().of(LensParameter::F_THEN_PP);
    say(&text::of_source(source, text::verdict_on(calibration)));
    let is_met = calibration.acceptance.is_none_or(|judged| judged.is_met());
    if let Some((what, action)) = text::acceptance::on_goal(calibration) {
        say(text::of_source(source, &format!("{what}. {action}")).trim_end());
    }
    for FindingEntry { code, message, action, .. } in &file.findings {
        say(&format!("  {code}: {message}. {action}"));
    }
    let measured = |value, sd| text::measured(calibration, value, sd, 2);
    say(&format!("  principal point  ({}, {}) px", measured(cx, sd_cx), measured(cy, sd_cy)));
    if let Focal::Varying { scatter_px } = calibration.focal {
        say(&format!(
            "  focal lengths    {fx:.2} px on average, {scatter_px:.2} px sd between views:"
        ));
        for (view, (number, _)) in calibration.views.iter().zip(file.used()) {
            let own = view.focal.map_or("none of its own".into(), |f| {
                format!("{} px", measured(f.f_px, f.sigma_px))
            });
            say(&format!("    view {number:<3}       {own}"));
        }
    } else if (fx - fy).abs() < 1e-9 {
        say(&format!("  focal length     {} px", measured(fx, sd_fx)));
    } else {
        say(&format!("  focal lengths    {}, {} px", measured(fx, sd_fx), measured(fy, sd_fy)));
    }
    say(&format!(
        "  lens {:11} {}",
        calibration.model.code(),
        text::result::coefficients(&calibration.camera.distortion)
    ));
    say(&format!("  typical error    {}", text::projection(calibration)));
    if let Some(met) = Known::of_file(file).and_then(|known| known.met()) {
        say(&format!("  meets the goal   {met}"));
    }
    say(&format!(
        "  {} views, reprojection RMS {:.3} px",
        calibration.views.len(),
        calibration.rms_px
    ));
    if let Some(measured_px) = calibration.noise_floor_px {
        say(&format!(
            "  corner noise     {}",
            text::result::noise(calibration.noise_px, measured_px)
        ));
    }
    match calibration.verdict {
        Verdict::Good | Verdict::Care if is_met => Exit::Good,
        Verdict::Good | Verdict::Care | Verdict::Untrustworthy => Exit::NotTrustworthy,
    }
}
