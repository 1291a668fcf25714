//! Addresses of network streams.

const SCHEMES: [&str; 8] =
    ["rtsp://", "rtsps://", "rtmp://", "http://", "https://", "udp://", "tcp://", "srt://"];
/// Placeholder for a secret.
const HIDDEN: &str = "…";
/// Words in a path before a secret.
const SECRET_WORDS: [&str; 4] = ["pass", "pwd", "token", "key="];

/// Words of options with a secret value.
const SECRET_OPTIONS: [&str; 6] = ["pass", "pwd", "token", "secret", "user-pw", "key="];
/// Prefix of commands.
const COMMAND: &str = "pipe:";
/// Prefix of topics of ROS 2.
pub(super) const TOPIC: &str = "ros2:";

/// True if `name` is an address for ffmpeg, such as `rtsp://camera/1`.
pub fn is_address(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    SCHEMES.iter().any(|scheme| name.starts_with(scheme))
}

/// True if `name` is a command with pictures as output, such as `pipe:rpicam-vid …`.
///
/// It may do anything, so only the person at this computer may give it: never a phone, never a
/// recorded session.
pub fn is_command(name: &str) -> bool {
    name.starts_with(COMMAND)
}

/// True if `name` is a topic of ROS 2, such as `ros2:/camera/image_raw`.
pub fn is_topic(name: &str) -> bool {
    name.starts_with(TOPIC)
}

/// `name` for storing and showing: an address without user, password, query and fragment; a command
/// without those of its addresses, and without arguments resembling a secret; anything else
/// unchanged.
pub fn without_secrets(name: &str) -> String {
    if let Some(command) = name.strip_prefix(COMMAND) {
        return format!("{COMMAND}{}", command_without_secrets(command));
    }
    if !is_address(name) {
        return name.to_owned();
    }
    let Some((scheme, rest)) = name.split_once("://") else { return name.to_owned() };
    let rest = rest.split(['?', '#']).next().unwrap_or_default();
    let (authority, path) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
    // A password may contain an @, even a slash if it wasn't encoded.
    let (host, path) = match path.rsplit_once('@') {
        Some((_, after)) if !authority.contains('@') => {
            after.split_at(after.find('/').unwrap_or(after.len()))
        }
        _ => (authority.rsplit_once('@').map_or(authority, |(_, host)| host), path),
    };
    let has_secret = |part: &str| {
        let part = part.to_ascii_lowercase();
        SECRET_WORDS.iter().any(|word| part.contains(word))
    };
    let path: Vec<&str> =
        path.split('/').map(|part| if has_secret(part) { HIDDEN } else { part }).collect();
    format!("{scheme}://{host}{}", path.join("/"))
}

fn command_without_secrets(command: &str) -> String {
    let mut hides_next = false;
    let shown = command.split(' ').map(|word| {
        let low = word.to_ascii_lowercase();
        let is_secret = SECRET_OPTIONS.iter().any(|secret| low.contains(secret));
        let hidden = std::mem::replace(&mut hides_next, false);
        match word.split_once('=') {
            _ if hidden => HIDDEN.into(),
            Some((name, _)) if is_secret => format!("{name}={HIDDEN}"),
            None if is_secret && word.starts_with('-') => {
                hides_next = true;
                word.into()
            }
            _ => addresses_without_secrets(word),
        }
    });
    shown.collect::<Vec<String>>().join(" ")
}

/// `words` with every address as shown by [`without_secrets`].
pub(super) fn addresses_without_secrets(words: &str) -> String {
    let mut rest = words;
    let mut clean = String::new();
    while let Some(at) = rest.find("://") {
        let begin = rest[..at]
            .rfind(|c: char| !c.is_ascii_alphanumeric())
            .map_or(0, |b| b + rest[b..].chars().next().map_or(1, char::len_utf8));
        let end = rest[at..]
            .find(|c: char| c.is_whitespace() || "'\"<>".contains(c))
            .map_or(rest.len(), |e| at + e);
        clean += &rest[..begin];
        clean += &without_secrets(&rest[begin..end]);
        rest = &rest[end..];
    }
    clean + rest
}

/// Removes the secrets in the address `name` from `words`, another program's message about the
/// source.
#[cfg(all(unix, feature = "live"))]
pub(super) fn words_without_secrets(words: &str, name: &str) -> String {
    // The program may write the address in another way.
    addresses_without_secrets(&words.replace(name, &without_secrets(name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_kept_without_its_secrets() {
        for (given, kept) in [
            ("rtsp://admin:s3cret@cam/stream", "rtsp://cam/stream"),
            ("rtsp://admin:p@ss@cam:554/stream", "rtsp://cam:554/stream"),
            ("rtsp://admin:a/b@cam/stream", "rtsp://cam/stream"),
            (
                "HTTP://u:p@10.0.0.1:8080/video.mjpg?user=u&pwd=p#x",
                "HTTP://10.0.0.1:8080/video.mjpg",
            ),
            ("http://cam?pwd=p", "http://cam"),
            ("rtsp://cam/user=admin_password=tlJw_channel=1", "rtsp://cam/…"),
            ("rtsp://cam/live/token=abc/1", "rtsp://cam/live/…/1"),
            ("rtsp://[fe80::1]:554/1", "rtsp://[fe80::1]:554/1"),
            ("rtsp://", "rtsp://"),
            ("pictures/a@b.png", "pictures/a@b.png"),
            ("usb:0c45:6366:A1", "usb:0c45:6366:A1"),
            ("pipe:rpicam-vid -t 0 -o -", "pipe:rpicam-vid -t 0 -o -"),
            ("pipe:ffmpeg -i rtsp://u:s3cret@cam/1 -", "pipe:ffmpeg -i rtsp://cam/1 -"),
            (
                "pipe:gst rtspsrc location=rtsp://u:p@cam/1 user-pw=p ! x --password p -",
                "pipe:gst rtspsrc location=rtsp://cam/1 user-pw=… ! x --password … -",
            ),
        ] {
            assert_eq!(without_secrets(given), kept, "{given}");
            assert_eq!(without_secrets(kept), kept, "it stays");
        }
    }

    #[cfg(all(unix, feature = "live"))]
    #[test]
    fn words_of_ffmpeg_hide_them_too() {
        let name = "rtsp://admin:s3cret@cam/stream";
        for (said, shown) in [
            ("rtsp://admin:s3cret@cam/stream: Not found", "rtsp://cam/stream: Not found"),
            ("tcp://admin:s3cret@cam:554?timeout=0 failed", "tcp://cam:554 failed"),
            ("'rtsp://u:s3cret@cam', ü://x", "'rtsp://cam', ü://x"),
            ("nothing", "nothing"),
        ] {
            assert_eq!(words_without_secrets(said, name), shown);
        }
    }
}
