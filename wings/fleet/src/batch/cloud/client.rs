//! Requests to a bucket.

use std::{
    future::Future,
    pin::pin,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{Builder, JoinHandle},
    time::{Duration, Instant},
};

use anyhow::Context;
use object_store::{
    BackoffConfig, ClientOptions, RetryConfig,
    aws::{AmazonS3, AmazonS3Builder, AmazonS3ConfigKey},
};
use tokio::{
    runtime::{self, Handle},
    sync::oneshot,
    time::{sleep, timeout},
};

use super::error::{CloudError, Why, is_broken_off};

/// Requests in flight at a time.
pub(super) const AT_ONCE: usize = 32;
/// Silence before a request is repeated.
const SILENCE: Duration = Duration::from_secs(20);
const CONNECT_WITHIN: Duration = Duration::from_secs(5);
/// Maximum tries of a request, the longest pause between two, and the longest time for all.
const TRIES: usize = 10;
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
const RETRY_FOR: Duration = Duration::from_secs(180);
/// Pauses before a broken-off exchange is repeated.
const PAUSES: [Duration; 4] = [
    Duration::from_millis(200),
    Duration::from_secs(1),
    Duration::from_secs(3),
    Duration::from_secs(5),
];
/// Time allowed for credentials. Machines with roles have theirs at once.
const CREDENTIALS_WITHIN: Duration = Duration::from_secs(15);
/// Time between two checks of the stop flag during a wait.
const LOOK: Duration = Duration::from_millis(100);

/// A bucket, and the thread waiting for answers.
#[derive(Debug)]
pub(super) struct Client {
    pub(super) store: AmazonS3,
    pub(super) bucket: String,
    reactor: Reactor,
}

/// End of a limited wait.
pub(super) enum Waited<T> {
    /// The awaited result.
    Done(T),
    /// The wait took longer than allowed.
    TooLong,
    /// The batch was asked to stop.
    Stopped,
}

impl Client {
    /// Opens `bucket` with the endpoint and credentials of the environment's variables `AWS_…`.
    ///
    /// # Errors
    ///
    /// [`CloudError`].
    pub(super) fn open(bucket: &str) -> anyhow::Result<Arc<Self>> {
        let address = || format!("s3://{bucket}");
        let failed = |why| CloudError { why, address: address() };
        // An already installed provider is the same one.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let store = builder(bucket).map_err(failed)?.build();
        let store = store.map_err(|err| failed(Why::Settings(first_line(&err))))?;
        let client =
            Arc::new(Self { store, bucket: bucket.to_owned(), reactor: Reactor::start()? });
        let provider = client.store.credentials();
        let credentials =
            client.wait(async { timeout(CREDENTIALS_WITHIN, provider.get_credential()).await });
        let is_public = std::env::var("AWS_SKIP_SIGNATURE").is_ok_and(|set| set == "true");
        if !is_public && !matches!(credentials, Ok(Ok(_))) {
            return Err(failed(Why::NoCredentials).into());
        }
        Ok(client)
    }

    /// Error for a failed request for `key`.
    pub(super) fn error(&self, err: &object_store::Error, key: &str) -> CloudError {
        let address = format!("s3://{}/{key}", self.bucket);
        CloudError::of(err, address.trim_end_matches('/').to_owned())
    }

    pub(super) fn wait<T>(&self, answer: impl Future<Output = T>) -> T {
        self.reactor.wait(answer)
    }

    /// Waits for `answer` for at most `budget`, or until `stop` is set.
    pub(super) fn wait_within<T>(
        &self,
        answer: impl Future<Output = T>,
        budget: Duration,
        stop: &AtomicBool,
    ) -> Waited<T> {
        let began = Instant::now();
        self.reactor.wait(async {
            let mut answer = pin!(answer);
            loop {
                if stop.load(Ordering::Relaxed) {
                    return Waited::Stopped;
                }
                let left = budget.saturating_sub(began.elapsed());
                match timeout(left.min(LOOK), &mut answer).await {
                    Ok(done) => return Waited::Done(done),
                    Err(_) if began.elapsed() >= budget => return Waited::TooLong,
                    Err(_) => {}
                }
            }
        })
    }
}

/// Repeats `ask` until the answer is whole. Beyond the retries of single requests, this covers
/// broken-off answers, and requests the store may have received.
pub(super) async fn whole<T>(
    mut ask: impl AsyncFnMut() -> object_store::Result<T>,
) -> object_store::Result<T> {
    let began = Instant::now();
    for pause in PAUSES {
        match ask().await {
            Err(err) if is_broken_off(&err) && began.elapsed() < RETRY_FOR => sleep(pause).await,
            answer => return answer,
        }
    }
    ask().await
}

/// Configures the bucket from the environment.
fn builder(bucket: &str) -> Result<AmazonS3Builder, Why> {
    let options = ClientOptions::new()
        .with_timeout_disabled()
        .with_connect_timeout(CONNECT_WITHIN)
        .with_read_timeout(SILENCE);
    let backoff = BackoffConfig { max_backoff: LONGEST_PAUSE, ..BackoffConfig::default() };
    let retry = RetryConfig { backoff, max_retries: TRIES, retry_timeout: RETRY_FOR };
    let mut builder = AmazonS3Builder::new().with_client_options(options).with_retry(retry);
    let (mut endpoint, mut allows_http) = (None, false);
    for (name, value) in std::env::vars_os() {
        let (Some(name), Some(value)) = (name.to_str(), value.to_str()) else { continue };
        if !name.starts_with("AWS_") || value.is_empty() {
            continue;
        }
        let Ok(key) = name.to_ascii_lowercase().parse::<AmazonS3ConfigKey>() else { continue };
        match name {
            "AWS_ENDPOINT_URL_S3" => endpoint = Some(value.to_owned()),
            "AWS_ENDPOINT_URL" | "AWS_ENDPOINT" if endpoint.is_none() => {
                endpoint = Some(value.to_owned());
            }
            "AWS_ALLOW_HTTP" => allows_http = value.eq_ignore_ascii_case("true") || value == "1",
            _ => {}
        }
        builder = builder.with_config(key, value);
    }
    if !allows_http && endpoint.is_some_and(|endpoint| endpoint.starts_with("http://")) {
        return Err(Why::NoTls);
    }
    Ok(builder.with_bucket_name(bucket))
}

fn first_line(err: &object_store::Error) -> String {
    err.to_string().lines().next().unwrap_or_default().to_owned()
}

/// Thread driving requests; any number of other threads wait for their own.
#[derive(Debug)]
struct Reactor {
    handle: Handle,
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Reactor {
    fn start() -> anyhow::Result<Self> {
        let runtime = runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.context("could not wait for an object store")?;
        let handle = runtime.handle().clone();
        let (end, ended) = oneshot::channel();
        let thread = Builder::new().name("cloud".into()).spawn(move || {
            // The thread ends when the sender is dropped.
            let _ = runtime.block_on(ended);
        })?;
        Ok(Self { handle, end: Some(end), thread: Some(thread) })
    }

    fn wait<T>(&self, answer: impl Future<Output = T>) -> T {
        self.handle.block_on(answer)
    }
}

impl Drop for Reactor {
    fn drop(&mut self) {
        self.end = None;
        if let Some(thread) = self.thread.take() {
            // The thread has printed a panic; there is nothing to add.
            thread.join().ok();
        }
    }
}
