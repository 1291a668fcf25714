//! Every state of the page as a picture, for inspection.

use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread::{Builder, sleep},
    time::Duration,
};

use boresight::{boards::Pattern, serve::Stage, simulation::Scene};

use super::{
    asked_for,
    browser::Browser,
    person::read_page,
    sessions::{Site, session},
};

/// Pictures of every state, at three sizes.
#[test]
fn every_state_is_drawn() {
    let Some(folder) = asked_for() else { return };
    let sizes = [(360, 740), (740, 360), (820, 1180)];
    for (width, height) in sizes {
        let place = tempfile::tempdir().expect("a folder");
        let site = Site::new();
        let browser = Browser::open(width, height);
        let shoot =
            |name: &str| browser.shoot(&folder.join(format!("{name}-{width}x{height}.png")));
        browser.go(site.link().split('#').next().expect("an address"));
        browser.until("shown === 'closed'");
        shoot("0-closed");
        site.hub.show(Stage::Waiting(Arc::new(boresight::serve::Offer {
            cameras: vec![boresight::serve::OfferedCamera {
                source: "sim".into(),
                name: "Simulated camera".into(),
            }],
            last: Some(boresight::serve::Request {
                source: "sim".into(),
                board: [9, 6],
                pattern: Pattern::Plain,
                square_m: 0.025,
                plan: "adaptive".into(),
            }),
            dictionaries: vec![("DICT_4X4_50", 50)],
            trouble: None,
        })));
        let watcher = site.server.links()[0].watcher.clone();
        // Another address: only its fragment would change otherwise.
        let enter = |browser: &Browser, link: &str| {
            browser.go("about:blank");
            browser.go(link);
        };
        enter(&browser, &watcher);
        browser.until("shown === 'ask'");
        browser.run("el('behind').click()");
        browser.until("shown === 'wait'");
        shoot("0-watcher");
        browser.run("localStorage.clear()");
        enter(&browser, &site.link());
        browser.until("shown === 'ask'");
        shoot("1-ask");
        browser.run("el('facing').click()");
        browser.until("shown === 'wait'");
        shoot("2-wait");
        let scene = Scene::default_720p(1);
        let read = Arc::new(Mutex::new(Vec::new()));
        let over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            Builder::new()
                .spawn_scoped(scope, || {
                    let out = place.path().join("page");
                    session(&site, &scene, "quick", out, Some(Arc::clone(&read)));
                    over.store(true, Ordering::Relaxed);
                })
                .expect("a thread");
            let states = [
                ("3-guide", "live && live.stage === 'guiding' && bitmap && live.close > .3"),
                ("4-hold", "live && live.hold > .3"),
                ("5-taken", "live && live.views >= 1"),
            ];
            let reader = Builder::new()
                .spawn_scoped(scope, || read_page(&browser, (9, 6), &read, &over))
                .expect("a thread");
            for (name, condition) in states {
                browser.until(condition);
                shoot(name);
            }
            let looker = Browser::open(width, height);
            enter(&looker, &watcher);
            looker.until("shown === 'ask'");
            looker.run("el('behind').click()");
            looker.until("shown === 'guide' && bitmap");
            looker.shoot(&folder.join(format!("5-watcher-{width}x{height}.png")));
            drop(looker);
            browser.run("el('pause').click()");
            browser.until("live.paused");
            sleep(Duration::from_millis(300));
            shoot("6-paused");
            browser.run("el('pause').click(); el('list').click()");
            browser.until("shown === 'sheet'");
            sleep(Duration::from_millis(300));
            shoot("7-views");
            browser.run("el('close').click(); el('end').click()");
            shoot("8-end");
            browser.run("el('list').click(); el('bigger').click()");
            sleep(Duration::from_millis(300));
            shoot("9-large");
            browser.run("el('list').click(); el('bigger').click()");
            reader.join().expect("no panic");
        });
        browser.until("shown === 'result'");
        sleep(Duration::from_millis(300));
        shoot("a-result");
        browser.run("el('result').scrollTo(0, 900)");
        sleep(Duration::from_millis(300));
        shoot("b-result");
        let link = site.server.links()[0].watcher.clone();
        drop(site);
        browser.run("el('result').scrollTo(0, 0)");
        sleep(Duration::from_secs(3));
        shoot("c-lost");
        drop(link);
    }
}
