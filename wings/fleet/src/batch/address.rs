//! Addresses of object stores, `s3://BUCKET/PREFIX`.

use std::{
    io::{Error, ErrorKind},
    path::Path,
};

use boresight_files::FileError;

const SCHEME: &str = "s3://";
/// Name of a fetched single file.
pub(super) const FETCHED: &str = "fetched";

/// True if `path` is an address in an object store.
pub(super) fn is_cloud(path: &Path) -> bool {
    path.to_str().is_some_and(|text| text.starts_with(SCHEME))
}

/// Error for a missing `path`.
pub(super) fn missing(path: &Path) -> anyhow::Error {
    FileError::reading(path)(Error::new(ErrorKind::NotFound, "nothing is there")).into()
}

/// Error for an invalid address.
#[derive(Debug, thiserror::Error)]
#[error("not an address of an object store, s3://BUCKET/PREFIX: {0:?}")]
pub(super) struct NoAddress(String);

/// A place in an object store: a bucket, and a key or key prefix.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Address {
    pub(super) bucket: String,
    /// Parts separated by single slashes, none at the ends; no part is `.` or `..`. Empty for the
    /// whole bucket.
    pub(super) key: String,
}

impl Address {
    /// Parses `s3://BUCKET/PREFIX`, without a trailing slash.
    pub(super) fn parse(text: &str) -> Result<Self, NoAddress> {
        let wrong = || NoAddress(text.to_owned());
        let rest = text.strip_prefix(SCHEME).ok_or_else(wrong)?;
        let (bucket, key) = rest.split_once('/').unwrap_or((rest, ""));
        let is_bucket = |letter: char| letter.is_ascii_alphanumeric() || "-._".contains(letter);
        let is_named = bucket.starts_with(|first: char| first.is_ascii_alphanumeric());
        if !is_named || !bucket.chars().all(is_bucket) {
            return Err(wrong());
        }
        let is_part = |part: &str| {
            !matches!(part, "" | "." | "..") && !part.contains(|letter: char| letter.is_control())
        };
        let parts = key.strip_suffix('/').unwrap_or(key);
        if !key.is_empty() && !parts.split('/').all(is_part) {
            return Err(wrong());
        }
        Ok(Self { bucket: bucket.to_owned(), key: parts.to_owned() })
    }

    /// Key of the object `below`.
    #[cfg(any(feature = "cloud", test))]
    pub(super) fn key_of(&self, below: &str) -> String {
        match (self.key.as_str(), below) {
            (key, "") => key.to_owned(),
            ("", below) => below.to_owned(),
            (key, below) => format!("{key}/{below}"),
        }
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { bucket, key } = self;
        let slash = if key.is_empty() { "" } else { "/" };
        write!(f, "{SCHEME}{bucket}{slash}{key}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_read_back_and_never_lead_upwards() {
        for (text, bucket, key) in [
            ("s3://fleet", "fleet", ""),
            ("s3://fleet/", "fleet", ""),
            ("s3://fleet.a-b/2026/11 a&b/é/", "fleet.a-b", "2026/11 a&b/é"),
        ] {
            let address = Address::parse(text).expect(text);
            assert_eq!((address.bucket.as_str(), address.key.as_str()), (bucket, key));
            assert_eq!(address.to_string(), text.trim_end_matches('/'));
        }
        for wrong in [
            "s3:/fleet",
            "s3://",
            "s3:///a",
            "s3://..",
            "s3://fleet/../a",
            "s3://fleet/a/..",
            "s3://fleet/a//b",
            "s3://fleet/./a",
            "s3://fleet/a\nb",
            "s3://fleet//",
            "s3://a b/c",
        ] {
            assert!(Address::parse(wrong).is_err(), "{wrong:?}");
        }
        let address = Address::parse("s3://fleet/out").expect("an address");
        assert_eq!(address.key_of("items/ab"), "out/items/ab");
        assert_eq!(address.key_of(""), "out");
    }
}
