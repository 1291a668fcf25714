//! Server thread of the page.

use std::{
    net::{SocketAddr, TcpListener},
    sync::Arc,
    thread::{Builder, JoinHandle},
    time::Duration,
};

use axum::Router;
use tokio::sync::watch;

use boresight_present::qr::QrCode;

use super::{
    address::{ServeAddress, reachable},
    connection::{self, Peers},
    error::ServeError,
    guard::Gate,
    hub::Hub,
    keys::{Links, Secret},
    routes::router,
    tls::{self, Certificate, TlsAcceptor},
};

/// Pause after an error of the listener, such as too many open files.
const RETRY: Duration = Duration::from_millis(100);
/// Time limit for a connection's TLS handshake.
const HANDSHAKE_WITHIN: Duration = Duration::from_secs(8);
/// Niceness of the server's threads: the pipeline comes first.
const POLITENESS: i32 = 10;

/// Settings of the server.
pub struct Setup {
    /// Address to bind to.
    pub address: ServeAddress,
    /// Host names of the page besides addresses.
    pub names: Vec<String>,
    /// Certificate for HTTPS; plain HTTP without.
    pub certificate: Option<Certificate>,
    /// Secret for deriving the same links and keys at each start; without it, all are new.
    pub kept: Option<Secret>,
}

/// Server thread. Ends when dropped.
pub(super) struct Served {
    stop: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
}

/// Served page. Ends when dropped.
pub struct Server {
    _served: Served,
    gate: Arc<Gate>,
    /// Requested port, if another port had to be used.
    taken_port: Option<u16>,
}

impl Server {
    /// Serves the state of `hub`.
    ///
    /// # Errors
    ///
    /// [`ServeError`].
    pub fn start(setup: &Setup, hub: Arc<Hub>) -> Result<Self, ServeError> {
        if let Some(name) = setup.names.iter().find(|name| !is_host_name(name)) {
            return Err(ServeError::Name(name.clone()));
        }
        let acceptor = |certificate| tls::acceptor(certificate, &setup.names);
        let tls = setup.certificate.as_ref().map(acceptor).transpose()?;
        let listener = bind(setup.address)?;
        let bound = listener.local_addr().map_err(ServeError::Thread)?;
        let names: Vec<String> =
            setup.names.iter().map(|name| name.trim_end_matches('.').to_owned()).collect();
        let named = names.iter().map(|name| format!("{name}:{}", bound.port()));
        // A certificate is for names: by an address, a browser would warn.
        let origins = match tls {
            Some(_) => named.map(|host| format!("https://{host}")).collect(),
            None => named
                .chain(reachable(bound).iter().map(SocketAddr::to_string))
                .map(|host| format!("http://{host}"))
                .collect(),
        };
        let gate = Gate::new(names.clone(), origins, tls.is_some(), setup.kept.as_ref())?;
        let gate = Arc::new(gate);
        let wanted = setup.address.bind.port();
        let taken_port = (wanted != 0 && wanted != bound.port()).then_some(wanted);
        let served = Served::start(listener, tls, router(hub, Arc::clone(&gate)))?;
        Ok(Self { _served: served, gate, taken_port })
    }

    /// Valid links to the page, the likeliest first. An owner's link is replaced after its use.
    pub fn links(&self) -> Vec<Links> {
        self.gate.links()
    }

    /// The valid owner's link as a QR code in letters, whenever asked.
    pub fn code(&self) -> impl Fn() -> Vec<String> + Send + Sync + 'static {
        let gate = Arc::clone(&self.gate);
        move || {
            let links = gate.links();
            let first = links.first().map(|links| links.owner.as_str());
            first.and_then(QrCode::of).map_or_else(Vec::new, |code| code.lines())
        }
    }

    /// Requested port, if in use by another program.
    pub fn taken_port(&self) -> Option<u16> {
        self.taken_port
    }

    /// Calls `on_used` with the new links whenever an owner's link is used up. Only the first call
    /// has an effect.
    pub fn when_used(&self, on_used: impl Fn(&[Links]) + Send + Sync + 'static) {
        self.gate.on_used.set(Box::new(on_used)).ok();
    }
}

