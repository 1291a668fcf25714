//! A session as pages in a browser show it: the phone's page, and the page that calibrates in the
//! browser.
//!
//! | module | holds |
//! |---|---|
//! | `live` | a snapshot as JSON: [`Live`] changes with every frame, [`Plan`] with a view |
//! | `ended` | the result, with the files to download |
//! | `teller` | one-time news for pages, and reasons for refusals |
//! | `valid_map` | map of the valid area |
//! | `asked` | commands from pages |
//! | `page` | one HTML file from the shared parts and a page's own |
//! | `style.css`, `body.html`, `show.js` | shared by both pages: colours, layout, drawing, speech |

mod asked;
mod ended;
mod live;
mod page;
mod teller;
mod valid_map;

pub use asked::Asked;
pub use ended::{EndedPage, PageFile};
pub use live::{Led, Live, Plan, PlanSource, counted};
pub use page::{Own, page};
pub use teller::{News, NewsEvent, Teller};
pub use valid_map::ValidMap;
