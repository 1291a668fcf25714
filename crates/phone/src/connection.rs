//! Connection limits, and closing of connections.

use std::{
    io,
    net::{IpAddr, SocketAddr},
    pin::{Pin, pin},
    sync::{
        Arc, Mutex, OnceLock, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    task::{Context, Poll, ready},
    time::{Duration, Instant},
};

use axum::{Router, body::Body, extract::Request};
use hyper::{body::Incoming, server::conn::http1};
use hyper_util::{
    rt::{TokioIo, TokioTimer},
    service::TowerToHyperService,
};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use super::keys::Role;

/// Maximum number of connections at once, over all pages.
const MOST_CONNECTIONS: usize = 256;
/// Maximum number of watchers' connections; the rest is kept for owners and for strangers without a
/// key.
const MOST_OF_WATCHERS: usize = 192;
/// Time after which a connection without a key is closed.
const STRANGER_SECS: u64 = 15;
/// Time without traffic after which a connection is closed: its page is gone or reads nothing.
const IDLE: Duration = Duration::from_secs(15);
/// Time limit for a request's headers.
const HEADERS_WITHIN: Duration = Duration::from_secs(10);
/// Maximum size of a request line with headers, in bytes, and maximum number of headers.
const LARGEST_HEAD: usize = 16 << 10;
const MOST_HEADERS: usize = 64;
/// Interval between checks of the limits.
const LOOK: Duration = Duration::from_millis(500);

/// Other end of a connection.
pub(super) struct Peer {
    pub(super) address: IpAddr,
    since: Instant,
    /// Role of the peer's key; empty for a stranger.
    role: OnceLock<Role>,
    must_go: AtomicBool,
    /// Time of the last traffic in milliseconds after `since`.
    moved_ms: AtomicU64,
}

impl Peer {
    /// Records a key of `role` shown by the peer; the first one counts.
    pub(super) fn trust(&self, role: Role) {
        self.role.set(role).ok();
    }

    fn moved(&self) {
        let ms = u64::try_from(self.since.elapsed().as_millis()).unwrap_or(u64::MAX);
        self.moved_ms.store(ms, Ordering::Relaxed);
    }

    fn is_over(&self) -> bool {
        let age = self.since.elapsed();
        let moved = Duration::from_millis(self.moved_ms.load(Ordering::Relaxed));
        self.must_go.load(Ordering::Relaxed)
            || age.saturating_sub(moved) > IDLE
            || (self.role.get().is_none() && age.as_secs() >= STRANGER_SECS)
    }
}

/// Open connections.
#[derive(Clone, Default)]
pub(super) struct Peers {
    open: Arc<Mutex<Vec<Arc<Peer>>>>,
}

impl Peers {
    /// Admits a connection from `address`. Closes the oldest watchers beyond [`MOST_OF_WATCHERS`].
    /// Without room, closes the oldest stranger, or else the oldest watcher; `None` if all are
    /// owners.
    pub(super) fn admit(&self, address: SocketAddr) -> Option<Arc<Peer>> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.retain(|peer| Arc::strong_count(peer) > 1);
        let watchers = open.iter().filter(|peer| peer.role.get() == Some(&Role::Watcher)).count();
        for _ in MOST_OF_WATCHERS..watchers {
            end_oldest(&mut open, Some(Role::Watcher));
        }
        let is_room = open.len() < MOST_CONNECTIONS
            || end_oldest(&mut open, None)
            || end_oldest(&mut open, Some(Role::Watcher));
        if !is_room {
            return None;
        }
        let peer = Arc::new(Peer {
            address: address.ip().to_canonical(),
            since: Instant::now(),
            role: OnceLock::new(),
            must_go: AtomicBool::new(false),
            moved_ms: AtomicU64::new(0),
        });
        open.push(Arc::clone(&peer));
        Some(peer)
    }
}

/// Closes the oldest connection of `role`, or of a stranger for `None`. False if there is none.
/// `open` is sorted by age.
fn end_oldest(open: &mut Vec<Arc<Peer>>, role: Option<Role>) -> bool {
    let Some(at) = open.iter().position(|peer| peer.role.get().copied() == role) else {
        return false;
    };
    open.remove(at).must_go.store(true, Ordering::Relaxed);
    true
}

