//! Objects below a prefix of a bucket.

use std::{
    fmt::Debug,
    io::{Read, Write},
    path::Path as FilePath,
    sync::Arc,
};

use anyhow::Context;
use futures_util::{StreamExt, TryStreamExt, stream};
use object_store::{
    MultipartUpload, ObjectMeta, ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload,
    list::{PaginatedListOptions, PaginatedListStore},
    path::Path,
};
use tokio::time::{Duration, sleep};

use super::{
    super::address::{Address, FETCHED},
    client::{AT_ONCE, Client, whole},
    error::{CloudError, Why},
};
use boresight_files::{FileError, Links, Scratch, open};

/// Largest body of a request, in bytes; a larger file goes in parts.
const PART_BYTES: usize = 8 << 20;
/// Largest copied object, in bytes.
pub(super) const COPY_LIMIT: u64 = 16 << 30;
/// Time between two looks at an object being stored by another worker.
const PAUSE: Duration = Duration::from_millis(300);
/// Maximum number of looks at such an object.
const LOOKS: usize = 20;

/// A prefix in an object store.
#[derive(Clone, Debug)]
pub(in super::super) struct Prefix {
    pub(super) client: Arc<Client>,
    pub(super) address: Address,
}

/// Objects and folders directly below a prefix.
#[derive(Default)]
pub(super) struct Listing {
    pub(super) objects: Vec<ObjectMeta>,
    /// Keys of the folders, sorted.
    pub(super) folders: Vec<String>,
}

impl Prefix {
    /// Opens the prefix at the address `path`.
    ///
    /// # Errors
    ///
    /// [`CloudError`], or if the path isn't an address.
    pub(in super::super) fn open(path: &FilePath) -> anyhow::Result<Self> {
        let address = Address::parse(&path.to_string_lossy())?;
        Ok(Self { client: Client::open(&address.bucket)?, address })
    }

    /// Address of the object `below`.
    pub(in super::super) fn name(&self, below: &str) -> String {
        let key = self.address.key_of(below);
        Address { bucket: self.address.bucket.clone(), key }.to_string()
    }

    fn path(&self, below: &str) -> anyhow::Result<Path> {
        path(&self.address.key_of(below))
    }

    fn error(&self, err: &object_store::Error, below: &str) -> CloudError {
        self.client.error(err, &self.address.key_of(below))
    }

    /// Reads an object of at most `limit_bytes`; `None` if missing.
    ///
    /// # Errors
    ///
    /// [`CloudError`], or [`FileError::TooLarge`].
    pub(in super::super) fn read(
        &self,
        below: &str,
        limit_bytes: u64,
    ) -> anyhow::Result<Option<Vec<u8>>> {
        let path = self.path(below)?;
        self.client.wait(read(&self.client, &path, limit_bytes))
    }

    /// Reads objects of at most `limit_bytes` each.
    ///
    /// # Errors
    ///
    /// [`CloudError`]. A too large object is an error in its place.
    pub(in super::super) fn read_each(
        &self,
        below: &[String],
        limit_bytes: u64,
    ) -> anyhow::Result<Vec<anyhow::Result<Option<Vec<u8>>>>> {
        let reads = stream::iter(below).map(|below| async move {
            match read(&self.client, &self.path(below)?, limit_bytes).await {
                Err(err) if err.is::<CloudError>() => Err(err),
                read => Ok(read),
            }
        });
        self.client.wait(reads.buffered(AT_ONCE).try_collect())
    }

    /// Stores a new object; false if it exists.
    ///
    /// # Errors
    ///
    /// [`CloudError`].
    pub(in super::super) fn create(&self, below: &str, bytes: &[u8]) -> anyhow::Result<bool> {
        let path = self.path(below)?;
        let created = self.client.wait(create(&self.client, &path, bytes.to_vec().into()));
        Ok(created.map_err(|err| self.error(&err, below))?)
    }

    /// Stores or replaces an object.
    ///
    /// # Errors
    ///
    /// [`CloudError`].
    pub(in super::super) fn replace(&self, below: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let path = self.path(below)?;
        let payload = PutPayload::from(bytes.to_vec());
        let put = whole(async || self.client.store.put(&path, payload.clone()).await);
        self.client.wait(put).map_err(|err| self.error(&err, below))?;
        Ok(())
    }

