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
