//! Area of the picture covered by boards.

use boresight_geometry::{BoardOutline, Corner, boards::Board};

/// Outlines of the boards in `views`.
pub(crate) fn outlines(board: &Board, views: &[Vec<Corner>]) -> Vec<BoardOutline> {
    let outline = |view: &Vec<Corner>| {
        let px: Vec<_> = view.iter().map(|corner| corner.px).collect();
        board.target().outline(&px, &|index| view[index].is_seen())
    };
    views.iter().filter_map(outline).collect()
}
