use std::net::SocketAddr;

/// Why the page can't be served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address can't be used.
    #[error("could not serve at {address}")]
    Bind {
        /// Address that couldn't be bound.
        address: SocketAddr,
        /// The system's error.
        source: std::io::Error,
    },
    /// The system refused a thread or its parts.
    #[error("could not start the phone's page")]
    Thread(#[source] std::io::Error),
    /// No computer can have that name.
    #[error("not a name of a computer: {0:?}. Write one like cell4.example.org")]
    Name(String),
    /// Certificate and key can't be used.
    #[error("the certificate can't be used: {0}")]
    Certificate(String),
    /// There would be no safe link.
    #[error("the system gives no random numbers")]
    NoRandomness,
}
