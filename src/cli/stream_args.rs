//! Arguments for properties not stated by a source.

use clap::Args;

use boresight_capture::RawForm;
use boresight_run::config::Config;

/// What a source can't say itself.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Camera")]
pub(super) struct StreamArguments {
    /// Size, format and rate of raw pictures from pipe:COMMAND or -, for example 1280x720:gray@30.
    /// Formats by their names in ffmpeg, GStreamer or ROS: gray, gray16le, rgb24, bgr24, yuv420p,
    /// nv12, yuyv422, uyvy422, bayer_rggb8, ….
    #[arg(long, value_name = "WxH:FORMAT@FPS", value_parser = raw)]
    raw: Option<String>,
    /// Topic of the pictures in a recorded bag, for example /camera/image_raw [default: the only
    /// one with pictures].
    #[arg(long, value_name = "TOPIC")]
    topic: Option<String>,
}

impl StreamArguments {
    pub(super) fn apply(&self, config: &mut Config) {
        if let Some(raw) = &self.raw {
            config.camera.raw.clone_from(raw);
        }
        if let Some(topic) = &self.topic {
            config.camera.topic.clone_from(topic);
        }
    }
}

fn raw(text: &str) -> Result<String, String> {
    text.parse::<RawForm>().map(|_| text.to_owned()).map_err(|err| err.to_string())
}
