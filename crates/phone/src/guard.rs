//! Checks of every request.

use std::{
    collections::BTreeMap,
    net::IpAddr,
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
    time::Instant,
};

use axum::{
    body::Body,
    extract::{Request, State},
    http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header},
    middleware::Next,
    response::{IntoResponse, Response},
};

use super::{
    connection::Peer,
    error::ServeError,
    keys::{Bucket, Exchanged, Keys, Links, Opened, Secret},
};

/// Maximum number of remembered addresses without a key.
const MOST_STRANGERS: usize = 256;
/// Path for exchanging a link's token for a key.
pub(super) const ENTER: &str = "/api/enter";

/// Callback for a used-up owner's link, with the links valid from then on.
pub(super) type OnUsed = Box<dyn Fn(&[Links]) + Send + Sync>;

/// Keys, and rate limits for addresses without one.
pub(super) struct Gate {
    keys: Mutex<Keys>,
    /// Schemes and hosts of the page's addresses.
    origins: Vec<String>,
    pub(super) on_used: OnceLock<OnUsed>,
    strangers: Mutex<BTreeMap<IpAddr, Bucket>>,
    /// Host names of the page besides addresses.
    names: Vec<String>,
    https: bool,
}

impl Gate {
    pub(super) fn new(
        names: Vec<String>,
        origins: Vec<String>,
        https: bool,
        kept: Option<&Secret>,
    ) -> Result<Self, ServeError> {
        let keys = Mutex::new(Keys::new(kept)?);
        let (strangers, on_used) = (Mutex::default(), OnceLock::new());
        Ok(Self { keys, strangers, names, origins, on_used, https })
    }

    fn keys(&self) -> MutexGuard<'_, Keys> {
        self.keys.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Valid links, for every address of the page.
    pub(super) fn links(&self) -> Vec<Links> {
        let [owner, watcher] = {
            let keys = self.keys();
            [keys.owner.text(), keys.watcher.text()]
        };
        let links = |origin: &String| Links {
            owner: format!("{origin}/#{owner}"),
            watcher: format!("{origin}/#{watcher}"),
        };
        self.origins.iter().map(links).collect()
    }

    /// Exchanges a link's token for a key; see [`Keys::exchange`].
    pub(super) fn exchange(
        &self,
        token: &Secret,
        claim: &Secret,
        now: Instant,
    ) -> Result<Exchanged, ServeError> {
        let before = self.keys().owner;
        let answer = self.keys().exchange(token, claim, now)?;
        // The keys are unlocked before the callback.
        let is_used = !before.is_same(&self.keys().owner);
        if is_used && let Some(on_used) = self.on_used.get() {
            on_used(&self.links());
        }
        Ok(answer)
    }

    /// True if a request naming `host` is meant for this server: an address, or a name of ours. Any
    /// other name may have been bound to our address by an attacker (DNS rebinding).
    fn is_ours(&self, host: &str) -> bool {
        let name = without_port(host);
        let name = name.strip_suffix('.').unwrap_or(name);
        let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']'));
        bare.unwrap_or(name).parse::<IpAddr>().is_ok()
            || name.eq_ignore_ascii_case("localhost")
            || self.names.iter().any(|ours| ours.eq_ignore_ascii_case(name))
    }

    /// True if a request comes from the page itself, as far as the browser reports.
    ///
    /// `visits` is true for a request for the page itself, possibly by a link on another site.
    fn is_own_origin(&self, headers: &HeaderMap, host: &str, visits: bool) -> bool {
        let scheme = if self.https { "https" } else { "http" };
        let own = match headers.get(header::ORIGIN) {
            Some(origin) => origin.as_bytes() == format!("{scheme}://{host}").as_bytes(),
            None => true,
        };
        let site = headers.get(HeaderName::from_static("sec-fetch-site"));
        own && (visits || site.is_none_or(|site| site == "same-origin" || site == "none"))
    }

    fn may_knock(&self, from: IpAddr, now: Instant) -> bool {
        let mut strangers = self.strangers.lock().unwrap_or_else(PoisonError::into_inner);
        if strangers.len() >= MOST_STRANGERS && !strangers.contains_key(&from) {
            strangers.pop_first();
        }
        strangers.entry(from).or_insert_with(|| Bucket::of_stranger(now)).take(now)
    }
}

fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) && !name.ends_with(':') => {
            name
        }
        _ => host,
    }
}

