//! Links, keys and roles.

use std::time::Instant;

use base64::{Engine, prelude::BASE64_URL_SAFE_NO_PAD};
use subtle::{Choice, ConditionallySelectable, ConstantTimeEq};

use super::error::ServeError;

/// Maximum number of keys in use; the key unused for longest is evicted.
const MOST_KEYS: usize = 96;
/// Number of owner keys, evicted last.
const MOST_OWNERS: usize = 16;

/// Rights of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Everything.
    Owner,
    /// Watching only.
    Watcher,
}

/// Secret of 256 random bits.
#[derive(Clone, Copy)]
pub struct Secret([u8; 32]);

impl Secret {
    /// New secret.
    ///
    /// # Errors
    ///
    /// [`ServeError::NoRandomness`].
    pub fn random() -> Result<Self, ServeError> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes).map_err(|_| ServeError::NoRandomness)?;
        Ok(Self(bytes))
    }

    /// Text of the secret for a link, a header or a file: 43 letters.
    pub fn text(&self) -> String {
        BASE64_URL_SAFE_NO_PAD.encode(self.0)
    }

    /// Secret from the text of [`Self::text`]; `None` for anything else.
    pub fn parse(text: &[u8]) -> Option<Self> {
        let mut bytes = [0; 33];
        // 43 letters are 32 bytes; nothing else is a secret.
        let length = BASE64_URL_SAFE_NO_PAD.decode_slice(text, &mut bytes).ok()?;
        Some(Self(bytes[..length].try_into().ok()?))
    }

    /// Comparison in constant time.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.is(other).into()
    }

    fn is(&self, other: &Self) -> Choice {
        self.0.ct_eq(&other.0)
    }

    /// Derives a secret for `purpose` (HMAC-SHA-256), computable only by the bearer of this secret.
    fn derive(&self, purpose: &[u8]) -> Self {
        Self(hmac_sha256::HMAC::mac(purpose, self.0))
    }
}

/// Links to the page by one of its addresses. Everyone with a link is let in; an owner's link lets
/// one phone in, unless links are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Links {
    /// Link with all rights.
    pub owner: String,
    /// Link for watching.
    pub watcher: String,
}

/// Both links, and the issued keys.
pub(super) struct Keys {
    pub(super) owner: Secret,
    pub(super) watcher: Secret,
    /// Secret for signing keys, if they outlive the program.
    signs: Option<Secret>,
    given: Vec<Key>,
    /// Used-up owner's links.
    spent: Vec<Spent>,
}

/// Used-up owner's link. The same bearer gets the same key again: the answer may have been lost.
struct Spent {
    link: Secret,
    /// Random number of the page that used the link.
    claim: Secret,
    key: Secret,
}

/// Answer to the bearer of a link's token.
#[derive(Clone, Copy)]
pub(super) enum Exchanged {
    /// Key for the token.
    Key(Secret, Role),
    /// Token already used by another page.
    Used,
    /// Token of no link.
    Unknown,
}

/// Random bytes of a signed key; the rest is the signature.
const NONCE: usize = 16;

struct Key {
    secret: Secret,
    role: Role,
    used: Instant,
    bucket: Bucket,
}

/// Result of checking a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Opened {
    As(Role),
    /// Valid key, but used too often in a short time.
    TooOften,
}

impl Keys {
    /// New links and keys at each start; with a `kept` secret, the same links each time, and keys
    /// valid as long as the secret is kept.
    pub(super) fn new(kept: Option<&Secret>) -> Result<Self, ServeError> {
        let (given, spent) = (Vec::new(), Vec::new());
        Ok(match kept {
            None => {
                let (owner, watcher) = (Secret::random()?, Secret::random()?);
                Self { owner, watcher, signs: None, given, spent }
            }
            Some(kept) => Self {
                owner: kept.derive(b"link of the owner"),
                watcher: kept.derive(b"link of a watcher"),
                signs: Some(kept.derive(b"signature of keys")),
                given,
                spent,
            },
        })
    }

    /// Key for the bearer of a link's `token` with the page's own random `claim`. Uses up an
    /// owner's link, unless links are kept, and replaces it with the next one.
    pub(super) fn exchange(
        &mut self,
        token: &Secret,
        claim: &Secret,
        now: Instant,
    ) -> Result<Exchanged, ServeError> {
        let owner = self.owner.is(token);
        let watcher = self.watcher.is(token);
        if !bool::from(owner | watcher) {
            return Ok(self.again(token, claim));
        }
        let role = if bool::from(owner) { Role::Owner } else { Role::Watcher };
        let mut secret = Secret::random()?;
        match (&self.signs, role) {
            (Some(signs), _) => sign(signs, &mut secret, role),
            (None, Role::Owner) => {
                let link = std::mem::replace(&mut self.owner, Secret::random()?);
                if self.spent.len() == MOST_OWNERS {
                    self.spent.remove(0);
                }
                self.spent.push(Spent { link, claim: *claim, key: secret });
            }
            (None, Role::Watcher) => {}
        }
        self.give(secret, role, now);
        Ok(Exchanged::Key(secret, role))
    }

