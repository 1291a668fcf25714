//! Addresses of network streams.

/// Whether `name` is an address that ffmpeg reads, such as `rtsp://camera/1`.
pub fn is_address(name: &str) -> bool {
    const SCHEMES: [&str; 8] =
        ["rtsp://", "rtsps://", "rtmp://", "http://", "https://", "udp://", "tcp://", "srt://"];
    SCHEMES.iter().any(|scheme| name.to_ascii_lowercase().starts_with(scheme))
}