/// Admits or answers a request.
pub(super) async fn guard(
    State(gate): State<Arc<Gate>>,
    mut request: Request<Body>,
    next: Next,
) -> Response {
    let mut response = match check(&gate, &mut request) {
        Ok(()) => next.run(request).await,
        Err(answer) => answer.into_response(),
    };
    harden(response.headers_mut());
    response
}

type Answer = (StatusCode, &'static str);

fn check(gate: &Gate, request: &mut Request<Body>) -> Result<(), Answer> {
    let now = Instant::now();
    let peer = request.extensions().get::<Arc<Peer>>().cloned();
    let mut hosts = request.headers().get_all(header::HOST).iter();
    let host = match (hosts.next(), hosts.next()) {
        (Some(host), None) => host.to_str().unwrap_or_default().to_owned(),
        _ => String::new(),
    };
    // An absolute address in the request line takes precedence.
    let authority = request.uri().authority().map(|a| a.as_str().to_owned()).unwrap_or_default();
    if !gate.is_ours(&host) || !(authority.is_empty() || gate.is_ours(&authority)) {
        return Err((StatusCode::MISDIRECTED_REQUEST, "This page has another address.\n"));
    }
    let method = request.method();
    let visits = method == Method::GET && request.uri().path() == "/";
    if !gate.is_own_origin(request.headers(), &host, visits) {
        return Err((StatusCode::FORBIDDEN, "Only the page itself may ask.\n"));
    }
    if method != Method::GET && method != Method::POST {
        return Err((StatusCode::METHOD_NOT_ALLOWED, "GET or POST.\n"));
    }
    let path = request.uri().path();
    let needs_key = path != "/" && path != ENTER;
    if needs_key {
        let key = request
            .headers()
            .get(header::AUTHORIZATION)
            .and_then(|value| Secret::parse(value.as_bytes().strip_prefix(b"Bearer ")?));
        match key.and_then(|key| gate.keys().open(&key, now)) {
            Some(Opened::As(role)) => {
                if let Some(peer) = &peer {
                    peer.trust(role);
                }
                request.extensions_mut().insert(role);
                return Ok(());
            }
            Some(Opened::TooOften) => {
                return Err((StatusCode::TOO_MANY_REQUESTS, "Too many requests.\n"));
            }
            None => {}
        }
    }
    // Rate limit for requests without a key.
    if !peer.is_some_and(|peer| gate.may_knock(peer.address, now)) {
        return Err((StatusCode::TOO_MANY_REQUESTS, "Too many requests.\n"));
    }
    if needs_key {
        return Err((StatusCode::UNAUTHORIZED, "Open the page by its link or QR code.\n"));
    }
    Ok(())
}

/// Adds the security headers of every answer.
fn harden(headers: &mut HeaderMap) {
    const ALL: [(HeaderName, &str); 5] = [
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (header::CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ];
    for (name, value) in ALL {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers
        .entry(header::CONTENT_SECURITY_POLICY)
        .or_insert(HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_addresses_and_own_names_are_ours() {
        let names = vec!["cell-4.example".into()];
        let gate = Gate::new(names, Vec::new(), false, None).expect("randomness");
        for ours in [
            "127.0.0.1",
            "192.168.1.7:8417",
            "[::1]:8417",
            "[fe80::1]",
            "localhost:1",
            "Cell-4.example",
        ] {
            assert!(gate.is_ours(ours), "{ours}");
        }
        for other in [
            "",
            "evil.example",
            "evil.example:8417",
            "127.0.0.1.evil.example",
            "1",
            "a@127.0.0.1",
            "127.0.0.1/",
        ] {
            assert!(!gate.is_ours(other), "{other}");
        }
    }

    #[test]
    fn another_origin_is_refused() {
        let gate = Gate::new(Vec::new(), Vec::new(), false, None).expect("randomness");
        let from = |origin: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(header::ORIGIN, HeaderValue::from_str(origin).expect("a header"));
            gate.is_own_origin(&headers, "10.0.0.2:8417", false)
        };
        assert!(from("http://10.0.0.2:8417"));
        for other in ["http://10.0.0.2", "https://10.0.0.2:8417", "null", "http://evil.example"] {
            assert!(!from(other), "{other}");
        }
        assert!(gate.is_own_origin(&HeaderMap::new(), "10.0.0.2:8417", false));
        // A link in a web mail opens the page, but requests nothing else.
        let site = HeaderName::from_static("sec-fetch-site");
        let mail = HeaderMap::from_iter([(site, HeaderValue::from_static("cross-site"))]);
        assert!(gate.is_own_origin(&mail, "10.0.0.2:8417", true));
        assert!(!gate.is_own_origin(&mail, "10.0.0.2:8417", false));
    }
}
