//! Places and numbers of the markers of a board.

/// Places of the light squares and the markers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// The square in the top-left corner is dark.
    Present,
    /// Up to OpenCV 4.5: the square in the top-left corner is light if the number of rows is even.
    Legacy,
    /// Tags of an AprilGrid, in every second square of every second row.
    Tags {
        /// The first tag is in the top row, not in the bottom row.
        from_top: bool,
        /// The tags are turned by half from the dictionary's.
        half_turned: bool,
    },
}

impl Layout {
    /// Both layouts of a ChArUco board, the present layout first.
    pub const ALL: [Self; 2] = [Self::Present, Self::Legacy];
    /// Layouts of an AprilGrid: first Kalibr's, with tags numbered from the bottom and turned as in
    /// AprilTag's own pictures, a half turn from OpenCV's. Other programs number from the top, or
    /// draw OpenCV's.
    pub const TAGS: [Self; 4] = [
        Self::Tags { from_top: false, half_turned: true },
        Self::Tags { from_top: true, half_turned: true },
        Self::Tags { from_top: false, half_turned: false },
        Self::Tags { from_top: true, half_turned: false },
    ];

    /// True if the markers are turned by half from the dictionary's.
    pub(super) fn is_half_turned(self) -> bool {
        matches!(self, Self::Tags { half_turned: true, .. })
    }

    /// Number of the marker in a square of a board of `columns` × `rows` *squares*; `None` in a
    /// square without a marker and outside of the board.
    pub fn marker_at(
        self,
        [column, row]: [usize; 2],
        [columns, rows]: [usize; 2],
    ) -> Option<usize> {
        if let Self::Tags { from_top, .. } = self {
            let has_tag = column < columns && row < rows && column % 2 == 1 && row % 2 == 1;
            let row = if from_top { row } else { rows.checked_sub(row + 1)? };
            return has_tag.then(|| row / 2 * (columns / 2) + column / 2);
        }
        if column >= columns || row >= rows || !self.is_light([column as i32, row as i32], rows) {
            return None;
        }
        // Light squares in the first columns of a row: one more if the row begins with a light
        // square.
        let first_is_light = usize::from(self.is_light([0, 0], rows));
        let before = |row: usize, columns: usize| (columns + (row + first_is_light) % 2) / 2;
        let above = row / 2 * columns + if row % 2 == 1 { before(0, columns) } else { 0 };
        Some(above + before(row, column))
    }

    /// True if a square is light on a board with `rows` rows of squares. The pattern continues
    /// outside of the board.
    pub fn is_light(self, [column, row]: [i32; 2], rows: usize) -> bool {
        let first_is_light = self == Self::Legacy && rows.is_multiple_of(2);
        (column + row).rem_euclid(2) == i32::from(!first_is_light)
    }
}

/// Number of markers on a board of `columns` × `rows` squares in the present layout, which has
/// fewer.
pub fn marker_count([columns, rows]: [usize; 2]) -> usize {
    columns * rows / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kalibr's documentation has the numbers of a grid of 2 x 2 tags.
    #[test]
    fn tags_are_numbered_from_the_bottom_or_the_top() {
        let numbers = |layout: Layout| {
            [[1, 1], [3, 1], [1, 3], [3, 3]].map(|square| layout.marker_at(square, [5, 5]))
        };
        assert_eq!(numbers(Layout::TAGS[0]), [2, 3, 0, 1].map(Some));
        assert_eq!(numbers(Layout::TAGS[1]), [0, 1, 2, 3].map(Some));
        for layout in Layout::TAGS {
            for square in [[0, 0], [2, 2], [1, 2], [2, 1], [5, 1], [1, 5]] {
                assert_eq!(layout.marker_at(square, [5, 5]), None, "{square:?}");
            }
        }
    }

    #[test]
    fn markers_are_numbered_row_by_row() {
        for layout in Layout::ALL {
            for size in [[8, 11], [7, 5], [5, 8], [4, 4], [11, 8]] {
                let [columns, rows] = size;
                let mut next = 0;
                for row in 0..rows {
                    for column in 0..columns {
                        let first_is_light = layout == Layout::Legacy && rows % 2 == 0;
                        let light = ((column + row) % 2 == 1) != first_is_light;
                        let number = layout.marker_at([column, row], size);
                        assert_eq!(
                            number,
                            light.then_some(next),
                            "{layout:?} {size:?} {column} {row}"
                        );
                        next += usize::from(light);
                    }
                }
                assert!(next >= marker_count(size) && next <= marker_count(size) + 1);
                assert_eq!(layout.marker_at([columns, 0], size), None);
            }
        }
    }
}