/// Answers the requests of a connection until the end or a broken limit.
pub(super) async fn serve<S>(stream: S, peer: Arc<Peer>, router: Router)
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let service = {
        let peer = Arc::clone(&peer);
        tower_of(router, peer)
    };
    let watched = Watched { stream, peer: Arc::clone(&peer) };
    let mut builder = http1::Builder::new();
    builder
        .timer(TokioTimer::new())
        .header_read_timeout(HEADERS_WITHIN)
        .max_buf_size(LARGEST_HEAD)
        .max_headers(MOST_HEADERS)
        .half_close(false);
    let mut connection = pin!(builder.serve_connection(TokioIo::new(watched), service));
    // Errors of a broken connection are useless.
    while tokio::time::timeout(LOOK, connection.as_mut()).await.is_err() {
        if peer.is_over() {
            return;
        }
    }
}

/// Router that adds the peer to each request.
fn tower_of(
    router: Router,
    peer: Arc<Peer>,
) -> TowerToHyperService<
    impl tower_service::Service<
        Request<Incoming>,
        Response = axum::response::Response,
        Error = std::convert::Infallible,
        Future = impl Send,
    > + Clone,
> {
    TowerToHyperService::new(WithPeer { router, peer })
}

#[derive(Clone)]
struct WithPeer {
    router: Router,
    peer: Arc<Peer>,
}

impl tower_service::Service<Request<Incoming>> for WithPeer {
    type Response = axum::response::Response;
    type Error = std::convert::Infallible;
    type Future = <Router as tower_service::Service<Request<Body>>>::Future;

    fn poll_ready(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), Self::Error>> {
        tower_service::Service::<Request<Body>>::poll_ready(&mut self.router, cx)
    }

    fn call(&mut self, request: Request<Incoming>) -> Self::Future {
        let mut request = request.map(Body::new);
        request.extensions_mut().insert(Arc::clone(&self.peer));
        self.router.call(request)
    }
}

/// Stream that records the time of traffic.
struct Watched<S> {
    stream: S,
    peer: Arc<Peer>,
}

impl<S: AsyncRead + Unpin> AsyncRead for Watched<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        ready!(Pin::new(&mut self.stream).poll_read(cx, buffer))?;
        if buffer.filled().len() > before {
            self.peer.moved();
        }
        Poll::Ready(Ok(()))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Watched<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = ready!(Pin::new(&mut self.stream).poll_write(cx, bytes))?;
        self.peer.moved();
        Poll::Ready(Ok(written))
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Opens `count` connections with a key of `role`, as far as there is room.
    fn come(peers: &Peers, count: usize, role: Option<Role>) -> Vec<Arc<Peer>> {
        let address = SocketAddr::from(([127, 0, 0, 1], 1));
        let come = std::iter::repeat_with(|| peers.admit(address)).take(count).flatten();
        come.inspect(|peer| role.into_iter().for_each(|role| peer.trust(role))).collect()
    }

    fn staying(peers: &[Arc<Peer>]) -> usize {
        peers.iter().filter(|peer| !peer.is_over()).count()
    }

    #[test]
    fn watchers_never_shut_an_owner_out() {
        let peers = Peers::default();
        let watchers = come(&peers, MOST_CONNECTIONS, Some(Role::Watcher));
        assert_eq!(watchers.len(), MOST_CONNECTIONS);
        let owners = come(&peers, 1, Some(Role::Owner));
        assert_eq!((owners.len(), staying(&watchers)), (1, MOST_OF_WATCHERS));
        // Newcomers never displace an owner, and no owner waits for room.
        let more = come(&peers, 3 * MOST_CONNECTIONS, Some(Role::Watcher));
        let strangers = come(&peers, 3 * MOST_CONNECTIONS, None);
        assert_eq!(staying(&owners), 1);
        assert_eq!(staying(&watchers) + staying(&more), MOST_OF_WATCHERS);
        assert_eq!(staying(&strangers), MOST_CONNECTIONS - MOST_OF_WATCHERS - 1);
        let all = come(&peers, MOST_CONNECTIONS - 1, Some(Role::Owner));
        assert_eq!((all.len(), staying(&owners)), (MOST_CONNECTIONS - 1, 1));
        assert!(come(&peers, 1, None).is_empty(), "all are owners");
    }
}
