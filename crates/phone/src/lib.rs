//! The page for a phone: a small web server on the local network that shows a session, or a watched camera that's pushed
//! back, and takes commands.
//!
//! ```text
//!  capture ──newest frame──▶ hub ──picture, on request──▶ page   (JPEG; made here, never in the pipeline)
//!  session ──snapshot──────▶ hub ──events, newest wins──▶ page
//!  session ◀──command link── hub ◀──POST, owner only───── page
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `hub` | what the program shows and what the pages ask for; the only part that both sides see |
//! | `view` | what the program shows as the page's JSON |
//! | `picture` | a frame as a small JPEG |
//! | `keys` | links, keys and roles |
//! | `guard` | what every request must pass: host, origin, key, rate |
//! | `routes` | the page, its events, pictures, commands and files |
//! | `events` | the stream of events to one page |
//! | `connection` | limits of connections, and their end |
//! | `server` | the thread |
//! | `web_page` | the page that calibrates in a browser, served as it is |
//! | `tls` | HTTPS, with a certificate |
//! | `address` | what to bind to, and where the page is found |
//! | `qr` | an address as a QR code |
//! | `link.js` | what the page has beside [`boresight_present::browser`]: its link |
//!
//! The pipeline never waits for a page: it replaces values in slots, and each page takes the newest when its link has
//! room. Everything here runs on one thread with a lower priority.
//!
//! # What is trusted
//!
//! Nobody without a link. A link holds a random token of 256 bits in its fragment, which browsers don't send; the page
//! exchanges it for a key of the same size that it keeps for itself and sends in a header; an owner's link is used up by it. No cookies, so no other
//! site can make a browser act. `Host` must be an address, so that no foreign name can be bound to it (DNS rebinding).
//! What is served is made in memory; no request names a file.

#![forbid(unsafe_code)]

mod address;
mod connection;
mod error;
mod events;
mod guard;
mod hub;
mod keys;
mod picture;
mod qr;
mod routes;
mod server;
pub mod session_page;
mod tls;
mod view;
mod web_page;

pub use address::{DEFAULT_PORT, ServeAddress};
pub use boresight_present::browser::{EndedPage, PageFile};
pub use error::ServeError;
pub use hub::{AdjustPage, Hub, Offer, OfferedCamera, Request, Stage};
pub use keys::{Links, Role, Secret};
pub use qr::QrCode;
pub use server::{Server, Setup};
pub use tls::Certificate;
pub use web_page::WebPage;
