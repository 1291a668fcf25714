//! Pictures that another program writes: the standard output of a command, or our standard input.
//!
//! | file | holds |
//! |---|---|
//! | `source` | the frame source: waits, loses the command and starts it again |
//! | `feed` | the command as a child, or standard input: bytes, messages, and how it ended |
//! | `cutter`, `still` | bytes → pictures |
//! | `what_it_is` | what a stream is that holds no pictures we read |

mod cutter;
mod feed;
mod source;
mod still;
#[cfg(test)]
mod tests;
mod what_it_is;

pub use source::Pipe;
