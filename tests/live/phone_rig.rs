//! Phone's page beside two cameras that are led to common places.

use std::{sync::Arc, thread::Builder};

use boresight::{
    app::{
        Host,
        session::rig_run::{RigHand, RigRun},
    },
    serve::{Setup, session_page::Phone},
};
use serde_json::Value;

use crate::phone::{Ask, Site, follow};

#[test]
fn two_cameras_are_shown_and_obey_the_page() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("rig");
    let address = "127.0.0.1:0".parse().expect("an address");
    let phone = Phone::start(&Setup { address, names: vec![], certificate: None, kept: None })
        .expect("a free port");
    let phone = Arc::new(phone);
    let links = phone.links()[0].clone();
    let site = Site::of_links(&links.owner, &links.watcher);
    let key = site.key(&site.owner);
    let session = Builder::new()
        .spawn(move || {
            let run = RigRun::simulated(7, Some(folder), 100_000).expect("a session").fast();
            let host = Host::silent().beside(Arc::clone(&phone) as _);
            host.rig(run, &RigHand::new(Arc::default()), |_| ()).expect("it runs");
            phone
        })
        .expect("a thread");
    let send = |command: &str| {
        let body = format!("{{\"command\":\"{command}\"}}");
        Ask::post("/api/command", &body).key(&key).of(&site).status
    };
    let (mut most, mut taken, mut pictures) = (0, 0, 0);
    let (mut last, mut sizes) = (Value::Null, Vec::new());
    let mut result = Value::Null;
    follow(&site, &key, |name, data| {
        match name {
            "news" if data["rank"] == "taken" => taken += 1,
            "plan" if data["ghost"].is_object() => sizes.push(data["size"].clone()),
            "plan" => assert!(data["views"].as_array().is_none_or(Vec::is_empty), "{data}"),
            "ended" if !data.is_null() => result = data.clone(),
            "live" if data["led"].is_string() => {
                let places = data["views"].as_u64().expect("a number");
                if places >= 2 && most < 2 {
                    assert_eq!(send("take_now"), 409, "places are taken by themselves");
                    assert_eq!(send("undo"), 204);
                    let picture = Ask::get("/api/picture").key(&key).of(&site);
                    pictures += usize::from(picture.status == 200);
                }
                // The session is faster than the page: it may be over.
                if places >= 3 && most < 3 {
                    assert!(matches!(send("end"), 204 | 409));
                }
                most = most.max(places);
                last = data.clone();
            }
            _ => {}
        }
        result.is_null()
    });
    drop(session.join().expect("no panic"));
    let left = last["views"].as_u64().expect("a number");
    assert!(taken > left && pictures == 1, "one was taken back: {taken}, {left}, {pictures}");
    assert!(["left", "right"].iter().any(|name| last["led"] == *name), "{last}");
    assert!(sizes.contains(&serde_json::json!([1280, 720])), "the card has a picture: {sizes:?}");
    assert!(last["sentence"][0].as_str().is_some_and(|said| !said.is_empty()));
    let what = result["what"].as_str().expect("a verdict");
    let known = ["Unfinished (SIMULATED)", "Good (SIMULATED)"];
    assert!(known.iter().any(|known| what.starts_with(known)), "{what}");
    let files = result["files"].as_array().expect("files");
    let names: Vec<&str> = files.iter().filter_map(|file| file["name"].as_str()).collect();
    assert_eq!(names[..2], ["rig.html", "rig.json"]);
    assert!(names.contains(&"rig.urdf"), "{names:?}");
}
