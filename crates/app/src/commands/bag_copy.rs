//! A calibration in a copy of a recorded bag.

use std::path::{Path, PathBuf};

#[cfg(feature = "bags")]
use anyhow::{Context, bail};

use crate::Announcer;
#[cfg(not(feature = "bags"))]
use crate::MissingFeature;

/// Copy of a recorded bag with a calibration.
#[derive(Clone, Debug)]
pub struct BagCopy {
    /// Recorded bag.
    pub from: PathBuf,
    /// Topic of the pictures; `None` for the only topic.
    pub topic: Option<String>,
    /// Path of the copy; must not exist yet.
    pub to: PathBuf,
}

impl BagCopy {
    /// Writes the copy with the result in `input`, a session folder or a calibration in any
    /// readable format, as a `sensor_msgs/msg/CameraInfo` beside each picture. True if the
    /// calibration must not be used.
    ///
    /// # Errors
    ///
    /// If the result or the bag can't be read, if their pictures differ in size, or if the copy
    /// can't be written.
    #[cfg(feature = "bags")]
    pub fn write(&self, input: &Path, announcer: &Announcer) -> anyhow::Result<bool> {
        use boresight_formats::export::RosCameraInfo;
        use boresight_sources::{NotCopied, copy_with, open_bag};

        let (camera, untrustworthy) = crate::session::export::result_of(input, announcer)?;
        let topic = self.topic.as_deref();
        let size = open_bag(&self.from, topic)?.identity().image_size.context("no picture")?;
        if size != camera.image_size {
            bail!(
                "the calibration is for {} pixels, and the bag's pictures have {size}",
                camera.image_size
            );
        }
        let info = RosCameraInfo::of(&camera);
        let copied = copy_with(&self.from, &self.to, topic, &mut |header| {
            let message = info.message(header.stamp_nanos.unwrap_or(0), header.frame_id);
            [RosCameraInfo::CDR_HEADER.as_slice(), &message].concat()
        });
        let copied = copied.map_err(|err| match err {
            NotCopied::Bag(err) => anyhow::Error::from(err),
            NotCopied::Write(err) => err.into(),
        })?;
        let (to, messages) = (self.to.display(), copied.messages);
        announcer.say(&format!("Written: {to}, with {messages} messages on {}", copied.topic));
        if let Some(how) = copied.left_out {
            announcer.say(&format!("The end of the bag isn't in it ({how})."));
        }
        Ok(untrustworthy)
    }

    /// Fails in builds without bags.
    ///
    /// # Errors
    ///
    /// [`MissingFeature::BAGS`].
    #[cfg(not(feature = "bags"))]
    pub fn write(&self, _: &Path, _: &Announcer) -> anyhow::Result<bool> {
        Err(MissingFeature::BAGS.into())
    }
}
