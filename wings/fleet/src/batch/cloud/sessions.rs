//! Sessions below a prefix, and copies.

use std::{
    collections::BTreeMap,
    future::Future,
    io::ErrorKind,
    path::{Path as FilePath, PathBuf},
    pin::Pin,
    sync::{Arc, Mutex, PoisonError, atomic::AtomicBool},
    time::Duration,
};

use futures_util::{StreamExt, TryStreamExt, stream};
use object_store::ObjectMeta;

use super::{
    super::{
        address::Address,
        item::{Content, HEADER, HEADER_LIMIT, Item, JOURNAL, JOURNAL_LIMIT},
    },
    client::{AT_ONCE, Client, Waited},
    objects::{COPY_LIMIT, Listing, Prefix, copy, listing, path, read, read_range},
};
use boresight_app::RESULT_FILE;
use boresight_files::{FileError, Scratch, TEXT_LIMIT};

/// Files of a session beside the journal and the pictures, each with the largest size in bytes.
const FILES: [(&str, u64); 3] =
    [(HEADER, HEADER_LIMIT), (RESULT_FILE, TEXT_LIMIT), ("check.json", TEXT_LIMIT)];
const FRAMES: &str = "frames";
const PICTURE_LIMIT: u64 = 512 << 20;
/// Folders listed before the sessions are handed on.
const CHUNK: usize = 8 * AT_ONCE;
/// Number of a session's objects fetched at a time.
const PIECES_AT_ONCE: usize = 8;

type Found<'a> = &'a mut dyn FnMut(&Item) -> anyhow::Result<()>;

impl Prefix {
    /// Finds the sessions at and below the prefix, in the order of keys, and hands each to `found`.
    ///
    /// # Errors
    ///
    /// [`CloudError`](super::CloudError), or the error of `found`.
    pub(in super::super) fn sessions(&self, found: Found<'_>) -> anyhow::Result<()> {
        let client = &self.client;
        client.wait(async {
            match look(client, self.address.key.clone()).await? {
                Place::Session(item) => found(&item),
                Place::Folders(folders) => walk(client, folders, found).await,
            }
        })
    }
}

enum Place {
    Session(Item),
    Folders(Vec<String>),
}

/// Kind of object or prefix at the key `at`.
async fn look(client: &Client, at: String) -> anyhow::Result<Place> {
    let failed = |err: object_store::Error| client.error(&err, &at);
    let Listing { objects, folders } = listing(client, &at).await.map_err(failed)?;
    let size = |name: &str| {
        let object = objects.iter().find(|object| object.location.filename() == Some(name));
        object.map(|object| object.size)
    };
    let Some(header_size) = size(HEADER) else { return Ok(Place::Folders(folders)) };
    let address = Address { bucket: client.bucket.clone(), key: at.clone() };
    let whole = async |name: &str, size: Option<u64>, limit_bytes: u64| match size {
        None => anyhow::Ok(Err(MISSING)),
        Some(size) if size > limit_bytes => Ok(Err(TOO_LARGE)),
        Some(_) => {
            let object = path(&address.key_of(name))?;
            Ok(read(client, &object, limit_bytes).await?.ok_or(MISSING))
        }
    };
    let header = whole(HEADER, Some(header_size), HEADER_LIMIT).await?;
    let result = whole(RESULT_FILE, size(RESULT_FILE), TEXT_LIMIT).await?;
    let journal = match size(JOURNAL) {
        None => Err(MISSING),
        Some(size) => {
            let journal = path(&address.key_of(JOURNAL))?;
            hash(client, &journal, size)
                .await
                .map_err(failed)?
                .map(|all| (size, all))
                .ok_or(MISSING)
        }
    };
    let content = Content { header, journal, result };
    Ok(Place::Session(content.item(address.to_string())))
}

/// Bytes of a journal requested at a time.
const PART: u64 = 8 << 20;

