//! Limits of connections, and their end.

use std::{
    io,
    net::{IpAddr, SocketAddr},
    pin::{Pin, pin},
    sync::{
        Arc, Mutex, PoisonError,
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

/// Connections at once, over all pages.
const MOST_CONNECTIONS: usize = 256;
/// A connection that has shown no key after this time is closed.
const STRANGER_SECS: u64 = 15;
/// A connection on which nothing has moved for this time is closed: its page reads nothing, or is gone.
const IDLE: Duration = Duration::from_secs(15);
/// A request's headers must be there within this time.
const HEADERS_WITHIN: Duration = Duration::from_secs(10);
/// Bytes of a request line with its headers.
const LARGEST_HEAD: usize = 16 << 10;
const MOST_HEADERS: usize = 64;
/// How often the limits are looked at.
const LOOK: Duration = Duration::from_millis(500);

/// The other end of a connection.
pub(super) struct Peer {
    pub(super) address: IpAddr,
    since: Instant,
    trusted: AtomicBool,
    must_go: AtomicBool,
    /// Milliseconds after `since` at which bytes moved last.
    moved_ms: AtomicU64,
}

impl Peer {
    /// It has shown a key.
    pub(super) fn trust(&self) {
        self.trusted.store(true, Ordering::Relaxed);
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
            || (!self.trusted.load(Ordering::Relaxed) && age.as_secs() >= STRANGER_SECS)
    }
}

/// The connections that are open.
#[derive(Clone, Default)]
pub(super) struct Peers {
    open: Arc<Mutex<Vec<Arc<Peer>>>>,
}

impl Peers {
    /// Room for a connection from `address`. If there is none, the oldest stranger goes; if there is no stranger, `None`.
    pub(super) fn admit(&self, address: SocketAddr) -> Option<Arc<Peer>> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.retain(|peer| Arc::strong_count(peer) > 1);
        if open.len() >= MOST_CONNECTIONS {
            let strangers = open.iter().filter(|peer| !peer.trusted.load(Ordering::Relaxed));
            let oldest = strangers.min_by_key(|peer| peer.since).cloned()?;
            oldest.must_go.store(true, Ordering::Relaxed);
            open.retain(|peer| !Arc::ptr_eq(peer, &oldest));
        }
        let peer = Arc::new(Peer {
            address: address.ip().to_canonical(),
            since: Instant::now(),
            trusted: AtomicBool::new(false),
            must_go: AtomicBool::new(false),
            moved_ms: AtomicU64::new(0),
        });
        open.push(Arc::clone(&peer));
        Some(peer)
    }
}

/// Answers the requests of one connection until it ends or breaks a limit.
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
    // What a broken connection says is of no use to anybody.
    while tokio::time::timeout(LOOK, connection.as_mut()).await.is_err() {
        if peer.is_over() {
            return;
        }
    }
}

/// The router with the peer in each request.
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

/// A stream that notes when bytes move.
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