    fn again(&self, token: &Secret, claim: &Secret) -> Exchanged {
        let mut answer = Exchanged::Unknown;
        for Spent { link, claim: of, key } in &self.spent {
            if bool::from(link.is(token)) {
                let is_same = bool::from(of.is(claim));
                answer = if is_same { Exchanged::Key(*key, Role::Owner) } else { Exchanged::Used };
            }
        }
        answer
    }

    fn give(&mut self, secret: Secret, role: Role, now: Instant) {
        let owners = self.given.iter().filter(|key| key.role == Role::Owner).count();
        if role == Role::Owner && owners >= MOST_OWNERS {
            self.forget(|key| key.role == Role::Owner);
        } else if self.given.len() >= MOST_KEYS {
            self.forget(|key| key.role == Role::Watcher);
        }
        self.given.push(Key { secret, role, used: now, bucket: Bucket::of_key(now) });
    }

    /// Role of a key issued before the program's last start; `None` for anything else.
    fn signed_role(&self, secret: &Secret) -> Option<Role> {
        let signs = self.signs.as_ref()?;
        let is_signed = |role: Role| {
            let mut wanted = *secret;
            sign(signs, &mut wanted, role);
            wanted.is(secret)
        };
        let (owner, watcher) = (is_signed(Role::Owner), is_signed(Role::Watcher));
        if bool::from(owner) {
            return Some(Role::Owner);
        }
        bool::from(watcher).then_some(Role::Watcher)
    }

    /// Opens with `secret`, compared with every key in constant time. `None` without a match.
    pub(super) fn open(&mut self, secret: &Secret, now: Instant) -> Option<Opened> {
        let (mut found, mut at) = (Choice::from(0), 0_u32);
        for (index, key) in self.given.iter().enumerate() {
            let same = key.secret.is(secret);
            at.conditional_assign(&u32::try_from(index).unwrap_or(u32::MAX), same);
            found |= same;
        }
        if !bool::from(found) {
            let role = self.signed_role(secret)?;
            self.give(*secret, role, now);
            at = u32::try_from(self.given.len()).ok()?.checked_sub(1)?;
        }
        let key = self.given.get_mut(at as usize)?;
        key.used = now;
        Some(if key.bucket.take(now) { Opened::As(key.role) } else { Opened::TooOften })
    }

    fn forget(&mut self, of: impl Fn(&Key) -> bool) {
        let oldest = (0..self.given.len())
            .filter(|at| of(&self.given[*at]))
            .min_by_key(|at| self.given[*at].used);
        if let Some(at) = oldest {
            self.given.remove(at);
        }
    }
}

/// Signs the random part of `secret` for `role`, into the other part.
fn sign(signs: &Secret, secret: &mut Secret, role: Role) {
    let mut signed = [0; NONCE + 1];
    signed[..NONCE].copy_from_slice(&secret.0[..NONCE]);
    signed[NONCE] = match role {
        Role::Owner => b'o',
        Role::Watcher => b'w',
    };
    let signature = signs.derive(&signed);
    let length = secret.0.len() - NONCE;
    secret.0[NONCE..].copy_from_slice(&signature.0[..length]);
}

/// Token bucket: maximum burst of requests, and rate per second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bucket {
    most: f64,
    per_sec: f64,
    left: f64,
    at: Instant,
}

impl Bucket {
    /// Bucket for the bearer of a key: pictures, events and a few taps.
    pub(super) fn of_key(now: Instant) -> Self {
        Self { most: 60.0, per_sec: 40.0, left: 60.0, at: now }
    }

    /// Bucket for an address without a key.
    pub(super) fn of_stranger(now: Instant) -> Self {
        Self { most: 60.0, per_sec: 20.0, left: 60.0, at: now }
    }

