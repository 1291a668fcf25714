//! The page, its events, pictures, commands and files.

use std::{
    sync::{Arc, LazyLock, PoisonError},
    time::{Duration, Instant},
};

use axum::{
    Extension, Router,
    body::{Body, Bytes},
    extract::{DefaultBodyLimit, Path, RawQuery, State},
    http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header},
    middleware,
    response::{IntoResponse, Response},
    routing::{get, post},
};
use base64::{Engine, prelude::BASE64_STANDARD};
use serde::{Deserialize, Serialize};

use super::{
    events::{self, SharedStates},
    guard::{ENTER, Gate, guard},
    hub::{Hub, Request, Stage},
    keys::{Exchanged, Role, Secret},
    picture::{Made, SharedPictures},
};
use boresight_present::browser::{self, Asked};
use boresight_run::pipeline::NotSent;

/// Page with inline script and style.
static PAGE: LazyLock<String> =
    LazyLock::new(|| browser::page(browser::Own { body: "", script: include_str!("link.js") }));
/// Maximum size of a request, in bytes.
const LARGEST_REQUEST: usize = 2048;
/// Time after which a request for a picture is answered, with or without a picture.
const LONGEST_WAIT: Duration = Duration::from_secs(1);
/// Time limit for reading a request.
const READ_WITHIN: Duration = Duration::from_secs(5);
/// Maximum number of watching pages.
const MOST_WATCHERS: usize = 64;
/// Maximum number of pictures sent per second, over all pages. With [`MOST_WATCHERS`], each page
/// still gets one within a second.
const MOST_PICTURES_PER_SEC: f64 = 96.0;
/// Maximum page count for pacing owners, and maximum owners' share of the count for pacing
/// watchers.
const PAGES_OF_OWNERS: usize = 4;

/// State shared by every route.
#[derive(Clone)]
struct Shop {
    hub: Arc<Hub>,
    gate: Arc<Gate>,
    pictures: SharedPictures,
    states: SharedStates,
    policy: HeaderValue,
}

/// Router of everything served.
pub(super) fn router(hub: Arc<Hub>, gate: Arc<Gate>) -> Router {
    let shop = Shop {
        hub,
        gate: Arc::clone(&gate),
        pictures: SharedPictures::default(),
        states: SharedStates::default(),
        policy: policy(),
    };
    Router::new()
        .route("/", get(page))
        .route(ENTER, post(enter))
        .route("/api/events", get(follow))
        .route("/api/picture", get(picture))
        .route("/api/command", post(command))
        .route("/api/start", post(start))
        .route("/api/file/{number}", get(file))
        .fallback(|| async { (StatusCode::NOT_FOUND, "There is nothing here.\n") })
        .with_state(shop)
        .layer(DefaultBodyLimit::max(LARGEST_REQUEST))
        .layer(middleware::from_fn_with_state(gate, guard))
}

/// Content policy: only the page's own script and style run, nothing is loaded from elsewhere, and
/// no page may frame this one.
fn policy() -> HeaderValue {
    let hash = |from: &str, to: &str| {
        let start = PAGE.find(from).map_or(0, |at| at + from.len());
        let end = PAGE[start..].find(to).map_or(start, |at| start + at);
        BASE64_STANDARD.encode(hmac_sha256::Hash::hash(&PAGE.as_bytes()[start..end]))
    };
    let policy = format!(
        "default-src 'none'; script-src 'sha256-{}'; style-src 'sha256-{}'; img-src blob: data:; \
         connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        hash("<script>", "</script>"),
        hash("<style>", "</style>"),
    );
    HeaderValue::from_str(&policy).unwrap_or(HeaderValue::from_static("default-src 'none'"))
}

async fn page(State(shop): State<Shop>) -> impl IntoResponse {
    let headers = [
        (header::CONTENT_TYPE, HeaderValue::from_static("text/html; charset=utf-8")),
        (header::CONTENT_SECURITY_POLICY, shop.policy),
        (
            HeaderName::from_static("cross-origin-opener-policy"),
            HeaderValue::from_static("same-origin"),
        ),
    ];
    (headers, PAGE.as_str())
}

