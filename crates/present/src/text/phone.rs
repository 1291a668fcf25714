//! Words around the pages in a browser: the phone's, and the one that calibrates in the browser.

use boresight_calibrate::Verdict;

/// Above the QR code.
pub const SCAN: &str = "Phone: scan this code, on the same network.";
/// Above the QR code for another phone.
pub const SCAN_NEXT: &str =
    "A phone has come, and its link is used up. Another phone scans this code.";
/// The button and the card in the window.
pub const PHONE: &str = "Phone";
/// Tooltip of the button.
pub const PHONE_TIP: &str = "Show or hide the QR code of the page for a phone.";
/// Before the link in the window.
pub const TYPE: &str = "Or open:";
/// Before the link for watchers in the window.
pub const WATCH: &str = "Watch only:";
/// While the result can still be fetched.
pub const LINGERING: &str =
    "The result stays on the phone's page until the page is closed. Ctrl-C ends at once.";
/// Verdict on the page, without a result.
pub const NO_CALIBRATION: &str = "No calibration";
/// Verdict on the page, if nothing speaks against the result.
pub const USE_IT: &str = "You can use this calibration.";
/// The verdict for the ear, in six words at most.
pub fn aloud(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Good => "Good. You can use it",
        Verdict::Care => "Use with care. Read the warnings",
        Verdict::Untrustworthy => "Not usable yet. Read why",
    }
}

/// The usual port belongs to another program.
pub fn port_is_taken(port: u16) -> String {
    format!(
        "Another program uses port {port}, so the page has another one. A QR code that was printed for port {port} leads to that program."
    )
}

/// A file on the page.
pub const REPORT: &str = "Report";
/// The file of the calibration.
pub const CALIBRATION: &str = "Calibration";
/// The session's folder as one file.
pub const SESSION: &str = "Session";
/// The page that calibrates in a browser isn't there.
pub const NO_WEB_PAGE: &str =
    "the page isn't installed. `make web` makes it; name the file with --page";

/// Where the page that calibrates in a browser is.
pub fn web_page(link: &str) -> String {
    format!("Open {link} in a browser. Ctrl-C ends.")
}

/// Where a session in a browser is kept.
pub const IN_BROWSER: &str = "in a browser; download the session to keep it";
/// A file that isn't a picture.
pub const NO_PICTURE: &str = "this is no PNG or JPEG picture";
/// A session that the phone can start.
pub const WAITING: &str = "Waiting for a phone to start a session. Ctrl-C ends.";
/// No camera to offer.
pub const NO_CAMERA: &str = "No camera found";
/// Action when there is no camera.
pub const NO_CAMERA_ACTION: &str = "Plug one in";

/// The source that is always offered.
pub const SIMULATION: &str = "Simulated camera";

/// Number of phones that follow, in words.
pub fn phones(count: usize) -> String {
    match count {
        0 => "No phone yet".into(),
        1 => "1 phone".into(),
        count => format!("{count} phones"),
    }
}

/// The address of the page.
pub fn link(link: &str) -> String {
    format!("  or open {link}")
}

/// Another address of the same page.
pub fn other_link(link: &str) -> String {
    format!("  or, from another network, {link}")
}

/// The address for those who may only look on.
pub fn watchers(link: &str) -> String {
    format!("Watch only: {link}")
}
