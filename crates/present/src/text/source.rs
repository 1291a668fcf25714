//! Sources of pictures.

use std::path::Path;

/// A resumed session doesn't connect to an address by itself.
pub fn address_is_asked_for(address: &str, session: &Path) -> String {
    format!(
        "this session's pictures came over the network, from {address}. To continue, give the address again: boresight guide --session {} --source ADDRESS",
        session.display()
    )
}
