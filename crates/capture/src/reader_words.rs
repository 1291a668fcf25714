//! Translates ffmpeg's messages for a person.
//!
//! They name libraries, memory addresses and full URLs with passwords; a person needs the cause.

use boresight_geometry::device::Fault;

use super::address::words_without_secrets;

/// Words in ffmpeg's messages, their meaning, and the cause in plain words. The first match counts.
const MEANINGS: [(&[&str], Fault, &str); 10] = [
    (&["401 unauthorized", "403 forbidden"], Fault::NotLoggedIn, ""),
    (&["404 not found"], Fault::NoSuchStream, ""),
    (&["connection refused"], Fault::Unreachable, "connection refused"),
    (&["failed to resolve", "name or service not known"], Fault::Unreachable, "unknown host name"),
    (&["no route to host", "network is unreachable"], Fault::Unreachable, "no route to it"),
    (&["timed out"], Fault::Unreachable, "no answer"),
    (
        &["server returned 5", "5xx server error"],
        Fault::ReaderFailed,
        "the server reports an error",
    ),
    (&["moov atom not found"], Fault::ReaderFailed, "the file is incomplete"),
    (&["matches no streams"], Fault::ReaderFailed, "there is no video in it"),
    (
        &[
            "not on whitelist",
            "invalid data found",
            "unable to find a suitable",
            "could not find codec",
        ],
        Fault::ReaderFailed,
        "not a video that ffmpeg can read",
    ),
];

/// Libraries with messages about single packets: the decoders, and the output of pictures, with
/// complaints about times in the wrong order.
const ABOUT_PACKETS: [&str; 9] =
    ["h264", "hevc", "mjpeg", "mpeg", "vp8", "vp9", "av1", "swscaler", "image2pipe"];

/// Cause behind ffmpeg's messages, with details for a person; `None` if unknown.
pub(super) fn known(words: &str) -> Option<(Fault, &'static str)> {
    let low = words.to_ascii_lowercase();
    let found = MEANINGS.iter().find(|(signs, ..)| signs.iter().any(|sign| low.contains(sign)));
    found.map(|(_, fault, detail)| (*fault, *detail))
}

/// Cause behind ffmpeg's messages `words` about the source `name`, with details for a person. An
/// unknown cause becomes [`Fault::ReaderFailed`] in ffmpeg's own words, without its internals.
pub(super) fn meaning(words: &str, name: &str) -> (Fault, String) {
    match known(words) {
        Some((fault, detail)) => (fault, detail.to_owned()),
        None => (Fault::ReaderFailed, plain(&words_without_secrets(words, name))),
    }
}

/// Reason why reopening a stream failed; `None` if simply still away.
pub(super) fn refusal(words: &str) -> Option<Fault> {
    let (fault, _) = known(words)?;
    matches!(fault, Fault::NotLoggedIn | Fault::NoSuchStream).then_some(fault)
}

/// Messages in a line, without messages about single packets, repetitions, and memory addresses.
fn plain(text: &str) -> String {
    let mut kept: Vec<&str> = Vec::new();
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        // `[h264 @ 0x55d2c8] co located POCs unavailable`
        let of_library = line.strip_prefix('[').and_then(|rest| rest.split_once("] "));
        let (library, words) = match of_library {
            Some((library, words)) if library.contains(" @ 0x") => (Some(library), words),
            _ => (None, line),
        };
        let is_about_packets = library
            .is_some_and(|library| ABOUT_PACKETS.iter().any(|about| library.starts_with(about)));
        if !is_about_packets && !words.contains("0x") && !kept.contains(&words) {
            kept.push(words);
        }
    }
    kept.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAME: &str = "rtsp://admin:s3cret@cam/1";

    /// Messages in the words of ffmpeg 5.1.
    #[test]
    fn what_ffmpeg_says_is_understood() {
        for (said, fault, detail) in [
            (
                "[rtsp @ 0x55f] method DESCRIBE failed: 401 Unauthorized\n\
                 rtsp://admin:s3cret@cam/1: Server returned 401 Unauthorized (authorization failed)",
                Fault::NotLoggedIn,
                "",
            ),
            ("[http @ 0x55f] HTTP error 403 Forbidden", Fault::NotLoggedIn, ""),
            ("x: Server returned 404 Not Found", Fault::NoSuchStream, ""),
            (
                "[tcp @ 0x5] Connection to tcp://cam:554?timeout=0 failed: Connection refused",
                Fault::Unreachable,
                "connection refused",
            ),
            (
                "[tcp @ 0x5] Failed to resolve hostname cam: Name or service not known\n\
                 http://cam/: Input/output error",
                Fault::Unreachable,
                "unknown host name",
            ),
            (
                "http://cam/: Invalid data found when processing input",
                Fault::ReaderFailed,
                "not a video that ffmpeg can read",
            ),
            (
                "[mov,mp4,m4a,3gp,3g2,mj2 @ 0x55] moov atom not found\n\
                 cut.mp4: Invalid data found when processing input",
                Fault::ReaderFailed,
                "the file is incomplete",
            ),
            (
                "[h264 @ 0x55ff01] co located POCs unavailable\n\
                 [tcp @ 0x55ff02] tcp://admin:s3cret@cam:554?timeout=0 is odd\nodd\nodd\n",
                Fault::ReaderFailed,
                "tcp://cam:554 is odd; odd",
            ),
            (
                "[image2pipe @ 0x55f615] Application provided invalid, non monotonically increasing dts to muxer in stream 0: 1389 >= 1386",
                Fault::ReaderFailed,
                "",
            ),
            ("", Fault::ReaderFailed, ""),
        ] {
            assert_eq!(meaning(said, NAME), (fault, detail.to_owned()), "{said}");
        }
    }
}
