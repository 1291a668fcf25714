//! The page for a phone: a small web server on the local network that shows a session, or a watched
//! camera being pushed back, and takes commands.
//!
//! ```text
//!  capture ──newest frame──▶ hub ──picture, on request──▶ page   (JPEG; made here, never in the pipeline)
//!  session ──snapshot──────▶ hub ──events, newest wins──▶ page
//!  session ◀──command link── hub ◀──POST, owner only───── page
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `hub` | state from the program and requests from the pages; the only shared part |
//! | `view` | the program's state as the page's JSON |
//! | `picture` | a frame as a small JPEG |
//! | `keys` | links, keys and roles |
//! | `guard` | checks of every request: host, origin, key, rate |
//! | `routes` | the page, its events, pictures, commands and files |
//! | `events` | the event stream to a page |
//! | `connection` | connection limits, and closing |
//! | `server` | the thread |
//! | `web_page` | the page that calibrates in a browser, served unchanged |
//! | `tls` | HTTPS, with a certificate |
//! | `address` | the address to bind to, and the page's addresses |
//! | `link.js` | the page's own part beside [`boresight_present::browser`]: its link |
//!
//! The pipeline never waits for a page: it replaces values in slots, and each page takes the newest
//! when its link has room. Everything here runs on one thread with a lower priority.
//!
//! # Trust
//!
//! Nobody is trusted without a link. A link holds a random token of 256 bits in its fragment, which
//! browsers don't send; the page exchanges it for a key of the same size, keeps the key for itself
//! and sends it in a header. The exchange uses up an owner's link. There are no cookies, so no
//! other site can make a browser act. `Host` must be an address, so no foreign name can be bound to
//! it (DNS rebinding). Everything served is made in memory; no request names a file.

#![forbid(unsafe_code)]

mod address;
mod connection;
mod error;
mod events;
mod guard;
mod hub;
mod keys;
mod picture;
mod routes;
mod server;
pub mod session_page;
mod tls;
mod view;
mod web_page;

pub use address::{DEFAULT_PORT, ServeAddress};
pub use boresight_present::{
    browser::{EndedPage, PageFile},
    qr::QrCode,
};
pub use error::ServeError;
pub use hub::{AdjustPage, Hub, Offer, OfferedCamera, Request, Stage};
pub use keys::{Links, Role, Secret};
pub use server::{Server, Setup};
pub use tls::Certificate;
pub use web_page::WebPage;
