//! The power fails, the program is killed, or the disk is full at any instant of a watch: the store
//! opens, and its references are those of its lines.

use std::{
    collections::{BTreeMap, HashSet},
    fs,
    hash::{DefaultHasher, Hash, Hasher},
    path::{Path, PathBuf},
    sync::Arc,
};

use boresight::{
    files::{DiskLog, LoggedChange},
    frame::ImageSize,
    geometry::Camera,
    station::{Taken, WatchedCamera, accept, street::Street},
    watch::Lens,
};
use nalgebra::Point2;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::power_cut::{Disk, Fate, chances};

const STORE: &str = "cam";
const HOURS: u32 = 13;
/// Hour in which the camera is accepted.
const ACCEPTED: u32 = 12;

struct Mast {
    street: Street,
}

impl Mast {
    fn new() -> Self {
        let mut street = Street::new(7);
        street.image_size = ImageSize { width_px: 320, height_px: 240 };
        street.camera = Camera::pinhole(210.0, Point2::new(163.0, 118.0));
        Self { street }
    }

    fn open(&self, folder: &Path) -> anyhow::Result<WatchedCamera> {
        let lens = Lens::new(self.street.camera, None, self.street.image_size);
        Ok(WatchedCamera::open(folder, "mast", None, (Some(lens), false))?.0)
    }

    fn look(&self, camera: &mut WatchedCamera, hour: u32) -> anyhow::Result<()> {
        let at_secs = self.street.began_secs + 3600.0 * f64::from(hour);
        camera.look(vec![self.street.picture(at_secs)], Taken::at(at_secs))?;
        Ok(())
    }
}

/// Told after a number of changes: pictures and references.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Told {
    changes: usize,
    pictures: u64,
    references: usize,
}

impl Told {
    fn of(camera: &WatchedCamera, changes: usize) -> Self {
        let references = camera.station().gallery.references.len();
        Self { changes, pictures: camera.pictures().iter().sum(), references }
    }
}

/// Fault of a state of the disk, between two statements.
fn fault(
    left: &BTreeMap<PathBuf, Option<Vec<u8>>>,
    mast: &Mast,
    [before, after]: [Option<Told>; 2],
) -> Option<String> {
    let place = TempDir::new().expect("folder");
    for (path, bytes) in left {
        let at = place.path().join(path);
        match bytes {
            None => fs::create_dir_all(at).expect("made"),
            Some(bytes) => fs::write(at, bytes).expect("written"),
        }
    }
    let folder = place.path().join(STORE);
    let mut camera = match mast.open(&folder) {
        Ok(camera) => camera,
        Err(err) => return Some(format!("{err:#}")),
    };
    let now = Told::of(&camera, 0);
    let may_be = [before, after].into_iter().flatten();
    let least = before.map_or(0, |told| told.pictures);
    let is_kept = before.is_none() || may_be.map(|t| t.references).any(|n| n == now.references);
    if now.pictures < least || !is_kept {
        return Some(format!("{now:?} instead of {before:?} or {after:?}"));
    }
    // It goes on, and stays so.
    if let Err(err) = mast.look(&mut camera, 40) {
        return Some(format!("going on: {err:#}"));
    }
    let now = Told::of(&camera, 0);
    drop(camera);
    match WatchedCamera::look_at(&folder).map(|camera| Told::of(&camera, 0)) {
        Ok(again) if again == now => None,
        other => Some(format!("{now:?}, and then {other:?}")),
    }
}

#[test]
fn no_power_cut_costs_a_watched_camera_its_references() {
    let place = TempDir::new().expect("folder");
    let log = Arc::new(DiskLog::of(place.path()));
    let mut disk = Disk::holding(place.path());
    let (mast, folder) = (Mast::new(), place.path().join(STORE));
    let mut camera = mast.open(&folder).expect("opened");
    let mut told = vec![Told::of(&camera, log.changes().len())];
    for hour in 0..HOURS {
        if hour == ACCEPTED {
            accept(&folder, 2e9, "new pole").expect("accepted");
        }
        mast.look(&mut camera, hour).expect("looked");
        told.push(Told::of(&camera, log.changes().len()));
    }
    assert_eq!((told[7].references > 0, told[HOURS as usize].references), (true, 0), "{told:?}");
    let changes = log.changes();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut tried, mut different, mut faults) = (0, HashSet::new(), Vec::new());
    for (at, change) in changes.iter().enumerate() {
        disk.apply(change);
        let is_line = matches!(change, LoggedChange::Append { path, .. } | LoggedChange::SyncFile(path)
            if path.ends_with("watch.jsonl"));
        if at % 5 != 0 && !is_line {
            continue;
        }
        let before = told.iter().rev().find(|told| told.changes <= at + 1).copied();
        let after = told.iter().find(|told| told.changes > at + 1).copied();
        let fates = [Fate::Least, Fate::Most, Fate::NamesOnly].into_iter();
        for fate in fates.chain(std::iter::repeat_n(Fate::Chance, chances())) {
            let left = disk.left(fate, &mut rng);
            tried += 1;
            let mut hasher = DefaultHasher::new();
            left.hash(&mut hasher);
            if !different.insert((hasher.finish(), before.map(|told| told.changes))) {
                continue;
            }
            if let Some(what) = fault(&left, &mast, [before, after]) {
                println!("after {at} changes, {fate:?}: {what}");
                faults.push(what);
            }
        }
    }
    println!(
        "{} changes: {tried} states tried, {} different; {} faults",
        changes.len(),
        different.len(),
        faults.len()
    );
    assert!(tried > 100, "{tried}");
    assert_eq!(faults.len(), 0);
}
