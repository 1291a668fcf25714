//! Sources of pictures.

use std::path::Path;

/// A resumed session doesn't connect to an address by itself.
pub fn address_is_asked_for(address: &str, session: &Path) -> String {
    format!(
        "this session's pictures came over the network, from {address}. To continue, give the address again: boresight guide --session {} --source ADDRESS",
        session.display()
    )
}

/// A resumed session doesn't run a command by itself.
pub fn command_is_asked_for(command: &str, session: &Path) -> String {
    let session = session.display();
    if command == "pipe:-" {
        return format!(
            "this session's pictures came through standard input. To continue, send them again: COMMAND | boresight guide --session {session} --source -"
        );
    }
    format!(
        "this session's pictures came from a command: {command}. To continue, give the command again: boresight guide --session {session} --source 'pipe:COMMAND'"
    )
}

/// The source of a resumed session can't be opened.
pub fn source_is_asked_for(source: &str, session: &Path) -> String {
    format!(
        "could not open this session's source {source} (if it's elsewhere now: boresight guide --session {} --source SOURCE)",
        session.display()
    )
}

/// A session that was stopped before it wrote its result.
pub fn no_result_yet(session: &Path) -> String {
    format!(
        "this session has no result yet. To continue it, or to end it and get one: boresight guide --session {}",
        session.display()
    )
}

/// Pictures have several sizes only because they were turned as their marks say.
pub const ALIKE_AS_STORED: &str =
    "The phone was held differently. To read the pictures as the camera stored them: --as-stored";

/// Most names that a sentence lists.
const MOST_NAMED: usize = 5;

/// Pictures of a folder are left out, because they're of a kind that isn't read.
pub fn pictures_left_out(names: &[String]) -> String {
    let (named, others) = names.split_at(names.len().min(MOST_NAMED));
    let named = named.join(", ");
    let others = match others.len() {
        0 => String::new(),
        count => format!(" and {count} more"),
    };
    format!(
        "Left out, because only PNG and JPEG are read: {named}{others}. To use them, convert them."
    )
}

/// A phone names no command.
pub const NO_COMMAND_BY_PHONE: &str = "a command can only be given on the computer that runs boresight: boresight serve --source 'pipe:COMMAND'";

/// An untrustworthy result isn't given to a camera's driver.
pub const NOT_FOR_THE_DRIVER: &str =
    "The camera's driver keeps its old calibration: the result is NOT TRUSTWORTHY.";

/// The camera's driver took the result, and said `words`, which may be empty.
pub fn driver_has_it(service: &str, words: &str) -> String {
    let words = if words.is_empty() { String::new() } else { format!(" ({words})") };
    format!("{service} took the calibration{words}.")
}

/// The camera's driver didn't get the result of `session`.
pub fn driver_lacks_it(why: &str, session: &Path) -> String {
    format!(
        "The camera's driver keeps its old calibration: {why}. To try again: boresight export {} --set-camera-info ros2:/TOPIC",
        session.display()
    )
}
