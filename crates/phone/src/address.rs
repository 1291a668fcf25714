//! Addresses: the server's own, and those of the page.

use std::{
    collections::BTreeSet,
    fmt,
    net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket},
    str::FromStr,
};

/// Default port.
pub const DEFAULT_PORT: u16 = 8417;

/// Address to serve at, as typed: `192.168.1.7`, `192.168.1.7:8000`, `:8000`, `[::]:8000`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServeAddress {
    pub(super) bind: SocketAddr,
    /// True if another port is acceptable.
    pub(super) any_port: bool,
}

impl Default for ServeAddress {
    fn default() -> Self {
        let bind = SocketAddr::new(Ipv4Addr::UNSPECIFIED.into(), DEFAULT_PORT);
        Self { bind, any_port: true }
    }
}

/// Error of a text that isn't an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not an address: write one like 192.168.1.7, 192.168.1.7:8417 or :8417")]
pub struct NoAddress;

impl FromStr for ServeAddress {
    type Err = NoAddress;

    fn from_str(text: &str) -> Result<Self, NoAddress> {
        let usual = Self::default();
        let is_any = |port: u16| port == 0;
        if let Some(port) = text.strip_prefix(':').filter(|port| !port.contains(':')) {
            let port = port.parse().map_err(|_| NoAddress)?;
            return Ok(Self {
                bind: SocketAddr::new(usual.bind.ip(), port),
                any_port: is_any(port),
            });
        }
        if let Ok(bind) = text.parse::<SocketAddr>() {
            return Ok(Self { bind, any_port: is_any(bind.port()) });
        }
        let bare = text.strip_prefix('[').and_then(|text| text.strip_suffix(']')).unwrap_or(text);
        let ip: IpAddr = bare.parse().map_err(|_| NoAddress)?;
        Ok(Self { bind: SocketAddr::new(ip, DEFAULT_PORT), any_port: true })
    }
}

impl fmt::Display for ServeAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.bind.fmt(f)
    }
}

/// Addresses by which other devices reach `bound`, the likeliest first; at least one.
pub(super) fn reachable(bound: SocketAddr) -> Vec<SocketAddr> {
    if !bound.ip().is_unspecified() {
        return vec![bound];
    }
    // No packet is sent: the system only reports the source address it would use. The first is the
    // route to everywhere, the others are routes into private networks without a default route.
    let towards = ["192.0.2.1:9", "192.168.255.254:9", "10.255.255.254:9", "172.31.255.254:9"];
    let mut seen = BTreeSet::new();
    let mut found: Vec<SocketAddr> = towards
        .iter()
        .filter_map(|target| {
            let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
            socket.connect(target).ok()?;
            Some(socket.local_addr().ok()?.ip())
        })
        .filter(|ip| !ip.is_unspecified() && seen.insert(*ip))
        .map(|ip| SocketAddr::new(ip, bound.port()))
        .collect();
    if found.is_empty() {
        found.push(SocketAddr::new(Ipv4Addr::LOCALHOST.into(), bound.port()));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_what_a_person_writes() {
        let read = |text: &str| text.parse::<ServeAddress>().map(|address| address.to_string());
        assert_eq!(read("192.168.1.7"), Ok("192.168.1.7:8417".into()));
        assert_eq!(read(":80"), Ok("0.0.0.0:80".into()));
        assert_eq!(read("[::1]:80"), Ok("[::1]:80".into()));
        assert_eq!(read("::1"), Ok("[::1]:8417".into()));
        for other in ["", ":", "80", "example.org", "1.2.3.4:99999", "http://1.2.3.4"] {
            assert_eq!(read(other), Err(NoAddress), "{other}");
        }
    }

    #[test]
    fn there_is_always_a_way_to_the_page() {
        let bound = SocketAddr::new(Ipv4Addr::UNSPECIFIED.into(), 1234);
        let found = reachable(bound);
        assert!(!found.is_empty() && found.iter().all(|at| at.port() == 1234));
        assert!(found.iter().all(|at| !at.ip().is_unspecified()));
    }
}
