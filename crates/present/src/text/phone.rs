//! Words around the pages in a browser: the phone's page, and the page that calibrates in the
//! browser.

use crate::grade::Grade;

/// Line above the QR code.
pub const SCAN: &str = "Phone: scan this code, on the same network.";
/// Line above the QR code for another phone.
pub const SCAN_NEXT: &str = "Phone connected. For another one, scan this code.";
/// Name of the button and the card in the window.
pub const PHONE: &str = "Phone";
/// Tooltip of the button.
pub const PHONE_TIP: &str = "Show or hide the QR code of the page for a phone.";
/// Label of the link in the window.
pub const TYPE: &str = "Or open:";
/// Label of the watchers' link in the window.
pub const WATCH: &str = "Watch only:";
/// Note while the result can still be fetched.
pub const LINGERING: &str =
    "The result stays on the phone's page until the page is closed. Ctrl-C ends at once.";
/// Verdict on the page without a result.
pub const NO_CALIBRATION: &str = "No calibration";
/// Spoken verdict, six words at most.
pub fn aloud(grade: Grade) -> &'static str {
    match grade {
        Grade::Good => "Good. You can use it",
        Grade::Care => "Use with care. Read the warnings",
        Grade::Unfinished => "Unfinished. Take more photos",
        Grade::NotTrustworthy => "Not trustworthy. Read why",
    }
}

/// Verdict's stable name on the page, and the spoken one, of an answer about a calibration.
pub fn judged(answer: &str) -> (&'static str, &'static str) {
    match answer {
        "true" => ("good", "It's true"),
        "off" => ("bad", "It's off"),
        _ => ("care", "These pictures can't tell"),
    }
}

/// Warning about the usual port being in use by another program.
pub fn port_is_taken(port: u16) -> String {
    format!(
        "Port {port} is taken: the page has another one. A code printed for port {port} leads to the other program."
    )
}

/// Name of the report's file on the page.
pub const REPORT: &str = "Report";
/// Name of the calibration file on the page.
pub const CALIBRATION: &str = "Calibration";
/// Name of the page about a judged calibration.
pub const JUDGEMENT: &str = "Judgement";
/// Name of the session's folder as a file.
pub const SESSION: &str = "Session";
/// Error for a missing page that calibrates in a browser.
pub const NO_WEB_PAGE: &str =
    "the page isn't installed. `make web` makes it; name the file with --page";

/// Address of the page that calibrates in a browser, served to the network if `is_open`.
pub fn web_page(link: &str, is_open: bool) -> String {
    let everyone = "Every computer that reaches this one over a network can open it, too. ";
    let everyone = if is_open { everyone } else { "" };
    format!("Open {link} in a browser. {everyone}Ctrl-C ends.")
}

/// Storage place of a session in a browser.
pub const IN_BROWSER: &str = "in a browser; download the session to keep it";
/// Error for a file that isn't a picture.
pub const NO_PICTURE: &str = "this is no PNG or JPEG picture";
/// Note while waiting for a phone to start a session.
pub const WAITING: &str = "Waiting for a phone to start a session. Ctrl-C ends.";
/// Note without a camera.
pub const NO_CAMERA: &str = "No camera found";
/// Action without a camera.
pub const NO_CAMERA_ACTION: &str = "Plug one in";

/// Name of the source offered always.
pub const SIMULATION: &str = "Simulated camera";

/// Number of connected phones, in words.
pub fn phones(count: usize) -> String {
    match count {
        0 => "No phone yet".into(),
        1 => "1 phone".into(),
        count => format!("{count} phones"),
    }
}

/// Address of the page.
pub fn link(link: &str) -> String {
    format!("  or open {link}")
}

/// Another address of the same page.
pub fn other_link(link: &str) -> String {
    format!("  or, from another network, {link}")
}

/// Address for watchers.
pub fn watchers(link: &str) -> String {
    format!("Watch only: {link}")
}
