//! What each finding means, for the book: where it shows, where it comes from, what to do, and whether the result can be
//! used.

use boresight_calibrate::FindingCode;

/// A finding, explained to somebody who has met it for the first time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FindingMeaning {
    /// The finding in a few words.
    pub title: &'static str,
    /// Where it shows, beside the sentence.
    pub shows: &'static str,
    /// Where it comes from.
    pub cause: &'static str,
    /// What to do, most effective first.
    pub remedy: &'static str,
    /// Whether the result can be used.
    pub use_it: &'static str,
}

/// The meaning of a finding of that code.
pub fn finding_meaning(code: &FindingCode) -> FindingMeaning {
    let [title, shows, cause, remedy, use_it] = match code {
        FindingCode::FewViews { .. } => [
            "Too few views",
            "The verdict is UNFINISHED, and the standard deviations are left out: they'd be too small.",
            "The session ended early, or most pictures weren't taken. It takes at least four different views to tell errors from the lens.",
            "Continue the session: `boresight guide --session SESSION`. For pictures, add more, with the board tipped in different directions.",
            "No. Nothing is known yet about how good it is.",
        ],
        FindingCode::ViewsAlike { .. } => [
            "Views that repeat each other",
            "The number of different views is smaller than that of views.",
            "The board was held in the same pose for several pictures, or pictures were copied. A repeated view has the same errors again.",
            "Move and tip the board between pictures. You don't have to delete the repeats: they count once.",
            "Yes, if the verdict says so: the uncertainty counts each pose once.",
        ],
        FindingCode::TiltLow { .. } => [
            "The board was hardly tipped",
            "A large standard deviation of the focal length.",
            "A board that faces the camera looks the same from twice the distance through a lens of twice the focal length. Only tipping tells the two apart.",
            "Tip the board by 30 to 50°, each edge away from the camera in turn.",
            "As a remark, yes. Where the result is NOT TRUSTWORTHY, no: focal length and distance are mixed up.",
        ],
        FindingCode::DirectionsFew { .. } => [
            "Always tipped the same way",
            "The principal point is well known along one direction, and badly across it.",
            "Each tipped view fixes the principal point across its axis only. If all axes are alike, one coordinate stays open.",
            "Tip other edges away, too: left and right as well as top and bottom.",
            "As a remark, yes. With care: look at both standard deviations of the principal point.",
        ],
        FindingCode::PriorUsed { .. } => [
            "Typical values filled a gap",
            "Values that look too usual: no distortion, or a focal length as of an ordinary webcam.",
            "The views don't determine the lens. Weak assumptions about ordinary lenses were needed to reach any result.",
            "Take more tipped views that fill the picture.",
            "No, except as a first guess for another program.",
        ],
        FindingCode::LensSimple { .. } => [
            "The lens model is too simple",
            "Residuals that point the same way in parts of the picture (report, field of residuals).",
            "The views choose a simple lens model, but a richer one would move the principal point by more than chance explains. Often the board isn't flat, or the corners of the picture were never reached.",
            "Take more views that fill the picture and reach its corners. Lay the board on a table: does a ruler show a gap?",
            "With care, in the middle of the picture. If it's bad, no.",
        ],
        FindingCode::LensFolds { .. } => [
            "The lens model ends inside the picture",
            "Holes in the map of the typical error, near the picture's corners.",
            "Polynomials of lens distortion turn around somewhere. With no corners there, nothing stops the turn from lying inside the picture; or the lens is wider than the model.",
            "Take views that reach into the corners of the picture, unless they're black: what a round fisheye doesn't show, no model needs. For a lens of more than 120°, ask for `--lens fisheye`.",
            "With care: inside the valid area that the report shows, and never where the map has holes.",
        ],
        FindingCode::CheckDisagrees { .. } => [
            "The second method disagrees",
            "Two principal points further apart than their standard deviations allow (report, estimates).",
            "The result and the independent check use the same corners in different ways. What neither models, such as a bent board or a focus that moved, pulls them apart.",
            "Check that the board is flat and that focus and zoom are locked. If the verdict isn't GOOD, take the views again.",
            "It's a remark. If another finding names a cause, follow that one.",
        ],
        FindingCode::LensContradicts { .. } => [
            "Not the lens that it was held to",
            "You used `--hold`, and the result says that it isn't held.",
            "The lens has changed since the earlier calibration: focus or zoom was touched, or it's a different camera.",
            "If somebody touched the lens, calibrate without `--hold`. If nobody did, look for a loose lens or a changed picture mode.",
            "With care: the result rests on the new views alone, and those were meant to be few or small.",
        ],
        FindingCode::LensNotHeld { .. } => [
            "Couldn't be held to the earlier lens",
            "You used `--hold`, and the result says why it has no effect.",
            "The two calibrations can't be compared: another kind of lens, no usable covariance, or a focal length for each view.",
            "Name the earlier kind of lens with `--lens`, or calibrate without `--hold`.",
            "With care: the result rests on the new views alone.",
        ],
        FindingCode::CheckMissing => [
            "No second opinion",
            "The report has no estimate by free homographies.",
            "The independent check needs several tipped views, and there weren't enough.",
            "Take more tipped views in different directions.",
            "The verdict says it. The check is missing, the result needn't be wrong.",
        ],
        FindingCode::ViewsDisagree { .. } => [
            "One view too influential",
            "Leaving out one view moves the principal point further than it should.",
            "A view with wrong corners, or few views of which each counts a lot.",
            "Look at the view with the largest residual in the report, remove it (`u` in a session), and take that pose again.",
            "With care. If it's bad, no.",
        ],
        FindingCode::ViewOdd { .. } => [
            "A view that fits badly",
            "One bar in the report is much longer than the others.",
            "A blurred picture, a board that moved or was bent, or corners that were found in the wrong place.",
            "Look at its picture in the report. Remove it, or take that pose again.",
            "As a remark, yes: such a view has its own, larger noise, and counts less.",
        ],
        FindingCode::PlOutlier { .. } => [
            "A principal line that misses the others",
            "One line in the report's drawing passes far from the point where the others meet.",
            "Most often the board was bent in that view, or the view is nearly flat on.",
            "Take that pose again and remove the view. Check that the board is flat.",
            "As a remark, yes: the result comes from all corners, not from the lines.",
        ],
        FindingCode::FocusMoved { .. } => [
            "Focus or zoom moved",
            "Each view has its own focal length; the sentence says by how much, and whether it jumped, drifted or follows the board's distance.",
            "Autofocus was on, somebody touched the lens, or the lens sags as it warms up.",
            "Lock focus and zoom, and start over. On Linux, boresight locks them automatically where the camera can; `boresight devices` says so.",
            "The principal point is usable. One focal length doesn't exist, so measure nothing with it. If you can't lock the focus, use `boresight calibrate --varying-focal`.",
        ],
        FindingCode::FocalVaries { .. } => [
            "A focal length for each view",
            "You asked `calibrate` for it with `--varying-focal`.",
            "The focal length may differ between the views; the result states their mean and scatter.",
            "Nothing, if that's what you need.",
            "Yes: the principal point and each view's own focal length. The mean belongs to no picture.",
        ],
        FindingCode::ViewsMixed { .. } => [
            "Views of two cameras",
            "Two groups of views with different focal lengths, principal points or distortion.",
            "Some pictures are from a different camera, mode or size, are rotated, or have their distortion removed already; or the camera frames or zooms automatically.",
            "Calibrate each camera, mode and orientation separately. Switch off automatic rotation, zoom and framing.",
            "No. It's the mean of two cameras.",
        ],
        FindingCode::PixelsNotSquare { .. } => [
            "Pixels that aren't square",
            "fx and fy differ.",
            "The camera or a program stretches the picture, or the print is stretched: a few views hardly tell the two apart.",
            "Measure ten squares in both directions. If they're equal, the picture is stretched: use the mode in which the sensor reads its pictures.",
            "Yes: the result allows for it, and the uncertainty holds the doubt.",
        ],
        FindingCode::BoardStretched { .. } => [
            "Squares that aren't square",
            "Height and width of a square differ.",
            "The printer fed the paper too fast or too slowly, or \"fit to page\" was on.",
            "Measure ten squares in both directions. Print again without \"fit to page\".",
            "Yes: the result allows for it.",
        ],
        FindingCode::BoardBent { .. } => [
            "The board isn't flat",
            "The sentence says by how much. Against a ruler, you can see half a millimetre.",
            "Paper on cardboard, a warped plate, or glue that pulled while it dried.",
            "Mount the board on glass, aluminium or a thick panel. If the verdict isn't GOOD, take the views again.",
            "Yes, where it's a remark: the result allows for the bend, and the uncertainty holds what's left of it. For measurement to a tenth of a pixel, take a flat board.",
        ],
        FindingCode::RollingShutter { .. } => [
            "Moving while the rows were read",
            "Each view is sheared differently.",
            "A sensor that reads its rows one after the other sees a moving board slanted. Hands sway; long exposures make it worse.",
            "Rest the board and the camera before each view. Use more light and a shorter exposure.",
            "Yes, if the verdict is GOOD: the views differ by it, so the bound includes it.",
        ],
        FindingCode::ViewTorn { .. } => [
            "A picture put together from two",
            "Below one row, the board is shifted.",
            "A frame was overwritten while it was sent: a long or bad cable, a crowded USB port, or a program that doesn't wait.",
            "Remove the view and take that pose again. If it happens again, use another cable, port or picture mode.",
            "Without the torn view, yes.",
        ],
        FindingCode::BoardFlexes { .. } => [
            "A board that bends as you hold it",
            "The board has a different shape in each view.",
            "It's too thin: paper, cardboard or thin foam under your hands.",
            "Mount the board on glass, aluminium or a thick panel. If the verdict isn't GOOD, take the views again.",
            "Yes, if the verdict is GOOD: the views differ by it, so the bound includes it.",
        ],
        FindingCode::PictureShifted { .. } => [
            "The picture moves on its own",
            "Each view is shifted by a different amount.",
            "Image stabilisation, in the lens or in software, or automatic framing.",
            "Switch it off, and start over.",
            "No measurement holds while it's on: the principal point differs from picture to picture.",
        ],
        FindingCode::PixelsSkewed { .. } => [
            "Rows and columns that aren't at right angles",
            "The sentence states the angle.",
            "A sheared print or scan, or software that corrects pictures. Sensors aren't skewed.",
            "Measure both diagonals of the board: they must be equal. Switch off corrections of the picture.",
            "With care.",
        ],
        FindingCode::PictureWarped { .. } => [
            "Something in front of the lens",
            "A smooth pattern of residuals that no lens has.",
            "A window, dome or windscreen, or software that corrects the picture.",
            "Calibrate as the camera will be used, with the window in place, and take views over the whole picture. If you can, calibrate without it, too, and compare.",
            "With care: only where the board was, and only as long as nothing in front of the lens moves.",
        ],
        FindingCode::CauseUnclear { .. } => [
            "Something is wrong, but what?",
            "The views disagree; the sentence names up to three causes.",
            "Several causes explain these few views about equally well.",
            "Rule them out one by one, in the order of the sentence: lock the focus, switch off stabilisation, mount the board flat, rest it before each view.",
            "With care: the uncertainty includes the doubt about the cause.",
        ],
        FindingCode::LensOther { .. } => [
            "A lens that no model fits",
            "Rings in the residuals.",
            "A mirror lens, an extreme fisheye, or a picture that was corrected and cropped by software.",
            "Switch off corrections in the camera. For a wide lens, ask for `--lens fisheye`.",
            "With care: only where the board was.",
        ],
        FindingCode::CornersOutside { .. } => [
            "Corners outside the picture",
            "The sentence names the first such view.",
            "The stated picture size isn't that of the pictures, or pictures of different size or orientation are mixed.",
            "Give the true `--image-size`. Don't mix orientations: cameras may rotate pictures automatically.",
            "No.",
        ],
        FindingCode::CornerOdd { .. } => [
            "One corner far off",
            "The sentence names view and corner.",
            "A reflection, a finger, dirt, or a shadow's edge at that corner.",
            "Look at the picture. Remove the view, or take it again.",
            "As a remark, yes: one corner of hundreds counts little, and less the further it's off.",
        ],
        FindingCode::PrincipalPointFar { .. } => [
            "The principal point lies far from the middle",
            "The cross in the report is away from the picture's centre.",
            "The picture is a crop of the sensor's, the stated size is wrong, or the lens is mounted off-centre, as some are by design.",
            "Check the picture size and the camera's mode. If it's by design, start boresight with `--shifted-sensor`.",
            "With care, once you know why. A correct off-centre calibration is as good as any.",
        ],
        FindingCode::HeldOut { .. } => [
            "A view that the others don't predict",
            "That view's residual under the others' lens is larger than expected.",
            "Its pose is beyond what the others cover, or something changed before it was taken.",
            "Take more views, and look at this one.",
            "With care: expect errors of that size where the board hasn't been.",
        ],
        FindingCode::Mirrored { .. } => [
            "A mirror image",
            "Text in the picture reads backwards.",
            "The camera or its driver mirrors, as for video calls.",
            "Switch off mirroring in the camera or the driver. The window's own mirror (M) doesn't change what is measured.",
            "No.",
        ],
        FindingCode::NoiseHigh { .. } => [
            "Noisy corners",
            "Residuals above a pixel.",
            "Out of focus, too dark, a moving board, a squashed video, or a board of a different size.",
            "Focus the lens, hold still, add light. Check `--board`.",
            "With care: more views average noise away, but not its causes.",
        ],
        FindingCode::NoiseCorrelated { .. } => [
            "Neighbouring corners err alike",
            "Patches of residuals that point the same way.",
            "Blur, uneven light, a slightly wavy board, or strong compression. Each corner then tells less than it seems to.",
            "Focus the lens, light the board evenly, mount it flat.",
            "Yes: the stated uncertainty allows for it.",
        ],
        FindingCode::NoiseUnderstated { .. } => [
            "Uncertainty stated too small",
            "Corners scatter more on a board that is held still than they do around the fit.",
            "A fit with few views bends to its noise.",
            "Hold the board still until each view is taken, and take more views.",
            "With care: take the standard deviations times the ratio of the two numbers.",
        ],
        FindingCode::NoiseExceeded { .. } => [
            "More error than the camera's noise",
            "Residuals are larger than the scatter of a board that is held still.",
            "What's left is the same in every picture: a board that isn't quite flat, squares that aren't quite equal, or the finest shape of the lens.",
            "Take a flatter board, if the result must be better.",
            "Yes: the stated uncertainty allows for it.",
        ],
        FindingCode::ProjectionUncertain { .. } => [
            "Too little of the picture is known",
            "Much of the map of the typical error in the report isn't green; the sentence states the share.",
            "The board stayed in one part of the picture, was small, or was tipped too little.",
            "Take more views that fill the picture and reach its corners, tipped by 30 to 50° in different directions. For an installed camera, take a larger board.",
            "With care: inside the valid area that the report shows. If it's bad, no.",
        ],
        FindingCode::FitFailed { .. } => [
            "An explanation that couldn't be tried",
            "The program compares explanations of what the views show. The fit under the named ones didn't reach an end.",
            "Few views, or views that hardly determine what the explanation is about.",
            "Take more views that differ, if you suspect that cause.",
            "Yes: the others were compared, and the result is the best of them.",
        ],
        FindingCode::NotConverged => [
            "The solver didn't reach an end",
            "No other number can be relied on.",
            "Views that contradict each other, or too few to determine the lens.",
            "Remove views with large residuals. Take more views.",
            "No.",
        ],
    };
    FindingMeaning { title, shows, cause, remedy, use_it }
}
