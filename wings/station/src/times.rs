//! Time of a picture in a file: from its name, its EXIF data, or else the file's own time. Also
//! times in words.

use std::path::Path;

use anyhow::Context;
use jiff::tz::{Offset, TimeZone};

use boresight_capture::exif_time;

/// Time of a picture's file, and where it's from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureTime {
    /// Seconds since 1970.
    pub secs: f64,
    /// True if the file's name tells it.
    pub is_named: bool,
}

/// Time of a picture's file: the first date and time in its name (`2023-06-13T03_11_46`,
/// `20230613031146`), or seconds since 1970 in its name, or the time in its EXIF data, or the
/// file's modification time. Names and EXIF data without a zone are in this computer's.
///
/// # Errors
///
/// If the file's metadata can't be read.
pub fn picture_time(path: &Path) -> anyhow::Result<PictureTime> {
    let zone = TimeZone::system();
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    if let Some(secs) = secs_in(&name, &zone) {
        return Ok(PictureTime { secs, is_named: true });
    }
    let stored = exif_time(path);
    let secs = match stored.and_then(|(time, offset)| exif_secs(&time, offset.as_deref(), &zone)) {
        Some(secs) => secs,
        None => changed_secs(path)?,
    };
    Ok(PictureTime { secs, is_named: false })
}

/// Time of a file's last change, seconds since 1970.
///
/// # Errors
///
/// If the file's metadata can't be read.
pub(super) fn changed_secs(path: &Path) -> anyhow::Result<f64> {
    let changed = path.metadata().and_then(|m| m.modified());
    let changed = changed.with_context(|| format!("could not look at {path:?}"))?;
    let stamp = jiff::Timestamp::try_from(changed)?;
    Ok(stamp.as_millisecond() as f64 * 1e-3)
}

/// Time in EXIF data: `2026:03:12 14:05:00`, with an offset such as `+02:00`, or in `zone`.
fn exif_secs(time: &str, offset: Option<&str>, zone: &TimeZone) -> Option<f64> {
    let offset = offset.and_then(|offset| {
        let (hours, minutes) = offset.get(1..)?.split_once(':')?;
        let secs = 3600 * hours.parse::<i32>().ok()? + 60 * minutes.parse::<i32>().ok()?;
        let secs = if offset.starts_with('-') { -secs } else { secs };
        Some(TimeZone::fixed(Offset::from_seconds(secs).ok()?))
    });
    let digits: String = time.chars().filter(char::is_ascii_digit).collect();
    secs_of(&digits, offset.as_ref().unwrap_or(zone))
}

/// Time in a name, which may say that it's in UTC.
fn secs_in(name: &str, zone: &TimeZone) -> Option<f64> {
    let is_digit = |c: char| c.is_ascii_digit();
    let runs: Vec<&str> =
        name.split(|c: char| !is_digit(c)).filter(|run| !run.is_empty()).collect();
    for (i, run) in runs.iter().enumerate() {
        // Year to second in a single run, in two of eight and six digits, or in six.
        let (joined, last) = match run.len() {
            14 => (Some((*run).to_owned()), i),
            8 => {
                let time = runs.get(i + 1).filter(|time| time.len() == 6);
                (time.map(|time| format!("{run}{time}")), i + 1)
            }
            4 => {
                let rest = runs.get(i + 1..i + 6);
                let rest = rest.filter(|rest| rest.iter().all(|part| part.len() == 2));
                (rest.map(|rest| format!("{run}{}", rest.concat())), i + 5)
            }
            _ => (None, i),
        };
        let behind = runs.get(last).map_or("", |run| {
            let end = run.as_ptr() as usize - name.as_ptr() as usize + run.len();
            name.get(end..).unwrap_or_default()
        });
        let is_utc = behind.trim_start_matches(['.', '_', '-', ' ']).starts_with("UTC")
            || behind.starts_with('Z');
        let utc = TimeZone::UTC;
        let zone = if is_utc { &utc } else { zone };
        if let Some(secs) = joined.and_then(|digits| secs_of(&digits, zone)) {
            return Some(secs);
        }
    }
    // Seconds since 1970 have had ten digits since 2001.
    let secs = runs.iter().find(|run| run.len() == 10 && run.starts_with('1'))?;
    secs.parse().ok()
}

fn secs_of(digits: &str, zone: &TimeZone) -> Option<f64> {
    let part = |from: usize, to: usize| digits.get(from..to)?.parse::<i8>().ok();
    let year = digits.get(0..4)?.parse::<i16>().ok().filter(|year| (1970..2200).contains(year))?;
    let when = jiff::civil::DateTime::new(
        year,
        part(4, 6)?,
        part(6, 8)?,
        part(8, 10)?,
        part(10, 12)?,
        part(12, 14)?,
        0,
    );
    let stamp = when.ok()?.to_zoned(zone.clone()).ok()?.timestamp();
    Some(stamp.as_second() as f64)
}

/// Present time, seconds since 1970.
pub fn now_secs() -> f64 {
    jiff::Timestamp::now().as_millisecond() as f64 * 1e-3
}

/// A time in words: "12 March 2026, 14:05", in this computer's zone.
pub fn in_words(secs: f64) -> String {
    in_this_zone(secs, "%-d %B %Y, %H:%M")
}

/// Day of a time in words: "12 March 2026".
pub fn day_in_words(secs: f64) -> String {
    in_this_zone(secs, "%-d %B %Y")
}

fn in_this_zone(secs: f64, form: &str) -> String {
    let Ok(stamp) = jiff::Timestamp::from_second(secs as i64) else {
        return "an unknown time".into();
    };
    stamp.to_zoned(jiff::tz::TimeZone::system()).strftime(form).to_string()
}

/// A time for programs: `2023-06-13T03:11:46Z`.
pub fn for_programs(secs: f64) -> String {
    jiff::Timestamp::from_second(secs as i64).map_or(String::new(), |stamp| stamp.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_times() {
        let at = 1_686_625_906.0;
        let utc = TimeZone::UTC;
        for name in
            ["2023-06-13T03_11_46", "cam7_20230613031146", "20230613-031146-x", "cam 1686625906"]
        {
            assert_eq!(secs_in(name, &utc), Some(at), "{name}");
        }
        let argus = "1444314601.Thu.Oct.08_14_30_01.GMT.2015.argus02b.c1.timex";
        assert_eq!(secs_in(argus, &utc), Some(1_444_314_601.0));
        for name in ["frame-0001", "2023-13-45T99_99_99", "12345", ""] {
            assert_eq!(secs_in(name, &utc), None, "{name}");
        }
        assert_eq!(for_programs(at), "2023-06-13T03:11:46Z");
    }

    #[test]
    fn times_without_a_zone_are_local() {
        let west = TimeZone::fixed(Offset::from_hours(-8).expect("a zone"));
        let at = 1_686_625_906.0;
        assert_eq!(secs_in("cam7_2023-06-12T19_11_46", &west), Some(at));
        for name in ["2023-06-13T03_11_46Z", "20230613_031146_UTC-cam7", "1686625906"] {
            assert_eq!(secs_in(name, &west), Some(at), "{name}");
        }
        assert_eq!(exif_secs("2023:06:12 19:11:46", None, &west), Some(at));
        assert_eq!(exif_secs("2023:06:13 05:11:46", Some("+02:00"), &west), Some(at));
        assert_eq!(exif_secs("0000:00:00 00:00:00", None, &west), None);
    }
}
