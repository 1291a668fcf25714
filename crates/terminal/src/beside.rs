//! Companions of a session in the terminal: a phone's page, a voice.

#[cfg(feature = "serve")]
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[cfg(feature = "serve")]
use anyhow::Context;
use clap::Args;

#[cfg(any(feature = "serve", feature = "window"))]
use crate::announcer;
use crate::{operation::Operation, say, stop_flag};
use boresight_app::{Announcer, Host, NoVoice, Voice};
#[cfg(feature = "serve")]
use boresight_files::{Links, read, read_or_make_private};
#[cfg(feature = "serve")]
use boresight_phone::{Certificate, Secret, ServeAddress, Setup, session_page::Phone};
#[cfg(feature = "serve")]
use boresight_present::text::phone::LINGERING;

/// Maximum bytes of a certificate or key.
#[cfg(feature = "serve")]
const LARGEST_PEM: u64 = 1 << 20;

/// Makes the lines of a QR code.
pub type Code = Box<dyn Fn() -> Vec<String> + Send + Sync>;

/// Phone and voice beside a session.
#[derive(Debug, Args)]
#[command(next_help_heading = "Phone and voice")]
pub struct BesideArguments {
    /// Serve a page for a phone on the local network, with the live picture, the next pose, a
    /// voice, and buttons. Prints a link with a secret key and a QR code; only who has it is let
    /// in. ADDRESS: an address of this computer, a port (:8000), or both [default: every address,
    /// port 8417].
    #[cfg(feature = "serve")]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "")]
    serve: Option<String>,
    #[cfg(feature = "serve")]
    #[command(flatten)]
    names: NameArguments,
    #[command(flatten)]
    voice: VoiceArguments,
}

/// Names of this computer.
#[cfg(feature = "serve")]
#[derive(Debug, Args)]
pub struct NameArguments {
    /// A name of this computer by which a phone may open the page; repeat for several. Addresses
    /// need no name.
    #[arg(long, value_name = "NAME")]
    serve_name: Vec<String>,
    /// Serve HTTPS with this certificate (PEM, with those that it rests on) for one of the names.
    #[arg(long, value_name = "FILE", requires = "tls_key", requires = "serve_name")]
    tls_cert: Option<PathBuf>,
    /// The certificate's private key (PEM).
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Keep the secret of the links in this file: phones then stay connected when boresight is
    /// started again, and the QR code stays the same. The file is made if it isn't there, readable
    /// by you only. Delete it to shut everybody out. Without this option, links are new at each
    /// start.
    #[arg(long, value_name = "FILE")]
    serve_key: Option<PathBuf>,
}

/// The computer's voice.
#[derive(Debug, Args)]
pub struct VoiceArguments {
    /// Say aloud what to do, through spd-say or espeak-ng. With WHERE, as --stand WHERE.
    #[arg(long, value_name = "WHERE", num_args = 0..=1)]
    speak: Option<Option<Stands>>,
    /// Where the person stands: facing the camera, or behind it. Left and right are then theirs, in
    /// the window, the terminal and the voice [default: as in the window the last time, or facing].
    #[arg(long, value_name = "WHERE")]
    stand: Option<Stands>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Stands {
    Facing,
    Behind,
}

impl BesideArguments {
    /// True if a voice is requested.
    #[cfg(feature = "window")]
    pub fn speaks(&self) -> bool {
        self.voice.speak.is_some()
    }

    /// True if the person faces the camera; `None` if nobody says so.
    #[cfg(feature = "window")]
    pub fn stands_facing(&self) -> Option<bool> {
        self.voice.stands().map(|stands| stands == Stands::Facing)
    }

    /// Announcer beside a rig's window, whose pictures aren't mirrored, unless the voice addresses
    /// someone facing the camera.
    #[cfg(feature = "window")]
    pub fn announcer_of_rig(&self) -> Announcer {
        if self.speaks() && self.faces() { announcer() } else { announcer().from_behind() }
    }

    /// True if the person faces the camera, which is usual.
    pub fn faces(&self) -> bool {
        self.voice.faces()
    }

    /// `announcer` with the person's left and right.
    pub fn for_person(&self, announcer: Announcer) -> Announcer {
        self.voice.for_person(announcer)
    }

    /// Requested voice.
    pub fn voice(&self) -> anyhow::Result<Option<Voice>> {
        self.voice.start()
    }