type Refused = (StatusCode, &'static str);

const NOT_JSON: Refused = (StatusCode::UNSUPPORTED_MEDIA_TYPE, "Only JSON is understood.\n");
const TOO_MANY_WATCH: Refused =
    (StatusCode::SERVICE_UNAVAILABLE, "As many as can are watching already.\n");
const NO_LINK: Refused =
    (StatusCode::UNAUTHORIZED, "This link is no longer valid. Scan the QR code again.\n");
const USED: Refused =
    (StatusCode::GONE, "Another phone has used this link. Scan the QR code again.\n");
const NO_RANDOMNESS: Refused =
    (StatusCode::SERVICE_UNAVAILABLE, "The system gives no random numbers.\n");
const NOT_UNDERSTOOD: Refused = (StatusCode::BAD_REQUEST, "That wasn't understood.\n");

/// JSON of a request. A form on another site can't send this content type.
async fn read<T: for<'a> Deserialize<'a>>(headers: &HeaderMap, body: Body) -> Result<T, Refused> {
    let json = headers.get(header::CONTENT_TYPE).is_some_and(|kind| kind == "application/json");
    if !json {
        return Err(NOT_JSON);
    }
    let bytes = tokio::time::timeout(READ_WITHIN, axum::body::to_bytes(body, LARGEST_REQUEST))
        .await
        .map_err(|_| (StatusCode::REQUEST_TIMEOUT, "The request took too long.\n"))?
        .map_err(|_| (StatusCode::PAYLOAD_TOO_LARGE, "The request is too large.\n"))?;
    serde_json::from_slice(&bytes).map_err(|_| NOT_UNDERSTOOD)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Enter {
    token: String,
    /// Page's own random number, like a token: the same number gets the same key.
    claim: String,
}

#[derive(Serialize)]
struct Entered {
    key: String,
    role: Role,
}

/// Exchanges a link's token for a key.
async fn enter(
    State(shop): State<Shop>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Refused> {
    let Enter { token, claim } = read(&headers, body).await?;
    let [token, claim] = [token, claim].map(|text| Secret::parse(text.as_bytes()));
    let Some(claim) = claim else { return Err(NOT_UNDERSTOOD) };
    let given = match token {
        Some(token) => shop.gate.exchange(&token, &claim, Instant::now()),
        None => Ok(Exchanged::Unknown),
    };
    match given {
        Ok(Exchanged::Key(key, role)) => Ok(json(&Entered { key: key.text(), role })),
        Ok(Exchanged::Used) => Err(USED),
        Ok(Exchanged::Unknown) => Err(NO_LINK),
        Err(_) => Err(NO_RANDOMNESS),
    }
}

fn json(value: &impl Serialize) -> Response {
    let text = serde_json::to_string(value).unwrap_or_default();
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

/// Number after `name=` in a query.
fn number(query: Option<&str>, name: &str) -> Option<u64> {
    let mut pairs = query?.split('&').filter_map(|pair| pair.split_once('='));
    pairs.find(|(key, _)| *key == name)?.1.parse().ok()
}

async fn follow(
    State(shop): State<Shop>,
    Extension(role): Extension<Role>,
    RawQuery(query): RawQuery,
) -> Response {
    if role == Role::Watcher && shop.hub.watchers() >= MOST_WATCHERS {
        return TOO_MANY_WATCH.into_response();
    }
    let seen = number(query.as_deref(), "heard");
    let body = events::follow(shop.hub, shop.states, role, seen);
    ([(header::CONTENT_TYPE, "text/event-stream")], body).into_response()
}

/// Newest picture after number `after`, as soon as available.
async fn picture(
    State(shop): State<Shop>,
    Extension(role): Extension<Role>,
    RawQuery(query): RawQuery,
) -> Response {
    let seen = number(query.as_deref(), "after").unwrap_or(0);
    let asked = Instant::now();
    let pages = match role {
        Role::Owner => shop.hub.pages().clamp(1, PAGES_OF_OWNERS),
        Role::Watcher => shop.hub.pages().clamp(1, MOST_WATCHERS + PAGES_OF_OWNERS),
    };
    let share = pages as f64 / MOST_PICTURES_PER_SEC;
    let mut pictures = shop.hub.pictures();
    let newest = async {
        tokio::time::sleep(Duration::from_secs_f64(share)).await;
        loop {
            let newest = pictures.borrow_and_update().clone();
            let wait = match newest.filter(|picture| picture.number > seen) {
                Some(picture) => {
                    let mut made = shop.pictures.lock().unwrap_or_else(PoisonError::into_inner);
                    match made.make(&picture, seen) {
                        Ok(made) => return made,
                        Err(wait) => Some(wait),
                    }
                }
                None => None,
            };
            match wait {
                Some(wait) => tokio::time::sleep(wait).await,
                // The hub outlives the pages.
                None => drop(pictures.changed().await),
            }
        }
    };
    let made: Option<Made> = tokio::time::timeout(LONGEST_WAIT, newest).await.ok();
    let held_ms = asked.elapsed().as_millis().to_string();
    let Some(Made { number, came, jpeg, .. }) = made else {
        return (StatusCode::NO_CONTENT, [("x-held-ms", held_ms)]).into_response();
    };
    let headers = [
        ("content-type", "image/jpeg".to_owned()),
        ("x-number", number.to_string()),
        ("x-age-ms", came.elapsed().as_millis().to_string()),
        ("x-held-ms", held_ms),
    ];
    (headers, jpeg).into_response()
}

const OWNER_ONLY: Refused = (StatusCode::FORBIDDEN, "This link is for watching only.\n");
const NOT_NOW: Refused = (StatusCode::CONFLICT, "That's not possible now.\n");

fn owner_only(role: Role) -> Result<(), Refused> {
    if role == Role::Owner { Ok(()) } else { Err(OWNER_ONLY) }
}

async fn command(
    State(shop): State<Shop>,
    Extension(role): Extension<Role>,
    headers: HeaderMap,
    body: Body,
) -> Result<StatusCode, Refused> {
    owner_only(role)?;
    let (hub, asked) = (&shop.hub, read::<Asked>(&headers, body).await?);
    let is_done = match asked {
        Asked::End {} => hub.end(),
        Asked::More {} => hub.go_on(),
        Asked::Leave {} => hub.leave(),
        _ => match asked.command().map(|command| hub.command(command)) {
            Some(Err(NotSent::Busy)) => {
                let busy = "The session is busy. Try again.\n";
                return Err((StatusCode::SERVICE_UNAVAILABLE, busy));
            }
            sent => sent == Some(Ok(())),
        },
    };
    is_done.then_some(StatusCode::NO_CONTENT).ok_or(NOT_NOW)
}

async fn start(
    State(shop): State<Shop>,
    Extension(role): Extension<Role>,
    headers: HeaderMap,
    body: Body,
) -> Result<StatusCode, Refused> {
    owner_only(role)?;
    let request: Request = read(&headers, body).await?;
    shop.hub.start(request).then_some(StatusCode::NO_CONTENT).ok_or(NOT_NOW)
}

/// File of the result, by index in the page's list.
async fn file(
    State(shop): State<Shop>,
    Path(number): Path<String>,
) -> Result<impl IntoResponse, Refused> {
    const NO_FILE: Refused = (StatusCode::NOT_FOUND, "There is no such file.\n");
    let state = shop.hub.states().borrow().clone();
    let Stage::Ended(ended) = state.stage else { return Err(NO_FILE) };
    let number: usize = number.parse().map_err(|_| NO_FILE)?;
    let file = ended.files.get(number).ok_or(NO_FILE)?;
    // File names are ours; anything else wouldn't be a valid header.
    let attachment = HeaderValue::from_str(&format!("attachment; filename=\"{}\"", file.name));
    let headers = [
        (header::CONTENT_TYPE, HeaderValue::from_static(file.media_type)),
        (header::CONTENT_DISPOSITION, attachment.unwrap_or(HeaderValue::from_static("attachment"))),
    ];
    Ok((headers, Bytes::from_owner(Arc::clone(&file.bytes))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_needs_nothing_from_elsewhere() {
        for elsewhere in ["http://", "https://", "src=", "@import", "url("] {
            assert!(!PAGE.contains(elsewhere), "{elsewhere}");
        }
        for part in ["<script>", "</script>", "<style>", "</style>"] {
            assert_eq!(PAGE.matches(part).count(), 1, "{part}");
        }
        let policy = policy();
        let policy = policy.to_str().expect("ASCII");
        assert!(policy.contains("script-src 'sha256-") && !policy.contains("unsafe"), "{policy}");
        // Attributes with script or style wouldn't run.
        assert!(!PAGE.contains(" style=\"") && !PAGE.contains(" onclick="));
    }

    #[test]
    fn a_query_is_read_as_far_as_it_is_one() {
        assert_eq!(number(Some("after=12"), "after"), Some(12));
        assert_eq!(number(Some("x=1&after=3&after=4"), "after"), Some(3));
        for other in [None, Some(""), Some("after"), Some("after=-1"), Some("after=%31")] {
            assert_eq!(number(other, "after"), None);
        }
    }
}