    /// Stores the file at `file` as a new object; false if it exists. A large file goes in parts.
    /// Multipart uploads can't be conditional; the last writer wins.
    ///
    /// # Errors
    ///
    /// [`CloudError`], or if the file can't be read.
    pub(in super::super) fn create_file(
        &self,
        below: &str,
        file: &FilePath,
    ) -> anyhow::Result<bool> {
        match Parts::of(file)? {
            Parts::One(bytes) => self.create(below, &bytes),
            Parts::Many(parts) => self.store_parts(below, parts).map(|()| true),
        }
    }

    /// Stores the file at `file` as a new or replaced object.
    ///
    /// # Errors
    ///
    /// As [`Prefix::create_file`].
    pub(in super::super) fn replace_file(
        &self,
        below: &str,
        file: &FilePath,
    ) -> anyhow::Result<()> {
        match Parts::of(file)? {
            Parts::One(bytes) => self.replace(below, &bytes),
            Parts::Many(parts) => self.store_parts(below, parts),
        }
    }

    fn store_parts(
        &self,
        below: &str,
        parts: impl Iterator<Item = std::io::Result<Vec<u8>>>,
    ) -> anyhow::Result<()> {
        let path = self.path(below)?;
        let failed = |err: object_store::Error| self.error(&err, below);
        self.client.wait(async {
            let mut upload = self.client.store.put_multipart(&path).await.map_err(failed)?;
            for part in parts {
                let part = part.with_context(|| format!("could not read what {below} is made of"));
                let stored = match part {
                    Ok(part) => {
                        upload.put_part(part.into()).await.map_err(|err| failed(err).into())
                    }
                    Err(err) => Err(err),
                };
                if let Err(err) = stored {
                    // Abort, or the store bills for the parts; report the first error.
                    upload.abort().await.ok();
                    return Err(err);
                }
            }
            upload.complete().await.map_err(failed)?;
            Ok(())
        })
    }

    /// Folder with a copy of an object, called [`FETCHED`]; `None` without the object.
    ///
    /// # Errors
    ///
    /// [`CloudError`], or if the copy can't be written.
    pub(in super::super) fn fetched(&self, below: &str) -> anyhow::Result<Option<Scratch>> {
        let scratch = Scratch::new()?;
        let path = self.path(below)?;
        let to = FilePath::new(FETCHED);
        let is_there = self.client.wait(copy(&self.client, &path, COPY_LIMIT, &scratch, to))?;
        Ok(is_there.then_some(scratch))
    }

    /// Last parts of the keys of all objects below `below`, at every depth.
    ///
    /// # Errors
    ///
    /// [`CloudError`].
    pub(in super::super) fn names(&self, below: &str) -> anyhow::Result<Vec<String>> {
        let mut names = Vec::new();
        let prefix = self.address.key_of(below);
        let listed = self.client.wait(list(&self.client, &prefix, false, &mut |page| {
            let all = page.objects.iter().filter_map(|object| object.location.filename());
            names.extend(all.map(str::to_owned));
        }));
        listed.map_err(|err| self.error(&err, below))?;
        Ok(names)
    }
}

/// Parses `key` as `object_store` names objects.
pub(super) fn path(key: &str) -> anyhow::Result<Path> {
    Path::parse(key).with_context(|| format!("not a name that can be used: {key:?}"))
}

fn is_missing(err: &object_store::Error, client: &Client) -> bool {
    // A missing bucket is a different matter.
    matches!(err, object_store::Error::NotFound { .. })
        && client.error(err, "").why != Why::NoBucket
}

/// Reads an object of at most `limit_bytes`; `None` if missing.
pub(super) async fn read(
    client: &Client,
    path: &Path,
    limit_bytes: u64,
) -> anyhow::Result<Option<Vec<u8>>> {
    let read = whole(async || {
        let found = client.store.get(path).await?;
        if found.meta.size > limit_bytes { Ok(None) } else { found.bytes().await.map(Some) }
    });
    match read.await {
        Ok(Some(bytes)) => Ok(Some(bytes.to_vec())),
        Ok(None) => {
            let path = format!("s3://{}/{path}", client.bucket).into();
            Err(FileError::TooLarge { limit_bytes, path }.into())
        }
        Err(err) if is_missing(&err, client) => Ok(None),
        Err(err) => Err(client.error(&err, path.as_ref()).into()),
    }
}

/// Reads the bytes `range` of an object; `None` if missing.
pub(super) async fn read_range(
    client: &Client,
    path: &Path,
    range: std::ops::Range<u64>,
) -> object_store::Result<Option<Vec<u8>>> {
    if range.is_empty() {
        return Ok(Some(Vec::new()));
    }
    match whole(async || client.store.get_range(path, range.clone()).await).await {
        Ok(bytes) => Ok(Some(bytes.to_vec())),
        Err(err) if is_missing(&err, client) => Ok(None),
        Err(err) => Err(err),
    }
}

