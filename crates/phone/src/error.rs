use std::net::SocketAddr;

/// Error of serving the page.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// Unusable address.
    #[error("could not serve at {address}")]
    Bind {
        /// Address that couldn't be bound.
        address: SocketAddr,
        /// System error.
        source: std::io::Error,
    },
    /// Refusal of a thread by the system.
    #[error("could not start the phone's page")]
    Thread(#[source] std::io::Error),
    /// Invalid host name.
    #[error("not a name of a computer: {0:?}. Write one like cell4.example.org")]
    Name(String),
    /// Unusable certificate or key.
    #[error("the certificate can't be used: {0}")]
    Certificate(String),
    /// Lack of random numbers, without which no link would be safe.
    #[error("the system gives no random numbers")]
    NoRandomness,
}
