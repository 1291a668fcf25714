//! Stand-in for object stores in a build without support: every open fails.

use std::{path::Path, sync::atomic::AtomicBool, time::Duration};

use super::item::Item;
use boresight_app::MissingFeature;
use boresight_files::Scratch;

/// A prefix in an object store; uninhabited in this build.
#[derive(Clone, Debug)]
pub(super) enum Prefix {}

impl Prefix {
    /// Fails with the name of the missing feature.
    pub(super) fn open(_: &Path) -> anyhow::Result<Self> {
        Err(MissingFeature::CLOUD.into())
    }

    pub(super) fn name(&self, _: &str) -> String {
        match *self {}
    }

    pub(super) fn read(&self, _: &str, _: u64) -> anyhow::Result<Option<Vec<u8>>> {
        match *self {}
    }

    pub(super) fn read_each(
        &self,
        _: &[String],
        _: u64,
    ) -> anyhow::Result<Vec<anyhow::Result<Option<Vec<u8>>>>> {
        match *self {}
    }

    pub(super) fn create(&self, _: &str, _: &[u8]) -> anyhow::Result<bool> {
        match *self {}
    }

    pub(super) fn replace(&self, _: &str, _: &[u8]) -> anyhow::Result<()> {
        match *self {}
    }

    pub(super) fn create_file(&self, _: &str, _: &Path) -> anyhow::Result<bool> {
        match *self {}
    }

    pub(super) fn replace_file(&self, _: &str, _: &Path) -> anyhow::Result<()> {
        match *self {}
    }

    pub(super) fn fetched(&self, _: &str) -> anyhow::Result<Option<Scratch>> {
        match *self {}
    }

    pub(super) fn names(&self, _: &str) -> anyhow::Result<Vec<String>> {
        match *self {}
    }

    pub(super) fn sessions(
        &self,
        _: &mut dyn FnMut(&Item) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        match *self {}
    }
}

/// Result of fetching a session.
#[expect(dead_code, reason = "nothing is fetched")]
pub(super) enum Fetched {
    /// A whole copy.
    Whole,
    /// The session is larger than this many bytes.
    TooLarge(u64),
    /// Fetching took longer than allowed.
    TooLong,
    /// The batch was asked to stop.
    Stopped,
}

/// The buckets of sessions.
#[derive(Debug, Default)]
pub(super) struct Sessions {}

impl Sessions {
    /// Fails with the name of the missing feature.
    pub(super) fn fetch(
        &self,
        _: &str,
        _: bool,
        _: &Scratch,
        _: (Duration, &AtomicBool),
    ) -> anyhow::Result<Fetched> {
        Err(MissingFeature::CLOUD.into())
    }
}
