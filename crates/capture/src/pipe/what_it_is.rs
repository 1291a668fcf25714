//! Kind of a stream without readable pictures, for a person.

/// Beginnings of streams, and the kind of each.
const KNOWN: [(&[u8], &str); 11] = [
    (b"\0\0\0\x01", "this is H.264 or H.265"),
    (b"\0\0\x01", "this is H.264, H.265 or MPEG"),
    (b"\x1a\x45\xdf\xa3", "this is Matroska or WebM"),
    (b"nut/multimedia container", "this is NUT"),
    (b"RIFF", "this is AVI"),
    (b"FLV", "this is FLV"),
    (b"OggS", "this is Ogg"),
    (b"P5", "this is PGM"),
    (b"P6", "this is PPM"),
    (b"BM", "this is BMP"),
    (b"GIF8", "this is GIF"),
];

/// Guesses the kind of `bytes`.
pub(super) fn what_it_is(bytes: &[u8]) -> String {
    if let Some((_, what)) = KNOWN.iter().find(|(start, _)| bytes.starts_with(start)) {
        return (*what).into();
    }
    if bytes.get(4..8) == Some(b"ftyp") {
        return "this is MP4".into();
    }
    if bytes.first() == Some(&0x47) && bytes.get(188) == Some(&0x47) {
        return "this is an MPEG transport stream".into();
    }
    let line = bytes.split(|byte| *byte == b'\n').find(|line| !line.trim_ascii().is_empty());
    match line.map(<[u8]>::trim_ascii) {
        Some(line) if line.iter().all(|byte| (0x20..0x7F).contains(byte)) => {
            let text: String = line.iter().take(60).map(|byte| char::from(*byte)).collect();
            format!("it begins with the text {text:?}")
        }
        _ => {
            let begin: Vec<String> =
                bytes.iter().take(4).map(|byte| format!("{byte:02x}")).collect();
            format!("it begins with the bytes {}", begin.join(" "))
        }
    }
}
