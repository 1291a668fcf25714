//! Everything a person sees, hears and reads of a calibration session.
//!
//! | module | holds |
//! |---|---|
//! | [`instruction`] | the instruction after a decision, as one value |
//! | [`goal`] | the goal of a result, and the error held to it |
//! | [`grade`] | the grade of a result |
//! | [`result_card`] | a result, as one value |
//! | [`cause_picture`] | the one cause of an untrustworthy result, as lines on a picture |
//! | [`known`] | the map of what is known of the picture |
//! | [`reading`] | measurements of the newest frame, beside the requested values |
//! | [`text`] | the sentences; decides nothing |
//! | [`speech`] | spoken words, and their timing |
//! | [`browser`] | a session as pages in a browser |
//! | [`ghost`] | the requested pose of the board |
//! | [`chart`] | drawings as SVG text |
//! | `report` | a calibration as one HTML page, with the feature `report` |
//! | `qr` | a text as a QR code, with the feature `qr` |
//! | [`sheet`] | the printable board |

#![forbid(unsafe_code)]

pub mod browser;
pub mod cause_picture;
pub mod chart;
pub mod ghost;
pub mod goal;
pub mod grade;
pub mod instruction;
pub mod known;
#[cfg(feature = "qr")]
pub mod qr;
pub mod reading;
#[cfg(feature = "report")]
pub mod report;
pub mod result_card;
pub mod sheet;
pub mod speech;
pub mod text;
