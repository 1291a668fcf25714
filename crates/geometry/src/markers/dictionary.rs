//! Common dictionaries of ArUco markers.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// Dictionary of markers, by OpenCV's name. The default is `DICT_4X4_50`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&str")]
pub struct Dictionary {
    /// Index in [`TABLE`].
    index: u8,
}

struct Entry {
    name: &'static str,
    /// Number of cells along a side, without the frame.
    side: usize,
    count: usize,
    /// Index of the first byte in [`CODES`].
    start: usize,
}

/// Cells of every marker, row by row, 1 for white: right-aligned in the fewest whole bytes, the
/// highest byte first. The small dictionaries of a family are the beginning of the large one. Made
/// by OpenCV's authors (Apache-2.0), the `APRILTAG` ones by the April Robotics Laboratory
/// (BSD-2-Clause).
static CODES: &[u8] = include_bytes!("dictionaries.bin");

const fn entry(name: &'static str, side: usize, count: usize, start: usize) -> Entry {
    Entry { name, side, count, start }
}

const TABLE: [Entry; 22] = [
    entry("DICT_4X4_50", 4, 50, 0),
    entry("DICT_4X4_100", 4, 100, 0),
    entry("DICT_4X4_250", 4, 250, 0),
    entry("DICT_4X4_1000", 4, 1000, 0),
    entry("DICT_5X5_50", 5, 50, 2000),
    entry("DICT_5X5_100", 5, 100, 2000),
    entry("DICT_5X5_250", 5, 250, 2000),
    entry("DICT_5X5_1000", 5, 1000, 2000),
    entry("DICT_6X6_50", 6, 50, 6000),
    entry("DICT_6X6_100", 6, 100, 6000),
    entry("DICT_6X6_250", 6, 250, 6000),
    entry("DICT_6X6_1000", 6, 1000, 6000),
    entry("DICT_7X7_50", 7, 50, 11_000),
    entry("DICT_7X7_100", 7, 100, 11_000),
    entry("DICT_7X7_250", 7, 250, 11_000),
    entry("DICT_7X7_1000", 7, 1000, 11_000),
    entry("DICT_ARUCO_ORIGINAL", 5, 1024, 18_000),
    entry("DICT_APRILTAG_16h5", 4, 30, 22_096),
    entry("DICT_APRILTAG_25h9", 5, 35, 22_156),
    entry("DICT_APRILTAG_36h10", 6, 2320, 22_296),
    entry("DICT_APRILTAG_36h11", 6, 587, 33_896),
    entry("DICT_ARUCO_MIP_36h12", 6, 250, 36_831),
];

/// Error of a name that isn't a dictionary's.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no dictionary of markers: {name:?}; there are {}", list())]
pub struct NoDictionary {
    name: String,
}

fn list() -> String {
    let names = TABLE.iter().map(|entry| entry.name);
    names.collect::<Vec<_>>().join(", ")
}

impl Dictionary {
    /// Largest dictionary of each family.
    pub fn families() -> impl Iterator<Item = Self> {
        Self::all().filter(|dictionary| dictionary.family() == *dictionary)
    }

    /// Largest dictionary of the family, with the same markers under the same numbers.
    #[must_use]
    pub fn family(self) -> Self {
        let start = |dictionary: Self| TABLE[usize::from(dictionary.index)].start;
        Self::all().filter(|other| start(*other) == start(self)).last().unwrap_or(self)
    }

