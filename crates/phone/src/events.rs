//! Event stream to a page: the newest state when the link has room, and all news.

use std::{
    pin::Pin,
    sync::{Arc, Mutex, PoisonError},
    task::{Context, Poll},
    time::{Duration, Instant},
};

use axum::body::{Body, Bytes, HttpBody};
use http_body::Frame;
use serde::Serialize;
use tokio::sync::{mpsc, watch};

use super::{
    hub::{Hub, Stage, State},
    keys::Role,
    view,
};
use boresight_present::browser::{NewsEvent, PlanSource, counted};

/// Maximum time between two messages, to show a page that the link works.
const HEARTBEAT: Duration = Duration::from_millis(500);
/// Minimum time between two states.
const SHORTEST: Duration = Duration::from_millis(50);
/// Maximum number of states sent per second, over all watching pages.
const MOST_STATES_PER_SEC: f64 = 200.0;
/// Maximum wait of a state for the next decision: the state is then new when sent, and the pages
/// rest while the detector works.
const ALIGNED_WITHIN: Duration = Duration::from_millis(40);

/// Newest state as JSON, made once for all pages.
#[derive(Default)]
pub(super) struct States {
    last: Option<Arc<Composed>>,
}

struct Composed {
    version: u64,
    live: String,
    source: Option<(PlanSource, String)>,
    plan: Option<Arc<str>>,
    ended: Option<Arc<str>>,
}

impl States {
    fn compose(&mut self, state: &State, hub: &Hub) -> Arc<Composed> {
        if let Some(last) = &self.last
            && last.version == state.version
        {
            return Arc::clone(last);
        }
        // Unchanged parts keep their memory; pages compare pointers to skip them.
        let kept = |new: Option<String>, old: Option<&Arc<str>>| {
            let new = new?;
            Some(old.filter(|old| ***old == *new).map_or_else(|| new.into(), Arc::clone))
        };
        let last = self.last.as_ref();
        let source = view::source(state, hub);
        let same = last.filter(|last| source.is_some() && last.source == source);
        let plan = match same {
            Some(last) => last.plan.clone(),
            None => kept(
                view::plan(state, source.as_ref()).map(|plan| json(&plan)),
                last.and_then(|last| last.plan.as_ref()),
            ),
        };
        let ended = match &state.stage {
            Stage::Ended(ended) => Some(json(&**ended)),
            _ => None,
        };
        let composed = Arc::new(Composed {
            version: state.version,
            live: json(&view::live(state)),
            source,
            plan,
            ended: kept(ended, last.and_then(|last| last.ended.as_ref())),
        });
        self.last = Some(Arc::clone(&composed));
        composed
    }
}

fn json(value: &impl Serialize) -> String {
    // All keys are strings and all numbers finite.
    serde_json::to_string(value).unwrap_or_default()
}

/// Last state, shared between pages on a thread.
pub(super) type SharedStates = Arc<Mutex<States>>;

/// Follows the hub for a page until the page is gone. Sends the news after number `seen`; without a
/// number, only news from now on.
pub(super) fn follow(hub: Arc<Hub>, states: SharedStates, role: Role, seen: Option<u64>) -> Body {
    let (sender, receiver) = mpsc::channel(1);
    hub.page_came(role);
    let page = Page { hub, role };
    tokio::spawn(async move {
        let changes = page.hub.states();
        tell(&page.hub, &states, changes, &sender, (role, seen)).await;
        drop(page);
    });
    Body::new(Events { receiver })
}

/// Counter of a page for the time of its presence.
struct Page {
    hub: Arc<Hub>,
    role: Role,
}

impl Drop for Page {
    fn drop(&mut self) {
        self.hub.page_left(self.role);
    }
}

async fn tell(
    hub: &Hub,
    states: &SharedStates,
    mut changes: watch::Receiver<State>,
    sender: &mpsc::Sender<Bytes>,
    (role, seen): (Role, Option<u64>),
) {
    let mut seen = seen.unwrap_or_else(|| changes.borrow().news);
    let (mut plan, mut ended): (Option<Arc<str>>, Option<Arc<str>>) = (None, None);
    loop {
        // Wait for room first, so that the state sent is as new as possible.
        let Ok(room) = sender.reserve().await else { return };
        let state = changes.borrow_and_update().clone();
        let composed = states.lock().unwrap_or_else(PoisonError::into_inner).compose(&state, hub);
        let mut text = String::with_capacity(composed.live.len() + 64);
        for news in &hub.news_after(seen, &state) {
            let age_ms = u64::try_from(news.came.elapsed().as_millis()).unwrap_or(u64::MAX);
            let (view, say) = (news.what.view.map(counted), &news.what.word);
            let event = NewsEvent { number: news.number, age_ms, view, say };
            push(&mut text, "news", &json(&event));
        }
        seen = state.news;
        // The first event gives a page the number from which on it has received everything.
        let parts = [(&mut plan, &composed.plan, "plan"), (&mut ended, &composed.ended, "ended")];
        for (sent, part, name) in parts {
            let same = match (&*sent, part) {
                (Some(sent), Some(part)) => Arc::ptr_eq(sent, part),
                (None, None) => true,
                _ => false,
            };
            if !same {
                push(&mut text, name, part.as_deref().unwrap_or("null"));
                sent.clone_from(part);
            }
        }
        push(&mut text, "heard", &seen.to_string());
        push(&mut text, "clock", &hub.clock_ms().to_string());
        push(&mut text, "live", &composed.live);
        room.send(text.into());
        let sent = Instant::now();
        tokio::time::timeout(HEARTBEAT, changes.changed()).await.ok();
        let pause = match role {
            Role::Owner => SHORTEST,
            Role::Watcher => {
                SHORTEST.max(Duration::from_secs_f64(hub.pages() as f64 / MOST_STATES_PER_SEC))
            }
        };
        tokio::time::sleep(pause.saturating_sub(sent.elapsed())).await;
        let is_routine = matches!(changes.borrow_and_update().stage, Stage::Guiding);
        if is_routine && changes.borrow().news == seen {
            tokio::time::timeout(ALIGNED_WITHIN, changes.changed()).await.ok();
        }
        if sender.is_closed() {
            return;
        }
    }
}

fn push(text: &mut String, event: &str, data: &str) {
    for part in ["event: ", event, "\ndata: ", data, "\n\n"] {
        text.push_str(part);
    }
}

/// Body of the answer.
struct Events {
    receiver: mpsc::Receiver<Bytes>,
}

impl HttpBody for Events {
    type Data = Bytes;
    type Error = std::convert::Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        self.receiver.poll_recv(cx).map(|bytes| bytes.map(|bytes| Ok(Frame::data(bytes))))
    }
}
