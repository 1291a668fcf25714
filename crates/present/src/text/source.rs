//! Sources of pictures.

use std::path::Path;

/// Refusal of a resumed session to connect to an address unasked.
pub fn address_is_asked_for(address: &str, session: &Path) -> String {
    format!(
        "this session's pictures came over the network, from {address}. To continue, give the address again: boresight guide --session {} --source ADDRESS",
        session.display()
    )
}

/// Refusal of a resumed session to run a command unasked.
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

/// Error of opening a resumed session's source.
pub fn source_is_asked_for(source: &str, session: &Path) -> String {
    format!(
        "could not open this session's source {source} (if it's elsewhere now: boresight guide --session {} --source SOURCE)",
        session.display()
    )
}

/// Error of a session stopped before the result was written.
pub fn no_result_yet(session: &Path) -> String {
    format!(
        "this session has no result yet. To continue it, or to end it and get one: boresight guide --session {}",
        session.display()
    )
}

/// Note about pictures of several sizes only because of orientation marks.
pub const ALIKE_AS_STORED: &str =
    "The phone was held differently. To read the pictures as the camera stored them: --as-stored";

/// Maximum number of names in a sentence.
const MOST_NAMED: usize = 5;

/// Note about pictures of a folder left out because of an unsupported format.
pub fn pictures_left_out(names: &[String]) -> String {
    let (named, others) = names.split_at(names.len().min(MOST_NAMED));
    let named = named.join(", ");
    let others = match others.len() {
        0 => String::new(),
        count => format!(" and {count} more"),
    };
    format!(
        "Left out, because they can't be read: {named}{others}. To use them, convert them to PNG."
    )
}

/// Refusal of a command named by a phone.
pub const NO_COMMAND_BY_PHONE: &str = "a command can only be given on the computer that runs boresight: boresight serve --source 'pipe:COMMAND'";

/// Refusal to give an untrustworthy result to a camera's driver.
pub const NOT_FOR_THE_DRIVER: &str =
    "The camera's driver keeps its old calibration: the result isn't trustworthy.";

/// Note that the camera's driver took the result, with `words` from the driver, possibly empty.
pub fn driver_has_it(service: &str, words: &str) -> String {
    let words = if words.is_empty() { String::new() } else { format!(" ({words})") };
    format!("{service} took the calibration{words}.")
}

/// Error of a camera's driver without the result of `session`.
pub fn driver_lacks_it(why: &str, session: &Path) -> String {
    format!(
        "The camera's driver keeps its old calibration: {why}. To try again: boresight export {} --set-camera-info ros2:/TOPIC",
        session.display()
    )
}
