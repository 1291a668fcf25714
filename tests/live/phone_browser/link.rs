//! Behaviour of the page with slow, cut and foreign networks, and after a phone's absence.
//! `link.js` plays the network.

use std::{
    path::Path,
    thread::sleep,
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use super::{asked_for, browser::Browser, sessions::Site};

/// A page with a network simulated.
struct Played {
    browser: Browser,
    site: Site,
}

impl Played {
    fn new((width, height): (u32, u32), before: &str) -> Self {
        let (browser, site) = (Browser::open(width, height), Site::new());
        browser.before(include_str!("link.js"));
        browser.before(before);
        browser.go(&site.link());
        Self { browser, site }
    }

    /// At the guide, with a picture.
    fn guided(size: (u32, u32)) -> Self {
        let page = Self::new(size, "");
        page.browser.until("shown === 'ask'");
        page.browser.run("el('facing').click()");
        page.browser.until("shown === 'guide' && bitmap");
        page
    }

    fn run(&self, script: &str) -> Value {
        self.browser.run(script)
    }

    fn wait(&self, secs: f64) {
        sleep(Duration::from_secs_f64(secs));
    }

    fn said(&self) -> Value {
        self.run("return spoken.map(said => said.text)")
    }

    fn sentence(&self) -> Value {
        self.run("return el('sentence').textContent")
    }
}

const PHONE: (u32, u32) = (360, 740);

#[test]
fn a_view_is_told_once_however_the_link_is_cut() {
    let Some(_) = asked_for() else { return };
    let page = Played::guided(PHONE);
    page.run("net.halves = 2; net.take()");
    page.browser.until("spoken.length");
    page.wait(6.0);
    assert_eq!(page.said(), json!(["Taken"]));
    assert_eq!(page.run("return el('views').textContent"), "2");
}

#[test]
fn views_taken_before_a_restart_are_told_after_it() {
    let Some(_) = asked_for() else { return };
    let page = Played::guided(PHONE);
    page.run("net.cut = true; net.break(); net.take(); net.take(); net.restart(); net.cut = false");
    page.browser.until("spoken.length");
    page.wait(3.0);
    assert_eq!(page.said(), json!(["Views were taken meanwhile"]));
    // A later view is announced, though its number was used before.
    page.run("net.take()");
    page.browser.until("spoken.length > 1");
    assert_eq!(page.said()[1], "Taken");
}

#[test]
fn a_slow_link_works() {
    let Some(_) = asked_for() else { return };
    for delay_ms in [350, 700] {
        let page = Played::guided(PHONE);
        page.run(&format!("net.delay = {delay_ms}; net.break(); net.news = []"));
        page.browser.until("el('sentence').textContent === 'No connection'");
        page.browser.until("el('sentence').textContent === 'Come closer'");
        page.wait(3.0);
        let before = page.said().as_array().map_or(0, Vec::len);
        page.run("window.lost = 0; setInterval(() => { if (!linked()) lost++; }, 50)");
        page.wait(8.0);
        assert_eq!(page.run("return lost"), 0, "{delay_ms} ms each way");
        assert_eq!(page.said().as_array().map(Vec::len), Some(before), "{}", page.said());
    }
}

#[test]
fn what_is_old_is_not_shown_as_new() {
    let Some(_) = asked_for() else { return };
    let page = Played::guided(PHONE);
    page.run("net.clockLate = 4000");
    page.browser.until("el('sentence').textContent === 'Slow connection'");
    page.run("net.clockLate = 0");
    page.browser.until("el('sentence').textContent === 'Come closer'");
}

#[test]
fn a_portal_is_no_connection() {
    let Some(_) = asked_for() else { return };
    let page = Played::guided(PHONE);
    page.run("net.portal = true; net.break(); net.requests = 0");
    page.wait(5.0);
    assert_eq!(page.sentence(), "No connection");
    let requests = page.run("return net.requests").as_u64().expect("a number");
    assert!(requests < 60, "{requests} requests in 5 s");
    page.run("net.portal = false");
    page.browser.until("el('sentence').textContent === 'Come closer'");
}

#[test]
fn whoever_looks_at_the_views_has_lost_no_picture() {
    let Some(_) = asked_for() else { return };
    let page = Played::guided(PHONE);
    for _ in 0..3 {
        page.run("el('list').click()");
        page.wait(1.6);
        page.run("el('close').click()");
        page.wait(1.2);
    }
    assert_eq!(page.said(), json!([]));
    // A real stop is announced.
    page.run("net.pictures = false");
    page.browser.until("spoken.length");
    assert_eq!(page.said(), json!(["No picture"]));
}

#[test]
fn the_verdict_is_spoken_and_two_more_are_a_tap_away() {
    let Some(_) = asked_for() else { return };
    let page = Played::guided(PHONE);
    page.run(
        "net.ended = {verdict: 'good', what: 'Good', action: '', aloud: 'Good. You can use it', lines: [], findings: [],
            image_size_px: [640, 360], map: null, can_restart: false, can_go_on: true, files: []};
        net.live = {...net.live, stage: 'ended'}",
    );
    page.browser.until("shown === 'result' && spoken.length");
    assert_eq!(page.said(), json!(["Good. You can use it"]));
    page.run("el('more').click()");
    page.browser.until("net.commands.length");
    assert_eq!(page.run("return net.commands"), json!([{"command": "more"}]));
}

