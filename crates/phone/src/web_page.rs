//! The page that calibrates in a browser: one file, served unchanged.

use std::net::SocketAddr;

use axum::{
    Router,
    body::Bytes,
    http::header::{CACHE_CONTROL, CONTENT_TYPE},
    routing::get,
};

use super::{
    address::ServeAddress,
    error::ServeError,
    server::{Served, bind},
};

/// Served file. Ends when dropped.
pub struct WebPage {
    _served: Served,
    address: SocketAddr,
}

impl WebPage {
    /// Serves `page` at `address`.
    ///
    /// # Errors
    ///
    /// [`ServeError`].
    pub fn serve(address: ServeAddress, page: Vec<u8>) -> Result<Self, ServeError> {
        let listener = bind(address)?;
        let address = listener.local_addr().map_err(ServeError::Thread)?;
        let page = Bytes::from(page);
        let answer = move || async move {
            ([(CONTENT_TYPE, "text/html; charset=utf-8"), (CACHE_CONTROL, "no-cache")], page)
        };
        let served = Served::start(listener, None, Router::new().route("/", get(answer)))?;
        Ok(Self { _served: served, address })
    }

    /// True if every network interface of the computer serves the page.
    pub fn is_on_every_interface(&self) -> bool {
        self.address.ip().is_unspecified()
    }

    /// Address of the page. On this computer's own name, browsers grant camera access without a
    /// certificate.
    pub fn link(&self) -> String {
        if self.address.ip().is_loopback() || self.address.ip().is_unspecified() {
            return format!("http://localhost:{}/", self.address.port());
        }
        format!("http://{}/", self.address)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_page_is_known_as_such_and_has_this_computers_name() {
        for (address, is_open) in [("127.0.0.1:0", false), ("0.0.0.0:0", true), ("[::]:0", true)] {
            let address: ServeAddress = address.parse().expect("an address");
            let Ok(page) = WebPage::serve(address, b"<html>".to_vec()) else {
                // A computer without IPv6.
                assert!(address.to_string().starts_with("[::]"), "{address}");
                continue;
            };
            assert_eq!(page.is_on_every_interface(), is_open, "{address}");
            assert!(page.link().starts_with("http://localhost:"), "{}", page.link());
        }
    }
}
