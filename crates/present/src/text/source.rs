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