/// Copies an object to `to`, up to `limit_bytes`; false if missing.
pub(super) async fn copy(
    client: &Client,
    path: &Path,
    limit_bytes: u64,
    scratch: &Scratch,
    to: &FilePath,
) -> anyhow::Result<bool> {
    let failed = |err: object_store::Error| client.error(&err, path.as_ref());
    let found = match whole(async || client.store.get(path).await).await {
        Ok(found) => found,
        Err(err) if is_missing(&err, client) => return Ok(false),
        Err(err) => return Err(failed(err).into()),
    };
    let mut file = scratch.create(to)?;
    let (mut pieces, mut left) = (found.into_stream(), limit_bytes);
    while let Some(piece) = pieces.next().await {
        let piece = piece.map_err(failed)?;
        let kept = &piece[..piece.len().min(usize::try_from(left).unwrap_or(usize::MAX))];
        file.write_all(kept).map_err(FileError::writing(to))?;
        left -= kept.len() as u64;
        if left == 0 {
            break;
        }
    }
    Ok(true)
}

/// Stores a new object; false if it exists.
async fn create(client: &Client, path: &Path, payload: PutPayload) -> object_store::Result<bool> {
    let mut looks = LOOKS;
    loop {
        // A retry after a lost reply sees AlreadyExists; either copy is right.
        let put = whole(async || {
            let create = PutOptions::from(PutMode::Create);
            client.store.put_opts(path, payload.clone(), create).await
        });
        let taken = match put.await {
            Ok(_) => return Ok(true),
            Err(err @ object_store::Error::AlreadyExists { .. }) => err,
            Err(err) => return Err(err),
        };
        // A refusal may also mean a store by another worker under way, which may still fail.
        match whole(async || client.store.head(path).await).await {
            Ok(_) => return Ok(false),
            Err(object_store::Error::NotFound { .. }) if looks > 0 => {
                looks -= 1;
                sleep(PAUSE).await;
            }
            Err(object_store::Error::NotFound { .. }) => return Err(taken),
            Err(err) => return Err(err),
        }
    }
}

/// Hands the contents of `prefix`, a thousand at a time, to `each`: at every depth if `flat` is
/// false.
pub(super) async fn list(
    client: &Client,
    prefix: &str,
    is_flat: bool,
    each: &mut dyn FnMut(Listing),
) -> object_store::Result<()> {
    let below = if prefix.is_empty() { String::new() } else { format!("{prefix}/") };
    let mut page_token = None;
    loop {
        let page = whole(async || {
            let options = PaginatedListOptions {
                delimiter: is_flat.then_some("/".into()),
                page_token: page_token.clone(),
                ..PaginatedListOptions::default()
            };
            client
                .store
                .list_paginated(
                    Some(&below).filter(|below| !below.is_empty()).map(String::as_str),
                    options,
                )
                .await
        });
        let page = page.await?;
        let folders = page.result.common_prefixes.iter().map(ToString::to_string).collect();
        each(Listing { objects: page.result.objects, folders });
        page_token = page.page_token;
        if page_token.is_none() {
            return Ok(());
        }
    }
}

/// Lists everything directly below `prefix`.
pub(super) async fn listing(client: &Client, prefix: &str) -> object_store::Result<Listing> {
    let mut all = Listing::default();
    list(client, prefix, true, &mut |page| {
        all.objects.extend(page.objects);
        all.folders.extend(page.folders);
    })
    .await?;
    all.folders.sort_unstable();
    Ok(all)
}

/// A file to be stored.
enum Parts<I> {
    One(Vec<u8>),
    Many(I),
}

impl Parts<Box<dyn Iterator<Item = std::io::Result<Vec<u8>>>>> {
    fn of(file: &FilePath) -> anyhow::Result<Self> {
        let mut file = open(file, Links::Followed)?;
        let mut next = move || -> std::io::Result<Option<Vec<u8>>> {
            let mut part = Vec::with_capacity(PART_BYTES);
            (&mut file).take(PART_BYTES as u64).read_to_end(&mut part)?;
            Ok((!part.is_empty()).then_some(part))
        };
        let first = next()?.unwrap_or_default();
        if first.len() < PART_BYTES {
            return Ok(Self::One(first));
        }
        let rest = std::iter::from_fn(move || next().transpose());
        Ok(Self::Many(Box::new(std::iter::once(Ok(first)).chain(rest))))
    }
}
