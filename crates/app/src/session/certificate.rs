//! First sheet of a report, from the settings, the camera and the clock.

use std::path::Path;

use jiff::{Span, Timestamp, Zoned, tz::TimeZone};

use boresight_files::{self as files, Links};
use boresight_present::{
    report::{Certificate, Logo},
    text::certificate as words,
};
use boresight_run::config::CertificateConfig;

/// Largest logo file, in bytes.
const LOGO_LIMIT: u64 = 2 << 20;
/// Letters of the checksum in the certificate's number.
const SHORT: usize = 6;

/// Facts about a calibration beside the numbers.
#[derive(Clone, Debug, Default)]
pub struct Circumstances<'a> {
    /// Time of the calibration, if known.
    pub made: Option<Timestamp>,
    /// Model and serial number as stated by a live camera; both may be empty.
    pub camera: (String, String),
    /// The camera's mode in words; empty if not known.
    pub mode: String,
    /// Calibration file: path and bytes.
    pub file: Option<(&'a Path, &'a [u8])>,
}

/// Certificate from `config`. A logo in an unsupported format becomes a note.
pub fn certificate(
    config: &CertificateConfig,
    known: Circumstances<'_>,
    notes: &mut Vec<String>,
) -> Certificate {
    let made = known.made.map(|made| made.to_zoned(TimeZone::system()));
    let file = known.file.map(|(path, bytes)| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        (name, sha256(bytes))
    });
    let number = if config.number.is_empty() {
        own_number(made.as_ref(), file.as_ref().map(|(_, sum)| sum.as_str()))
    } else {
        config.number.clone()
    };
    let or = |ours: &str, camera: String| if ours.is_empty() { camera } else { ours.to_owned() };
    let (model, serial) = known.camera;
    Certificate {
        number,
        check_due: made.as_ref().and_then(|made| due(made, config.check_months)),
        date: made.map_or_else(String::new, |made| {
            made.strftime("%-d %B %Y, %H:%M (UTC%:z)").to_string()
        }),
        company: config.company.clone(),
        logo: logo(&config.logo, notes),
        customer: config.customer.clone(),
        site: config.site.clone(),
        operator: config.operator.clone(),
        camera_make: config.camera_make.clone(),
        camera_model: or(&config.camera_model, model),
        camera_serial: or(&config.camera_serial, serial),
        lens: config.lens.clone(),
        mode: known.mode,
        board_id: config.board_id.clone(),
        square_measured: config.square_measured.clone(),
        file,
    }
}

/// Number from the date and the first letters of the checksum; empty without a checksum.
fn own_number(made: Option<&Zoned>, sum: Option<&str>) -> String {
    let Some(short) = sum.and_then(|sum| sum.get(..SHORT)) else { return String::new() };
    let date = made.map_or_else(String::new, |made| made.strftime("%Y%m%d-").to_string());
    format!("{date}{}", short.to_uppercase())
}

fn due(made: &Zoned, months: u32) -> Option<String> {
    let span = Span::new().try_months(months).ok()?;
    let due = made.checked_add(span).ok().filter(|_| months > 0)?;
    Some(due.strftime("%-d %B %Y").to_string())
}

fn logo(path: &str, notes: &mut Vec<String>) -> Option<Logo> {
    if path.is_empty() {
        return None;
    }
    let read = files::read(Path::new(path), LOGO_LIMIT, Links::Followed);
    let logo = read
        .map_err(|err| err.to_string())
        .and_then(|bytes| Logo::of(&bytes).ok_or_else(|| "no PNG or JPEG".into()));
    logo.map_err(|why| notes.push(words::no_logo(path, &why))).ok()
}

fn sha256(bytes: &[u8]) -> String {
    hmac_sha256::Hash::hash(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_standard() {
        // FIPS 180-4, examples.
        assert_eq!(
            sha256(b"abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }

    #[test]
    fn the_next_check_is_due_months_later() {
        let made: Zoned = "2026-11-30T12:00:00+00:00[UTC]".parse().expect("a time");
        assert_eq!(due(&made, 3).as_deref(), Some("28 February 2027"));
        assert_eq!(due(&made, 0), None);
        let sum = sha256(b"abc");
        assert_eq!(own_number(Some(&made), Some(&sum)), "20261130-BA7816");
        assert_eq!(own_number(Some(&made), None), "");
    }

    #[test]
    fn a_logo_that_is_not_there_is_a_note() {
        let mut notes = Vec::new();
        let config = CertificateConfig { logo: "nowhere.png".into(), ..Default::default() };
        let certificate = certificate(&config, Circumstances::default(), &mut notes);
        assert_eq!((certificate.logo, certificate.date.as_str()), (None, ""));
        assert!(notes[0].contains("nowhere.png"), "{notes:?}");
    }
}