/// Hash of an object of `size` bytes, equal to a file's; `None` if deleted.
async fn hash(
    client: &Client,
    at: &object_store::path::Path,
    size: u64,
) -> Result<Option<[u8; 32]>, object_store::Error> {
    let (mut hash, mut from) = (hmac_sha256::Hash::new(), 0);
    if size > JOURNAL_LIMIT {
        return Ok(Some([0; 32]));
    }
    while from < size {
        let to = size.min(from + PART);
        let Some(part) = read_range(client, at, from..to).await? else { return Ok(None) };
        hash.update(part);
        from = to;
    }
    Ok(Some(hash.finalize()))
}

/// Codes of `FileError`: a session counts the same in any storage.
const MISSING: &str = "FILE-MISSING";
const TOO_LARGE: &str = "FILE-TOO-LARGE";

/// Looks into each of `folders`, many at a time.
fn walk<'a>(
    client: &'a Client,
    folders: Vec<String>,
    found: Found<'a>,
) -> Pin<Box<dyn Future<Output = anyhow::Result<()>> + 'a>> {
    Box::pin(async move {
        for chunk in folders.chunks(CHUNK) {
            let looks = stream::iter(chunk).map(|folder| look(client, folder.clone()));
            // Complete all of these before the next: an unpolled request would run out of time.
            let places: Vec<Place> = looks.buffered(AT_ONCE).try_collect().await?;
            for place in places {
                match place {
                    Place::Session(item) => found(&item)?,
                    Place::Folders(folders) => walk(client, folders, found).await?,
                }
            }
        }
        Ok(())
    })
}

/// Result of fetching a session.
pub(in super::super) enum Fetched {
    /// A whole copy.
    Whole,
    /// The session is larger than this many bytes.
    TooLarge(u64),
    /// Fetching took longer than allowed.
    TooLong,
    /// The batch was asked to stop.
    Stopped,
}

/// Buckets of sessions, opened when the first session is fetched.
#[derive(Debug, Default)]
pub(in super::super) struct Sessions {
    buckets: Mutex<BTreeMap<String, Arc<Client>>>,
}

impl Sessions {
    fn bucket(&self, name: &str) -> anyhow::Result<Arc<Client>> {
        let mut buckets = self.buckets.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(client) = buckets.get(name) {
            return Ok(Arc::clone(client));
        }
        let client = Client::open(name)?;
        buckets.insert(name.to_owned(), Arc::clone(&client));
        Ok(client)
    }

    /// Copies the session at the address `session` into `scratch`, under the address as a relative
    /// path. Copies nothing but the files of a session; without `pictures`, only their names and
    /// lengths.
    ///
    /// # Errors
    ///
    /// [`CloudError`](super::CloudError), or if the copy can't be written.
    pub(in super::super) fn fetch(
        &self,
        session: &str,
        pictures: bool,
        scratch: &Scratch,
        (budget, stop): (Duration, &AtomicBool),
    ) -> anyhow::Result<Fetched> {
        let address = Address::parse(session)?;
        let client = self.bucket(&address.bucket)?;
        let fetch = fetch(&client, &address, pictures, scratch);
        match client.wait_within(fetch, budget, stop) {
            Waited::Done(fetched) => fetched,
            Waited::TooLong => Ok(Fetched::TooLong),
            Waited::Stopped => Ok(Fetched::Stopped),
        }
    }
}

