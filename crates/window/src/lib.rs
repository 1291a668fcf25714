//! The window: guidance by picture, words and sound, and the result.
//!
//! Panels see a [`Screen`] only: the newest [`boresight_guide::session::Snapshot`], the newest
//! picture and the person's preferences. They put requests into a list of [`UiAction`]s; [`App`]
//! carries them out. The window never waits: pictures and snapshots are latest-wins, commands go
//! out when there is room, and sessions end and are stored in the background.
//!
//! | file | is |
//! |---|---|
//! | `run` | the window system: opens, or reports a failure |
//! | `window_icon` | its icon |
//! | `app` | pages, keys, the session behind them |
//! | `session_state` | a session from its start to its stored result |
//! | `screen`, `picture`, `theme` | inputs of the panels, and colours |
//! | `known_map` | what is known of the picture, on the picture |
//! | `keys`, `sound` | actions by hand; tones |
//! | `aloud` | announcements of a screen reader |
//! | `start` | camera, board and plan of the next session |
//! | `guide` | live picture, overlay, sentence, gauges, numbers, controls, accepted views |
//! | `result` | verdict, findings, numbers, exports, change since an older calibration |
//! | `rig`, `rig_window` | several cameras: pictures, links and one sentence; their own window |
//! | `replay` | a recording, chosen from a list or by its path, decision by decision |
//! | `adjust` | the way back of a watched camera |
//! | `settings` | looks and sounds of the window |
//! | `user_error` | a failed start of a session |

#![forbid(unsafe_code)]

mod aloud;
mod app;
pub mod guide;
pub mod keys;
mod known_map;
pub mod open;
pub mod picture;
pub mod program_services;
pub mod replay;
pub mod result;
pub mod rig;
pub mod rig_window;
mod run;
pub mod screen;
mod session_state;
pub mod settings;
pub mod sound;
pub mod start;
pub mod theme;
pub mod user_error;
mod window_icon;

pub use app::{App, Page};
pub use keys::UiAction;
pub use picture::{Dressing, Part, Picture, Placed};
pub use run::{NoWindow, open, options, run, run_replay};
pub use screen::{Preferences, Screen};
pub use theme::{SMALLEST, apply as apply_theme};
