//! Back room of the window: what the window asks of the program, and what its start page needs.
//!
//! | file | does |
//! |---|---|
//! | `services` | questions of the window to the program |
//! | `lookout` | live pictures of all cameras |
//! | `printed_board` | a board as a sheet, opened |
//! | `memory` | choices of earlier windows |
//! | `recordings` | recordings: listed, and stepped through |
//! | `desktop` | display, and files opened by the desktop |

pub mod desktop;
pub mod lookout;
pub mod memory;
pub mod printed_board;
pub mod recordings;
pub mod services;

pub use memory::usual_path as usual_memory;
pub use services::Services;