    pub(super) fn take(&mut self, now: Instant) -> bool {
        let secs = now.saturating_duration_since(self.at).as_secs_f64();
        self.left = (self.left + secs * self.per_sec).min(self.most);
        self.at = now;
        let is_free = self.left >= 1.0;
        self.left -= if is_free { 1.0 } else { 0.0 };
        is_free
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_token_is_exchanged_for_a_key_of_its_role() {
        let now = Instant::now();
        let mut keys = Keys::new(None).expect("randomness");
        let token = Secret::parse(keys.watcher.text().as_bytes()).expect("a token");
        let (key, role) = exchanged(&mut keys, &token, now);
        assert_eq!(role, Role::Watcher);
        assert_eq!(keys.open(&key, now), Some(Opened::As(Role::Watcher)));
        assert_eq!(keys.open(&token, now), None, "a token opens nothing by itself");
        let wrong = Secret::random().expect("randomness");
        let claim = Secret::random().expect("randomness");
        let answer = keys.exchange(&wrong, &claim, now).expect("randomness");
        assert!(matches!(answer, Exchanged::Unknown));
        assert!(Secret::parse(b"short").is_none());
        assert!(Secret::parse(&[b'A'; 44]).is_none());
        assert!(Secret::parse(&[b'A'; 10_000]).is_none());
    }

    /// Key for a link's token.
    fn exchanged(keys: &mut Keys, token: &Secret, now: Instant) -> (Secret, Role) {
        let claim = Secret::random().expect("randomness");
        match keys.exchange(token, &claim, now).expect("randomness") {
            Exchanged::Key(key, role) => (key, role),
            Exchanged::Used | Exchanged::Unknown => panic!("a link's"),
        }
    }

    #[test]
    fn an_owners_link_is_used_once_and_its_answer_may_be_lost() {
        let now = Instant::now();
        let mut keys = Keys::new(None).expect("randomness");
        let [mine, other] = [(); 2].map(|()| Secret::random().expect("randomness"));
        let (link, watcher) = (keys.owner, keys.watcher);
        let mut ask = |link, claim| match keys.exchange(&link, &claim, now).expect("randomness") {
            Exchanged::Key(key, role) => Ok((key.text(), role)),
            Exchanged::Used => Err("used"),
            Exchanged::Unknown => Err("unknown"),
        };
        let first = ask(link, mine).expect("it's new");
        assert_eq!(ask(link, mine), Ok(first), "its answer was lost on the way");
        assert_eq!(ask(link, other), Err("used"), "somebody finds it in a history");
        assert!(ask(watcher, mine).is_ok() && ask(watcher, other).is_ok(), "that one is for many");
        let next = keys.owner;
        assert_ne!(next.text(), link.text());
        assert_eq!(exchanged(&mut keys, &next, now).1, Role::Owner);
    }

    #[test]
    fn watchers_never_push_an_owner_out() {
        let now = Instant::now();
        let mut keys = Keys::new(None).expect("randomness");
        let (owner, watcher) = (keys.owner, keys.watcher);
        let (mine, _) = exchanged(&mut keys, &owner, now);
        for i in 1..500 {
            exchanged(&mut keys, &watcher, now + Duration::from_millis(i));
        }
        assert!(keys.given.len() <= MOST_KEYS);
        assert_eq!(keys.open(&mine, now), Some(Opened::As(Role::Owner)));
    }

    #[test]
    fn keys_outlive_the_program_if_a_secret_is_kept() {
        let now = Instant::now();
        let kept = Secret::random().expect("randomness");
        let mut before = Keys::new(Some(&kept)).expect("randomness");
        let (owner, watcher) = (before.owner, before.watcher);
        let mut give = |link| exchanged(&mut before, link, now).0;
        let (mine, theirs) = (give(&owner), give(&watcher));
        let mut after = Keys::new(Some(&kept)).expect("randomness");
        assert_eq!((after.owner.text(), after.watcher.text()), (owner.text(), watcher.text()));
        assert_eq!(after.open(&mine, now), Some(Opened::As(Role::Owner)));
        assert_eq!(after.open(&theirs, now), Some(Opened::As(Role::Watcher)));
        // A watcher can't turn a key into another one, and a link is no key.
        for at in 0..32 {
            let mut other = theirs;
            other.0[at] ^= 1;
            assert_eq!(after.open(&other, now), None, "byte {at}");
        }
        assert_eq!(after.open(&owner, now), None);
        let mut fresh = Keys::new(None).expect("randomness");
        assert_eq!(fresh.open(&mine, now), None);
        let other = Secret::random().expect("randomness");
        let mut replaced = Keys::new(Some(&other)).expect("randomness");
        assert_eq!(replaced.open(&mine, now), None);
        // The memory is bounded however many come back.
        for _ in 0..500 {
            let (key, _) = exchanged(&mut before, &watcher, now);
            assert_eq!(after.open(&key, now), Some(Opened::As(Role::Watcher)));
        }
        assert!(after.given.len() <= MOST_KEYS);
        assert_eq!(after.open(&mine, now), Some(Opened::As(Role::Owner)));
    }

    #[test]
    fn a_bucket_fills_again() {
        let now = Instant::now();
        let mut bucket = Bucket::of_key(now);
        assert_eq!((0..200).filter(|_| bucket.take(now)).count(), 60);
        assert!(bucket.take(now + Duration::from_millis(30)));
    }
}