    /// All dictionaries.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..TABLE.len() as u8).map(|index| Self { index })
    }

    /// AprilTag's family 36h11.
    pub(super) fn of_tags() -> Self {
        const TAGS: usize = 20;
        Self { index: TAGS as u8 }
    }

    fn entry(self) -> &'static Entry {
        &TABLE[usize::from(self.index)]
    }

    /// Name in OpenCV.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// Number of cells along a marker's side, without the frame.
    pub fn side_cells(self) -> usize {
        self.entry().side
    }

    /// Number of markers.
    pub fn count(self) -> usize {
        self.entry().count
    }

    /// Cells of a marker, row by row from the highest of [`side_cells`](Self::side_cells)² bits, 1
    /// for white; `None` without such a marker.
    pub fn code(self, number: usize) -> Option<u64> {
        let Entry { side, count, start, .. } = self.entry();
        let length = (side * side).div_ceil(8);
        let at = start + number * length;
        let bytes = CODES.get(at..at + length).filter(|_| number < *count)?;
        Some(bytes.iter().fold(0, |code, byte| code << 8 | u64::from(*byte)))
    }

    /// True if a marker has this [code](Self::code).
    pub fn has(self, code: u64) -> bool {
        (0..self.count()).any(|number| self.code(number) == Some(code))
    }

    /// True if a cell of a marker is black, like all cells of the frame. Rows and columns count the
    /// frame. `None` without such a marker.
    pub fn is_black(self, number: usize, cell: [usize; 2]) -> Option<bool> {
        Some(self.is_black_in(self.code(number)?, 1, cell))
    }

    /// True if a cell of a marker with this code is black, inside a frame of the given number of
    /// cells.
    pub(super) fn is_black_in(self, code: u64, frame: usize, [column, row]: [usize; 2]) -> bool {
        let side = self.side_cells();
        let inside = frame..frame + side;
        if !inside.contains(&column) || !inside.contains(&row) {
            return true;
        }
        let place = (row - frame) * side + column - frame;
        code >> (side * side - 1 - place) & 1 == 0
    }
}

impl fmt::Display for Dictionary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl From<Dictionary> for &str {
    fn from(dictionary: Dictionary) -> Self {
        dictionary.name()
    }
}

impl TryFrom<String> for Dictionary {
    type Error = NoDictionary;

    fn try_from(name: String) -> Result<Self, NoDictionary> {
        name.parse()
    }
}

impl FromStr for Dictionary {
    type Err = NoDictionary;

    /// Parses a name in capitals or small letters, with or without `DICT_`.
    fn from_str(text: &str) -> Result<Self, NoDictionary> {
        let bare = |name: &str| {
            let name = name.trim().to_ascii_uppercase();
            name.strip_prefix("DICT_").map(str::to_owned).unwrap_or(name)
        };
        let wanted = bare(text);
        let found = Self::all().find(|dictionary| bare(dictionary.name()) == wanted);
        found.ok_or_else(|| NoDictionary { name: text.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_in_any_case() {
        for dictionary in Dictionary::all() {
            assert_eq!(dictionary.name().parse(), Ok(dictionary));
            assert_eq!(dictionary.name().to_lowercase().parse(), Ok(dictionary));
        }
        assert_eq!("4x4_50".parse::<Dictionary>().map(Dictionary::count), Ok(50));
        assert!("DICT_9X9_50".parse::<Dictionary>().is_err());
    }

    #[test]
    fn the_tags_of_an_aprilgrid_are_of_the_family_36h11() {
        assert_eq!(Dictionary::of_tags().name(), "DICT_APRILTAG_36h11");
    }

    #[test]
    fn every_marker_is_there_and_unlike_the_others() {
        let ends = Dictionary::all().map(|dictionary| {
            let side = dictionary.side_cells();
            let codes: Vec<u64> =
                (0..dictionary.count()).map(|i| dictionary.code(i).expect("a marker")).collect();
            assert!(codes.iter().all(|code| code >> (side * side) == 0));
            let mut distinct = codes.clone();
            distinct.sort_unstable();
            distinct.dedup();
            assert_eq!(distinct.len(), codes.len(), "{dictionary}");
            assert_eq!(dictionary.code(dictionary.count()), None);
            let length = (side * side).div_ceil(8);
            dictionary.entry().start + length * dictionary.count()
        });
        assert_eq!(ends.max(), Some(CODES.len()));
    }

    /// First marker of the smallest dictionary, as printed everywhere.
    #[test]
    fn the_first_marker_has_its_known_cells() {
        let dictionary: Dictionary = "DICT_4X4_50".parse().expect("known");
        let rows = ["1011", "0101", "0011", "0010"];
        for (row, cells) in rows.iter().enumerate() {
            for (column, cell) in cells.chars().enumerate() {
                assert_eq!(dictionary.is_black(0, [column + 1, row + 1]), Some(cell == '0'));
            }
        }
        for place in 0..6 {
            for cell in [[place, 0], [place, 5], [0, place], [5, place]] {
                assert_eq!(dictionary.is_black(0, cell), Some(true));
            }
        }
    }
}
