//! Time of a picture in a file: from its name, or else the file's own time. Also times in words.

use std::path::Path;

use anyhow::Context;

/// Time of a picture's file, seconds since 1970: the first date and time in its name
/// (`2023-06-13T03_11_46`, `20230613031146`; as UTC), or seconds since 1970 in its name, or the
/// file's modification time.
///
/// # Errors
///
/// If the file's metadata can't be read.
pub fn picture_secs(path: &Path) -> anyhow::Result<f64> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    if let Some(secs) = secs_in(&name) {
        return Ok(secs);
    }
    let changed = path.metadata().and_then(|m| m.modified());
    let changed = changed.with_context(|| format!("could not look at {path:?}"))?;
    let stamp = jiff::Timestamp::try_from(changed)?;
    Ok(stamp.as_millisecond() as f64 * 1e-3)
}

/// Time in a name.
fn secs_in(name: &str) -> Option<f64> {
    let is_digit = |c: char| c.is_ascii_digit();
    let runs: Vec<&str> =
        name.split(|c: char| !is_digit(c)).filter(|run| !run.is_empty()).collect();
    for (i, run) in runs.iter().enumerate() {
        // Year to second in a single run, in two of eight and six digits, or in six.
        let joined = match run.len() {
            14 => Some((*run).to_owned()),
            8 => runs.get(i + 1).filter(|time| time.len() == 6).map(|time| format!("{run}{time}")),
            4 => runs
                .get(i + 1..i + 6)
                .filter(|rest| rest.iter().all(|part| part.len() == 2))
                .map(|rest| format!("{run}{}", rest.concat())),
            _ => None,
        };
        if let Some(secs) = joined.and_then(|digits| secs_of(&digits)) {
            return Some(secs);
        }
    }
    // Seconds since 1970 have had ten digits since 2001.
    let secs = runs.iter().find(|run| run.len() == 10 && run.starts_with('1'))?;
    secs.parse().ok()
}

fn secs_of(digits: &str) -> Option<f64> {
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
    let stamp = when.ok()?.to_zoned(jiff::tz::TimeZone::UTC).ok()?.timestamp();
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
        for name in
            ["2023-06-13T03_11_46", "cam7_20230613031146", "20230613-031146-x", "cam 1686625906"]
        {
            assert_eq!(secs_in(name), Some(at), "{name}");
        }
        let argus = "1444314601.Thu.Oct.08_14_30_01.GMT.2015.argus02b.c1.timex";
        assert_eq!(secs_in(argus), Some(1_444_314_601.0));
        for name in ["frame-0001", "2023-13-45T99_99_99", "12345", ""] {
            assert_eq!(secs_in(name), None, "{name}");
        }
        assert_eq!(for_programs(at), "2023-06-13T03:11:46Z");
    }
}
