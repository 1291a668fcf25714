//! A session as pages in a browser show it: the phone's page, and the page that calibrates in the browser.
//!
//! | module | holds |
//! |---|---|
//! | `live` | a snapshot as JSON: [`Live`] changes with every frame, [`Plan`] with a view |
//! | `ended` | the result, with the files to download |
//! | `teller` | what pages are told once, and why frames were refused |
//! | `valid_map` | where the picture is known well enough |
//! | `asked` | what pages ask of a session |
//! | `page` | one HTML file from the parts below and a page's own |
//! | `style.css`, `body.html`, `show.js` | what both pages have: colours, places, drawing, speech |

mod asked;
mod ended;
mod live;
mod page;
mod teller;
mod valid_map;

pub use asked::Asked;
pub use ended::{EndedPage, PageFile};
pub use live::{Live, Plan, PlanSource, counted};
pub use page::{Own, page};
pub use teller::{News, NewsEvent, Teller};
pub use valid_map::ValidMap;