    /// Starts the requested companions, `operation` among them.
    pub fn start(&self, operation: Operation, announcer: Announcer) -> anyhow::Result<Beside> {
        let voice = self.voice.start()?;
        let mut host = Host::new(announcer, stop_flag()?).beside(Arc::new(operation));
        if let Some(voice) = &voice {
            host = host.paced(true).beside(voice.companion());
        }
        #[cfg(feature = "serve")]
        let phone = self.phone()?.map(Arc::new);
        #[cfg(feature = "serve")]
        if let Some(phone) = &phone {
            host = host.paced(true).beside(Arc::clone(phone) as _);
        }
        Ok(Beside {
            host,
            _voice: voice,
            #[cfg(feature = "serve")]
            phone,
        })
    }

    /// Requested phone page, being served.
    #[cfg(feature = "serve")]
    pub fn phone(&self) -> anyhow::Result<Option<Phone>> {
        self.serve.as_deref().map(|address| self.names.phone(address)).transpose()
    }
}

/// Host with the companions that the command line asks for.
pub struct Beside {
    /// Host of the sessions.
    pub host: Host,
    _voice: Option<Voice>,
    #[cfg(feature = "serve")]
    phone: Option<Arc<Phone>>,
}

impl Beside {
    /// True if a phone's page is served.
    pub fn has_phone(&self) -> bool {
        #[cfg(feature = "serve")]
        return self.phone.is_some();
        #[cfg(not(feature = "serve"))]
        false
    }

    /// Lines of the link's QR code.
    pub fn code(&self) -> Option<Code> {
        #[cfg(feature = "serve")]
        return Some(Box::new(self.phone.as_ref()?.code()));
        #[cfg(not(feature = "serve"))]
        None
    }

    /// Waits until nobody looks at the phone's page. True if two more views are requested.
    pub fn wants_more(&self) -> bool {
        #[cfg(feature = "serve")]
        return self
            .phone
            .as_ref()
            .is_some_and(|phone| phone.linger(self.host.stop(), LINGERING, self.host.announcer()));
        #[cfg(not(feature = "serve"))]
        false
    }
}

impl VoiceArguments {
    /// Where the person stands, if anybody says so.
    fn stands(&self) -> Option<Stands> {
        self.speak.flatten().or(self.stand)
    }

    /// True if the person faces the camera.
    fn faces(&self) -> bool {
        self.stands() != Some(Stands::Behind)
    }

    /// `announcer` with the person's left and right.
    pub fn for_person(&self, announcer: Announcer) -> Announcer {
        if self.faces() { announcer } else { announcer.from_behind() }
    }

    /// Starts the requested voice.
    pub fn start(&self) -> anyhow::Result<Option<Voice>> {
        if self.speak.is_none() {
            return Ok(None);
        }
        let mut voice = Voice::new();
        match voice.switch(true, self.faces()) {
            Ok(()) => Ok(Some(voice)),
            // A session works without a voice, too.
            Err(err @ NoVoice::NoProgram) => {
                say(&err.to_string());
                Ok(None)
            }
            Err(err) => Err(err.into()),
        }
    }
}

#[cfg(feature = "serve")]
impl NameArguments {
    /// Serves the page at `address`; empty for the default.
    pub fn phone(&self, address: &str) -> anyhow::Result<Phone> {
        let address = match address {
            "" => ServeAddress::default(),
            given => given.parse().with_context(|| format!("could not serve at {given:?}"))?,
        };
        let read = |path: &PathBuf| read(path, LARGEST_PEM, Links::Followed);
        let certificate = match (&self.tls_cert, &self.tls_key) {
            (Some(chain), Some(key)) => {
                Some(Certificate { chain_pem: read(chain)?, key_pem: read(key)? })
            }
            _ => None,
        };
        let names = self.serve_name.clone();
        let kept = self.serve_key.as_deref().map(kept_secret).transpose()?;
        let phone = Phone::start(&Setup { address, names, certificate, kept })?;
        phone.announce(&announcer());
        Ok(phone)
    }
}

/// Secret in the file at `path`; a new secret if there is no file.
#[cfg(feature = "serve")]
fn kept_secret(path: &Path) -> anyhow::Result<Secret> {
    const LARGEST_SECRET: u64 = 256;
    let fresh = Secret::random()?;
    let text = read_or_make_private(path, LARGEST_SECRET, || fresh.text() + "\n")?;
    Secret::parse(text.trim().as_bytes())
        .with_context(|| format!("not a file that --serve-key made: {path:?}"))
}
