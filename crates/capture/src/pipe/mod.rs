//! Pictures from another program: the standard output of a command, or our standard input.
//!
//! | file | holds |
//! |---|---|
//! | `source` | the frame source: waits, loses the command and restarts it |
//! | `feed` | the command as a child, or standard input: bytes, messages, and its end |
//! | `cutter`, `still` | bytes → pictures |
//! | `what_it_is` | kind of a stream without readable pictures |

mod cutter;
mod feed;
mod source;
mod still;
#[cfg(test)]
mod tests;
mod what_it_is;

pub use source::Pipe;
