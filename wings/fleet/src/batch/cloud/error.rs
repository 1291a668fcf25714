//! Errors of object stores.

use std::error::Error;

use object_store::client::{HttpError, HttpErrorKind};

/// Error of an object store. Never holds the store's answer, which may repeat a key.
#[derive(Debug, thiserror::Error)]
#[error("{}: {address}", .why.words())]
pub struct CloudError {
    /// Fault of the store or of the request.
    pub why: Why,
    /// Address of the request.
    pub address: String,
}

/// Fault of an object store, or of a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Why {
    /// No credentials.
    NoCredentials,
    /// Refusal by the store, with the store's error code.
    Refused(String),
    /// No such bucket.
    NoBucket,
    /// No answer, or a broken-off answer, in spite of several tries.
    NoAnswer,
    /// The endpoint has no TLS, and no setting allows plain HTTP.
    NoTls,
    /// Invalid variable of the environment.
    Settings(String),
    /// Error answered by the store.
    Failed(String),
}

impl Why {
    fn words(&self) -> String {
        match self {
            Self::NoCredentials => "no credentials for the object store".into(),
            Self::Refused(code) => format!("the object store refuses it ({code})"),
            Self::NoBucket => "there is no such bucket".into(),
            Self::NoAnswer => "the object store doesn't answer".into(),
            Self::NoTls => "the endpoint of the object store has no TLS".into(),
            Self::Settings(what) => format!("the settings of the object store don't fit ({what})"),
            Self::Failed(code) => format!("the object store fails ({code})"),
        }
    }
}

impl CloudError {
    /// The next action.
    pub fn next_action(&self) -> &'static str {
        match self.why {
            Why::NoCredentials => {
                "Set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or start it where the machine has a role."
            }
            Why::Refused(_) => {
                "Check the keys, AWS_REGION, and that they may list the bucket, read sessions and write results."
            }
            Why::NoBucket => "Check the bucket's name, AWS_REGION and AWS_ENDPOINT_URL.",
            Why::NoAnswer => {
                "Check AWS_ENDPOINT_URL and the network, then run it again: what is done stays done."
            }
            Why::NoTls => "If that is meant, set AWS_ALLOW_HTTP=true. Otherwise use https://…",
            Why::Settings(_) => "Check the variables AWS_….",
            Why::Failed(_) => "Run it again: what is done stays done.",
        }
    }

    /// Converts the error of a request for `address`.
    pub(super) fn of(err: &object_store::Error, address: String) -> Self {
        use object_store::Error as E;
        let code = code(err);
        let named = |usual: &str| code.clone().unwrap_or_else(|| usual.to_owned());
        let why = match err {
            _ if code.as_deref() == Some("NoSuchBucket") => Why::NoBucket,
            E::PermissionDenied { .. } => Why::Refused(named("403")),
            E::Unauthenticated { .. } => Why::Refused(named("401")),
            E::NotFound { .. } => Why::Failed(named("404")),
            _ if is_cut(err) => Why::NoAnswer,
            _ => match code {
                // Wrong keys and regions also come back as 400.
                Some(code) if is_refusal(&code) => Why::Refused(code),
                Some(code) => Why::Failed(code),
                None => Why::Failed("not an answer of S3".into()),
            },
        };
        Self { why, address }
    }
}

fn is_refusal(code: &str) -> bool {
    ["Authorization", "Token", "AccessKey", "Signature", "Denied"]
        .iter()
        .any(|part| code.contains(part))
}

/// Every cause of `err`, starting with `err`.
fn causes(err: &object_store::Error) -> impl Iterator<Item = &(dyn Error + 'static)> {
    let first: &(dyn Error + 'static) = err;
    std::iter::successors(Some(first), |&cause| cause.source())
}

/// The store's own name for the error: the only part of its answer safe to show.
fn code(err: &object_store::Error) -> Option<String> {
    causes(err).find_map(|cause| {
        let text = cause.to_string();
        let (_, rest) = text.split_once("<Code>")?;
        let (code, _) = rest.split_once("</Code>")?;
        let is_name = code.len() <= 64 && code.chars().all(|letter| letter.is_ascii_alphanumeric());
        is_name.then(|| code.to_owned())
    })
}

/// True for a broken-off exchange, perhaps received by the store, or received in part.
pub(super) fn is_broken_off(err: &object_store::Error) -> bool {
    let http = causes(err).find_map(|cause| cause.downcast_ref::<HttpError>());
    http.is_some_and(|http| http.kind() != HttpErrorKind::Connect)
}

/// True if the network, not the store, is to blame.
fn is_cut(err: &object_store::Error) -> bool {
    causes(err).any(<dyn Error>::is::<HttpError>)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn generic(text: &str) -> object_store::Error {
        object_store::Error::Generic { store: "S3", source: text.to_owned().into() }
    }

    #[test]
    fn what_a_store_answers_is_not_repeated() {
        let answer = "<Error><Code>InvalidAccessKeyId</Code><AWSAccessKeyId>AKIASECRET</AWSAccessKeyId></Error>";
        let err = CloudError::of(&generic(answer), "s3://fleet".into());
        assert_eq!(err.why, Why::Refused("InvalidAccessKeyId".into()));
        assert!(!format!("{err:#} {err:?} {}", err.next_action()).contains("AKIA"));
        let err = CloudError::of(&generic("<Code>SlowDown</Code>"), "s3://fleet".into());
        assert_eq!(err.to_string(), "the object store fails (SlowDown): s3://fleet");
        let odd = CloudError::of(&generic("<Code>AKIA SECRET</Code>"), "s3://fleet".into());
        assert!(!odd.to_string().contains("AKIA"), "{odd}");
    }
}