async fn fetch(
    client: &Client,
    address: &Address,
    pictures: bool,
    scratch: &Scratch,
) -> anyhow::Result<Fetched> {
    let failed = |err: object_store::Error| client.error(&err, &address.key);
    let here = listing(client, &address.key).await.map_err(failed)?;
    let frames = address.key_of(FRAMES);
    let mut wanted = here.objects;
    if here.folders.contains(&frames) {
        wanted.extend(listing(client, &frames).await.map_err(failed)?.objects);
    }
    let wanted: Vec<(ObjectMeta, Part)> = wanted
        .into_iter()
        .filter_map(|object| {
            let part = Part::of(object.location.as_ref().strip_prefix(&address.key)?)?;
            Some((object, part))
        })
        .collect();
    let is_copied = |part: &Part, size: u64| {
        size > 0 && size <= part.limit_bytes && (pictures || !part.is_picture)
    };
    let bytes = wanted.iter().filter(|(object, part)| is_copied(part, object.size));
    let bytes = bytes.fold(0_u64, |sum, (object, _)| sum.saturating_add(object.size));
    if bytes > COPY_LIMIT {
        return Ok(Fetched::TooLarge(COPY_LIMIT));
    }
    let copies = wanted.iter().map(|(object, part)| async move {
        let to = relative(address, &part.name);
        if is_copied(part, object.size) {
            let copied = copy(client, &object.location, object.size, scratch, &to).await;
            return copied.map(|_| ()).or_else(unless_unnameable);
        }
        // Only the length is used.
        let made = scratch.create(&to);
        let made = made.and_then(|file| file.set_len(object.size).map_err(FileError::writing(&to)));
        made.map_err(Into::into).or_else(unless_unnameable)
    });
    stream::iter(copies).buffer_unordered(PIECES_AT_ONCE).try_collect::<()>().await?;
    Ok(Fetched::Whole)
}

/// Treats an error about a name as the session's own: the name can't be a file's, or is taken here.
/// The session then comes out as a different one.
fn unless_unnameable(err: anyhow::Error) -> anyhow::Result<()> {
    match err.downcast_ref::<FileError>() {
        Some(FileError::Exists { .. }) => Ok(()),
        Some(FileError::Write { source, .. }) if source.kind() == ErrorKind::InvalidFilename => {
            Ok(())
        }
        _ => Err(err),
    }
}

/// Relative path of a session from its address, with a file below.
fn relative(address: &Address, name: &str) -> PathBuf {
    FilePath::new(&address.to_string()).join(name)
}

/// A possible file of a session.
#[derive(Debug, PartialEq, Eq)]
struct Part {
    name: String,
    limit_bytes: u64,
    is_picture: bool,
}

impl Part {
    /// Part for the file `below` a session; `None` for anything else.
    fn of(below: &str) -> Option<Self> {
        let name = below.trim_start_matches('/');
        let part =
            |limit_bytes, is_picture| Some(Self { name: name.to_owned(), limit_bytes, is_picture });
        if name == JOURNAL {
            return part(COPY_LIMIT, false);
        }
        if let Some((_, limit_bytes)) = FILES.iter().find(|(known, _)| *known == name) {
            return part(*limit_bytes, false);
        }
        let picture = name.strip_prefix("frames/")?.strip_suffix(".png")?;
        let is_plain = !picture.is_empty() && picture.len() <= 100 && !picture.contains('/');
        if is_plain { part(PICTURE_LIMIT, true) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_but_the_files_of_a_session_is_fetched() {
        for name in ["session.toml", "journal.jsonl", "calibration.json", "check.json"] {
            assert!(Part::of(&format!("/{name}")).is_some_and(|part| !part.is_picture), "{name}");
        }
        let picture = Part::of("/frames/00000018.png").expect("a picture");
        assert_eq!((picture.name.as_str(), picture.is_picture), ("frames/00000018.png", true));
        for other in [
            "/truth.json",
            "/report.html",
            "/frames/notes.txt",
            "/frames/.png",
            "/frames/a/b.png",
            "/more/session.toml",
            "",
        ] {
            assert_eq!(Part::of(other), None, "{other}");
        }
    }

    #[test]
    fn codes_are_those_of_files() {
        let missing = std::io::ErrorKind::NotFound.into();
        assert_eq!(FileError::reading(FilePath::new("x"))(missing).code(), MISSING);
        let large = FileError::TooLarge { limit_bytes: 1, path: "x".into() };
        assert_eq!(large.code(), TOO_LARGE);
    }
}