impl Served {
    /// Answers the connections of `listener`.
    pub(super) fn start(
        listener: TcpListener,
        tls: Option<TlsAcceptor>,
        router: Router,
    ) -> Result<Self, ServeError> {
        listener.set_nonblocking(true).map_err(ServeError::Thread)?;
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(ServeError::Thread)?;
        let (stop, stopped) = watch::channel(false);
        let thread = Builder::new()
            .name("phone".into())
            .spawn(move || {
                be_polite();
                runtime.block_on(serve(listener, tls, router, stopped));
                // Dropping the runtime drops every connection.
            })
            .map_err(ServeError::Thread)?;
        Ok(Self { stop, thread: Some(thread) })
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.send_replace(true);
        if let Some(thread) = self.thread.take() {
            // The thread has printed a panic already.
            thread.join().ok();
        }
    }
}

/// True for letters, digits, hyphens and points, as in host names.
fn is_host_name(name: &str) -> bool {
    let is_label = |label: &str| {
        !label.is_empty()
            && label.len() <= 63
            && label.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-')
            && !label.starts_with('-')
            && !label.ends_with('-')
    };
    name.strip_suffix('.').unwrap_or(name).split('.').all(is_label)
}

pub(super) fn bind(address: ServeAddress) -> Result<TcpListener, ServeError> {
    let failed = |source| ServeError::Bind { address: address.bind, source };
    match TcpListener::bind(address.bind) {
        Ok(listener) => Ok(listener),
        Err(err) if address.any_port && err.kind() == std::io::ErrorKind::AddrInUse => {
            TcpListener::bind((address.bind.ip(), 0)).map_err(failed)
        }
        Err(err) => Err(failed(err)),
    }
}

/// Lowers this thread's priority, on systems with priorities per thread.
fn be_polite() {
    #[cfg(target_os = "linux")]
    rustix::process::nice(POLITENESS).ok();
    #[cfg(not(target_os = "linux"))]
    let _ = POLITENESS;
}

async fn serve(
    listener: TcpListener,
    tls: Option<TlsAcceptor>,
    router: Router,
    mut stopped: watch::Receiver<bool>,
) {
    let Ok(listener) = tokio::net::TcpListener::from_std(listener) else { return };
    let peers = Peers::default();
    let accept = async {
        loop {
            let Ok((stream, address)) = listener.accept().await else {
                tokio::time::sleep(RETRY).await;
                continue;
            };
            // Send small answers at once.
            stream.set_nodelay(true).ok();
            let Some(peer) = peers.admit(address) else { continue };
            match tls.clone() {
                None => drop(tokio::spawn(connection::serve(stream, peer, router.clone()))),
                Some(tls) => {
                    let router = router.clone();
                    tokio::spawn(async move {
                        let handshake = tokio::time::timeout(HANDSHAKE_WITHIN, tls.accept(stream));
                        if let Ok(Ok(stream)) = handshake.await {
                            connection::serve(stream, peer, router).await;
                        }
                    });
                }
            }
        }
    };
    tokio::select! {
        () = accept => {}
        _ = stopped.wait_for(|stop| *stop) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_a_computers() {
        for name in ["cell4.example.org", "cell-4", "cell4.example.org."] {
            assert!(is_host_name(name), "{name}");
        }
        for name in ["", ".", "bad name", "a/../x", "a..b", "-a", "a-.b", "caf\u{e9}"] {
            assert!(!is_host_name(name), "{name}");
        }
    }

    #[test]
    fn that_a_port_is_taken_is_known() {
        let other = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let taken = other.local_addr().expect("bound");
        let address = ServeAddress { bind: taken, any_port: true };
        let setup = Setup { address, names: Vec::new(), certificate: None, kept: None };
        let server = Server::start(&setup, Arc::new(Hub::new())).expect("another port");
        assert_eq!(server.taken_port(), Some(taken.port()));
    }
}
