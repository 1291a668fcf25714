//! The thread that serves the page.

use std::{
    net::{SocketAddr, TcpListener},
    sync::Arc,
    thread::{Builder, JoinHandle},
    time::Duration,
};

use axum::Router;
use tokio::sync::watch;

use super::{
    address::{ServeAddress, reachable},
    connection::{self, Peers},
    error::ServeError,
    guard::Gate,
    hub::Hub,
    keys::Secret,
    routes::router,
    tls::{self, Certificate, TlsAcceptor},
};

/// Pause after an error of the listener, such as too many open files.
const RETRY: Duration = Duration::from_millis(100);
/// Time within which a connection must have agreed on its encryption.
const HANDSHAKE_WITHIN: Duration = Duration::from_secs(8);
/// Niceness of the server's threads: the pipeline comes first.
const POLITENESS: i32 = 10;

/// Settings of the server.
pub struct Setup {
    /// Address to bind to.
    pub address: ServeAddress,
    /// Names by which the page may be called beside addresses.
    pub names: Vec<String>,
    /// Serves HTTPS with it; plain HTTP without one.
    pub certificate: Option<Certificate>,
    /// Secret from which links and keys are derived, the same at each start; without it, all are new.
    pub kept: Option<Secret>,
}

/// A page that is being served. Ends when dropped.
pub struct Server {
    stop: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
    links: Vec<Links>,
}

/// The links to the page by one of its addresses. Everyone who has one is let in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Links {
    /// May do everything.
    pub owner: String,
    /// May look on.
    pub watcher: String,
}

impl Server {
    /// Serves what `hub` shows.
    ///
    /// # Errors
    ///
    /// [`ServeError`].
    pub fn start(setup: &Setup, hub: Arc<Hub>) -> Result<Self, ServeError> {
        let tls = setup.certificate.as_ref().map(tls::acceptor).transpose()?;
        let listener = bind(setup.address)?;
        let bound = listener.local_addr().map_err(ServeError::Thread)?;
        listener.set_nonblocking(true).map_err(ServeError::Thread)?;
        let names: Vec<String> =
            setup.names.iter().map(|name| name.trim_end_matches('.').to_owned()).collect();
        let gate = Arc::new(Gate::new(names.clone(), tls.is_some(), setup.kept.as_ref())?);
        let [owner, watcher] = {
            let keys = gate.keys();
            [keys.owner.text(), keys.watcher.text()]
        };
        let scheme = if tls.is_some() { "https" } else { "http" };
        let named = names.iter().map(|name| format!("{name}:{}", bound.port()));
        let links = named
            .chain(reachable(bound).iter().map(SocketAddr::to_string))
            .map(|host| Links {
                owner: format!("{scheme}://{host}/#{owner}"),
                watcher: format!("{scheme}://{host}/#{watcher}"),
            })
            .collect();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(ServeError::Thread)?;
        let (stop, stopped) = watch::channel(false);
        let thread = Builder::new()
            .name("phone".into())
            .spawn(move || {
                be_polite();
                runtime.block_on(serve(listener, tls, router(hub, gate), stopped));
                // Dropping the runtime drops every connection.
            })
            .map_err(ServeError::Thread)?;
        Ok(Self { stop, thread: Some(thread), links })
    }

    /// The links to the page; the likeliest first.
    pub fn links(&self) -> &[Links] {
        &self.links
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.send_replace(true);
        if let Some(thread) = self.thread.take() {
            // The thread has printed a panic; there is nothing to add.
            thread.join().ok();
        }
    }
}

fn bind(address: ServeAddress) -> Result<TcpListener, ServeError> {
    let failed = |source| ServeError::Bind { address: address.bind, source };
    match TcpListener::bind(address.bind) {
        Ok(listener) => Ok(listener),
        Err(err) if address.any_port && err.kind() == std::io::ErrorKind::AddrInUse => {
            TcpListener::bind((address.bind.ip(), 0)).map_err(failed)
        }
        Err(err) => Err(failed(err)),
    }
}

/// Lowers this thread's priority where that concerns one thread.
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
            // Small answers go at once.
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
