//! The folder of a rig: a session folder for each camera, and the common places.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::RecordingError;
use boresight_files::{FileError, Links, Overwrite, make_folder, read_text, save};
use boresight_guide::{rig::Place, session::ViewNumber};

const SCHEMA: &str = "boresight.rig-session/1";
const FILE: &str = "rig-session.json";
const LIMIT: u64 = 16 << 20;

/// Contents of `rig-session.json`: the cameras, and the places taken so far.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct RigSessionFile {
    schema: String,
    /// Cameras, in order; each has a session folder of its name.
    pub cameras: Vec<RigSessionCamera>,
    /// True if one trigger starts every exposure.
    pub synchronised: bool,
    /// Common places of the board, in the order in which they were taken.
    places: Vec<PlaceEntry>,
}

/// Camera of a rig's session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct RigSessionCamera {
    /// Name of the camera and of its session folder.
    pub name: String,
    /// Calibration of the same, untouched lens, if given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_lens: Option<PathBuf>,
}

/// Views of one moment.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
struct PlaceEntry {
    /// Number of the place, from 1.
    number: u64,
    /// Number of the view of each camera.
    views: BTreeMap<String, u32>,
}

impl RigSessionFile {
    /// A session without places.
    pub fn new(cameras: Vec<RigSessionCamera>, synchronised: bool) -> Self {
        Self { schema: SCHEMA.into(), cameras, synchronised, places: Vec::new() }
    }

    /// True if `folder` holds a rig's session.
    pub fn is_in(folder: &Path) -> bool {
        folder.join(FILE).is_file()
    }

    /// Reads the file in `folder`.
    ///
    /// # Errors
    ///
    /// [`RecordingError::File`], or [`RecordingError::Header`] if it's of another schema, or a
    /// camera's name is no folder's.
    pub fn read(folder: &Path) -> Result<Self, RecordingError> {
        let path = folder.join(FILE);
        let text = read_text(&path, LIMIT, Links::Refused)?;
        let bad =
            |reason: String| RecordingError::Header { reason, newer: false, path: path.clone() };
        let file: Self = serde_json::from_str(&text).map_err(|err| bad(err.to_string()))?;
        if file.schema != SCHEMA {
            return Err(bad(format!("its schema is {:?}, not {SCHEMA:?}", file.schema)));
        }
        if let Some(camera) = file.cameras.iter().find(|camera| !is_name(&camera.name)) {
            return Err(bad(format!("{:?} is no name of a camera", camera.name)));
        }
        Ok(file)
    }

    /// Writes the file into `folder`, which is made; synced when it returns.
    ///
    /// # Errors
    ///
    /// [`RecordingError::File`].
    pub fn write(&self, folder: &Path) -> Result<(), RecordingError> {
        make_folder(folder)?;
        let path = folder.join(FILE);
        let mut text = serde_json::to_vec_pretty(self)
            .map_err(|err| FileError::writing(&path)(std::io::Error::other(err.to_string())))?;
        text.push(b'\n');
        Ok(save(&path, &text, Overwrite::Allowed)?)
    }

    /// The places taken so far.
    pub fn places(&self) -> Vec<Place> {
        let number = |name: &String| self.cameras.iter().position(|camera| camera.name == *name);
        let place = |entry: &PlaceEntry| {
            let views = entry.views.iter();
            let of = |(name, view): (&String, &u32)| Some((number(name)?, ViewNumber(*view)));
            let mut views: Vec<_> = views.filter_map(of).collect();
            views.sort_by_key(|(camera, _)| *camera);
            Place { number: entry.number, views }
        };
        self.places.iter().map(place).collect()
    }

    /// Names of the cameras.
    pub fn names(&self) -> Vec<String> {
        self.cameras.iter().map(|camera| camera.name.clone()).collect()
    }

    /// Replaces the places.
    pub fn set_places(&mut self, places: &[Place]) {
        let name = |camera: usize| Some(self.cameras.get(camera)?.name.clone());
        let entry = |place: &Place| {
            let views = place.views.iter();
            let of = |(camera, view): &(usize, ViewNumber)| Some((name(*camera)?, view.0));
            PlaceEntry { number: place.number, views: views.filter_map(of).collect() }
        };
        self.places = places.iter().map(entry).collect();
    }
}

/// True if a camera can be called `name`: it names a folder, files and frames of other programs.
pub fn is_name(name: &str) -> bool {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_');
    !name.is_empty() && name.len() <= 64 && name.chars().all(is_plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path().join("rig");
        let camera = |name: &str| RigSessionCamera { name: name.into(), known_lens: None };
        let mut file = RigSessionFile::new(vec![camera("window"), camera("door")], false);
        let place = |number: u64, views: &[(usize, u32)]| Place {
            number,
            views: views.iter().map(|(camera, view)| (*camera, ViewNumber(*view))).collect(),
        };
        let places = [place(1, &[(0, 1), (1, 1)]), place(3, &[(0, 4), (1, 3)])];
        assert!(!RigSessionFile::is_in(&folder));
        file.set_places(&places);
        file.write(&folder).expect("written");
        assert!(RigSessionFile::is_in(&folder));
        assert_eq!(RigSessionFile::read(&folder).expect("readable").places(), places);
    }

    #[test]
    fn a_name_that_leads_out_of_the_folder_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let camera = RigSessionCamera { name: "../door".into(), known_lens: None };
        RigSessionFile::new(vec![camera], false).write(folder.path()).expect("written");
        let refused = RigSessionFile::read(folder.path()).expect_err("no name");
        assert!(matches!(refused, RecordingError::Header { .. }), "{refused}");
        assert!(!is_name("a/b") && !is_name("") && !is_name(".."));
    }
}