#[test]
fn a_link_that_is_used_up_says_so_and_its_first_phone_goes_on() {
    let Some(_) = asked_for() else { return };
    let used = Played::new(PHONE, "net.status = 410");
    used.browser.until("el('closedwhat').textContent === 'This link is used up'");
    drop(used);
    let mine = Played::guided(PHONE);
    // The link from the history, in the browser that has used it: its key still opens the page.
    mine.browser
        .before("if (location.hash) net.status = 410; setTimeout(() => { net.status = 0; }, 500)");
    mine.browser.go("about:blank");
    mine.browser.go(&mine.site.link());
    mine.browser.until("shown === 'ask'");
    assert_eq!(mine.run("return [role, location.hash]"), json!(["owner", ""]));
}

#[test]
fn every_control_is_reached_at_every_size() {
    let Some(folder) = asked_for() else { return };
    let shoot = |page: &Played, name: &Path| page.browser.shoot(&folder.join(name));
    // Portrait, landscape with and without the browser's bar, and both at 200 %.
    for (width, height) in [PHONE, (740, 360), (740, 300), (667, 331), (180, 370), (370, 180)] {
        let page = Played::guided((width, height));
        page.wait(0.5);
        shoot(&page, Path::new(&format!("controls-{width}x{height}.png")));
        assert_eq!(page.run("return el('tag').hidden ? '' : el('tag').textContent"), "SIMULATED");
        let outside = page.run(
            "const box = el('guide').getBoundingClientRect(), of = { h: el('guide').scrollHeight, w: el('guide').scrollWidth };
            return ['pause', 'undo', 'take', 'end', 'sound', 'list', 'views'].filter(id => {
                const at = el(id).getBoundingClientRect();
                return !at.width || at.left < box.left || at.right > box.left + of.w + 1 || at.top < box.top || at.bottom > box.top + of.h + 1
                    || el(id).scrollWidth > el(id).clientWidth + 1 && el(id).clientWidth > 0 || at.right > innerWidth + 1;
            })",
        );
        assert_eq!(outside, json!([]), "{width}x{height}");
        let scrolls = page.run("return el('guide').scrollHeight > innerHeight + 1");
        assert_eq!(scrolls, width.min(height) < 200, "{width}x{height}");
    }
}

#[test]
fn a_doubt_is_one_line_that_leaves_the_picture_free() {
    let Some(folder) = asked_for() else { return };
    for (width, height) in [PHONE, (740, 360)] {
        let page = Played::guided((width, height));
        page.run(
            "net.live = { ...net.live, doubt: ['Focus, zoom and exposure can\\'t be locked from here', 'Switch off autofocus.'] }; net.break()",
        );
        page.browser.until("!el('doubt').hidden");
        page.browser.shoot(&folder.join(format!("doubt-{width}x{height}.png")));
        let free = page.run(
            "const line = el('doubt').getBoundingClientRect(), picture = el('live').getBoundingClientRect();
            return [el('trouble').hidden, line.height < 30, line.top >= picture.bottom || line.left >= picture.right]",
        );
        assert_eq!(free, json!([true, true, true]), "{width}x{height}");
        page.run("el('doubt').click()");
        let told = page.run("return el('toast').textContent");
        assert!(
            told.as_str().is_some_and(|told| told.ends_with("Switch off autofocus.")),
            "{told}"
        );
    }
}

#[test]
fn the_page_is_light_or_dark_as_the_phone_is() {
    let Some(folder) = asked_for() else { return };
    let page = Played::guided(PHONE);
    let ground = || page.run("return getComputedStyle(document.body).backgroundColor");
    let dark = ground();
    page.run("el('light').click()");
    page.browser.shoot(&folder.join("controls-light.png"));
    let light = ground();
    assert_ne!(dark, light);
    // It's kept.
    page.browser.go("about:blank");
    page.browser.go(page.site.link().split('#').next().expect("an address"));
    page.browser.until("shown === 'ask'");
    assert_eq!(ground(), light);
}

#[test]
fn a_paused_session_reminds_whoever_only_hears() {
    let Some(_) = asked_for() else { return };
    let page = Played::guided(PHONE);
    let began = Instant::now();
    page.run("net.live = {...net.live, paused: true}");
    page.browser.until("spoken.length");
    assert_eq!(page.said(), json!(["Still paused"]));
    assert!(began.elapsed() > Duration::from_secs(25));
}
