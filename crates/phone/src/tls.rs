//! HTTPS with a given certificate.

#[cfg(not(unix))]
use none as backend;
#[cfg(unix)]
use rustls as backend;

use super::error::ServeError;

pub(super) use backend::{TlsAcceptor, acceptor};

/// Certificate with chain and key, as PEM.
#[derive(Clone)]
pub struct Certificate {
    /// Chain, the page's own certificate first.
    pub chain_pem: Vec<u8>,
    /// Private key of the page's own certificate.
    pub key_pem: Vec<u8>,
}

#[cfg(unix)]
mod rustls {
    use std::sync::Arc;

    pub(in super::super) use tokio_rustls::TlsAcceptor;
    use tokio_rustls::rustls::{
        ServerConfig,
        client::verify_server_name,
        crypto,
        pki_types::{CertificateDer, PrivateKeyDer, ServerName, pem::PemObject},
        server::ParsedCertificate,
    };

    use super::{Certificate, ServeError};

    /// Acceptor of HTTPS connections with `certificate`, which must be valid for each of the
    /// `names`.
    pub(in super::super) fn acceptor(
        certificate: &Certificate,
        names: &[String],
    ) -> Result<TlsAcceptor, ServeError> {
        let unusable = |reason: &dyn std::fmt::Display| ServeError::Certificate(reason.to_string());
        let chain = CertificateDer::pem_slice_iter(&certificate.chain_pem)
            .collect::<Result<Vec<_>, _>>()
            .map_err(|err| unusable(&err))?;
        if chain.is_empty() {
            return Err(unusable(&"it holds no certificate in PEM"));
        }
        let own = ParsedCertificate::try_from(&chain[0]).map_err(|err| unusable(&err))?;
        for name in names {
            let server = ServerName::try_from(name.trim_end_matches('.'));
            let is_for = server.is_ok_and(|server| verify_server_name(&own, &server).is_ok());
            if !is_for {
                return Err(unusable(&format_args!("it isn't for the name {name}")));
            }
        }
        let key = PrivateKeyDer::from_pem_slice(&certificate.key_pem)
            .map_err(|err| unusable(&format!("the key: {err}")))?;
        let provider = Arc::new(crypto::ring::default_provider());
        let config = ServerConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .and_then(|config| config.with_no_client_auth().with_single_cert(chain, key))
            .map_err(|err| unusable(&err))?;
        Ok(TlsAcceptor::from(Arc::new(config)))
    }
}

/// Replacement for systems without HTTPS support.
#[cfg(not(unix))]
mod none {
    use tokio::net::TcpStream;

    use super::{Certificate, ServeError};

    #[derive(Clone)]
    pub(in super::super) enum TlsAcceptor {}

    impl TlsAcceptor {
        pub(in super::super) async fn accept(self, _: TcpStream) -> std::io::Result<TcpStream> {
            match self {}
        }
    }

    pub(in super::super) fn acceptor(
        _: &Certificate,
        _: &[String],
    ) -> Result<TlsAcceptor, ServeError> {
        Err(ServeError::Certificate("HTTPS isn't available on this system".into()))
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_certificate_is_said() {
        for (chain, key) in
            [("", ""), ("nonsense", "nonsense"), ("-----BEGIN CERTIFICATE-----", "")]
        {
            let certificate = Certificate { chain_pem: chain.into(), key_pem: key.into() };
            assert!(
                matches!(acceptor(&certificate, &[]), Err(ServeError::Certificate(_))),
                "{chain}"
            );
        }
    }
}
