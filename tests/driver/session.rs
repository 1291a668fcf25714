//! A whole guided session on the kernel's own USB and camera drivers, in the test machine
//! (`tests/vm/run.sh`): the same corners, to the last digit, as from the same pictures on disk.
//!
//! The simulated technician is recorded at 2.5 frames per second, slow enough for the emulated
//! processor; the simulated USB camera plays the recording, uncompressed, and then the machine
//! reads it from disk.
//!
//! - Of a decision, only the speed of a moving board and the elapsed share of a hold are computed
//!   from the times of the frames: exact in the recording, with jitter on a camera. Stillness of a
//!   board and the end of a hold follow from them, too, but here are far from their limits.
//!   Everything else is equal in every bit.
//! - Replayed from its own recording, with its own times, the session is equal in every bit, in the
//!   machine with its old processor, and outside of it.

use std::{fs, path::Path, process::Command};

use image::GrayImage;
use serde_json::Value;
use tempfile::TempDir;

/// Scene with a plain wall, quick to search.
const SCENE: &str = r#"
image_size_px = [640, 480]
fps = 2.5
pp_px = [328.0, 231.0]
clutter = 0.0
[technician]
person = "tripod"
"#;
const TRUE_PP_PX: [f64; 2] = [328.0, 231.0];
const MODE: &str = "640x480@2.5:YUYV";
/// Number of initial pictures of a wall: the program settles and locks the camera meanwhile.
const LEAD_IN: u32 = 16;

/// A frame looked at by a session.
struct Look {
    frame: u64,
    picture: GrayImage,
    seen: Value,
    decision: Value,
}

/// Every frame looked at by the session in `folder` until the plan was complete.
fn looks(folder: &Path) -> Vec<Look> {
    let journal = fs::read_to_string(folder.join("journal.jsonl")).expect("a journal");
    let lines = journal.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let look = |line: Value| {
        let observed = line.pointer("/body/input/observed")?;
        let frame = observed["frame"].as_u64()?;
        let file = folder.join(format!("frames/{frame:08}.png"));
        Some(Look {
            frame,
            picture: image::open(file).expect("every picture is stored").into_luma8(),
            seen: observed["seen"].clone(),
            decision: line["body"]["decision"].clone(),
        })
    };
    let mut looks: Vec<Look> = lines.filter_map(look).collect();
    // Another one may have been under way.
    let last = looks.iter().position(|look| look.decision["progress"]["progress"] == "complete");
    looks.truncate(last.expect("the plan was completed") + 1);
    looks
}

/// A decision or a result without the source's own data: the times, the number of its first frame,
/// and the camera's name. Only numbers called `progress` are of time.
fn comparable(value: &Value, first: u64) -> Value {
    fn strip(value: &mut Value, first: u64) {
        match value {
            Value::Object(fields) => {
                fields.retain(|name, value| {
                    !(name == "speed_px_per_s" || name == "progress" && value.is_number())
                });
                for (name, value) in fields {
                    match (name.as_str(), value.as_u64()) {
                        ("frame", Some(frame)) => *value = frame.wrapping_sub(first).into(),
                        _ => strip(value, first),
                    }
                }
            }
            Value::Array(items) => items.iter_mut().for_each(|item| strip(item, first)),
            Value::String(text) => {
                let frame = text.strip_prefix("frames/").and_then(|n| n.strip_suffix(".png"));
                if let Some(frame) = frame.and_then(|digits| digits.parse::<u64>().ok()) {
                    *text = format!("frame {}", frame.wrapping_sub(first));
                }
            }
            _ => {}
        }
    }
    let mut value = value.clone();
    strip(&mut value, first);
    value
}

/// The calibration in `folder`, without the camera's name and settings.
fn result(folder: &Path, first: u64) -> Value {
    let text = fs::read_to_string(folder.join("calibration.json")).expect("a result");
    let mut result: Value = serde_json::from_str(&text).expect("JSON");
    for name in ["source", "camera"] {
        result.as_object_mut().expect("an object").remove(name).expect("is there");
    }
    comparable(&result, first)
}

/// Runs `tests/vm/session.sh` while the camera plays the pictures of `data`/recording; its folders
/// are then in `out`.
fn run_in_the_machine(data: &Path, out: &Path) {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vm");
    let camera = std::env::var("BORESIGHT_UVCSIM").expect("is run by tests/vm/run.sh");
    let before = format!("--before {LEAD_IN}");
    let status = Command::new(here.join("vm.sh"))
        .args([
            "--uvcsim",
            &camera,
            "--camera-args",
            &before,
            "--timeout",
            "400",
            "--pace",
            "counted",
        ])
        .args(["--with", env!("CARGO_BIN_EXE_boresight"), "--pictures"])
        .arg(data.join("recording/frames"))
        .arg("--data")
        .arg(data)
        .arg("--out")
        .arg(out)
        .arg(here.join("session.sh"))
        .arg(MODE)
        .status()
        .expect("the machine starts");
    assert!(status.success(), "{status}");
}

/// Looks at the frames of the recording, from the first to the last, without a gap.
fn played(looks: Vec<Look>, recorded: &[Look]) -> Vec<Look> {
    let first = looks.iter().position(|look| look.picture == recorded[0].picture);
    let first = first.expect("the first picture came");
    for look in &looks[..first] {
        assert_eq!(look.seen, "no_board", "frame {} is a wall", look.frame);
    }
    let played: Vec<Look> = looks.into_iter().skip(first).take(recorded.len()).collect();
    assert_eq!(played.len(), recorded.len());
    for (number, look) in played.iter().enumerate() {
        assert_eq!(look.frame, played[0].frame + number as u64, "picture {number}");
    }
    played
}

/// Output of a replay with every decision as recorded.
fn replayed(said: &[u8]) -> Value {
    let report: Value = serde_json::from_slice(said).expect("JSON");
    assert_eq!(report["decisions"]["different"], Value::Array(Vec::new()));
    report
}

#[test]
#[ignore = "needs the machine of tests/vm"]
fn a_session_on_the_real_driver_equals_the_same_pictures_on_disk() {
    let folder = TempDir::new().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("scene.toml"), SCENE).expect("written");
    let made = Command::new(env!("CARGO_BIN_EXE_boresight"))
        .current_dir(folder.path())
        .args(["simulate", "scene.toml", "--out", "recording"])
        .status()
        .expect("starts");
    assert!(made.success(), "{made}");
    let recorded = looks(&at("recording"));

    let out = at("out");
    run_in_the_machine(folder.path(), &out);
    // Its own recording.
    let live = looks(&out.join("camera"));
    let of_replay = replayed(&fs::read(out.join("replayed.json")).expect("written"));
    assert_eq!(of_replay["decisions"]["rounded"], 0);
    assert_eq!(of_replay["result"], result(&out.join("camera"), 0)["result"]);
    // The machine's processor is an old one; this one decides the same, bit for bit.
    let here = Command::new(env!("CARGO_BIN_EXE_boresight"))
        .args(["replay", "--json"])
        .arg(out.join("camera"))
        .output()
        .expect("starts");
    assert!(here.status.success(), "{}", String::from_utf8_lossy(&here.stderr));
    let of_replay = replayed(&here.stdout);
    assert_eq!(of_replay["decisions"]["rounded"], 0);

    // The same pictures from disk.
    let live = played(live, &recorded);
    let disk = looks(&out.join("disk"));
    assert_eq!(disk.len(), recorded.len());
    let first = live[0].frame;
    for (number, ((live, disk), recorded)) in live.iter().zip(&disk).zip(&recorded).enumerate() {
        assert!(live.picture == recorded.picture, "picture {number} is another");
        assert_eq!(live.seen, disk.seen, "picture {number}");
        assert_eq!(live.seen, recorded.seen, "picture {number}");
    }
    // Stillness is a matter of time, and the camera's clock isn't the folder's: each may take
    // another picture of a hold, so views and results aren't compared.
    let of_camera = result(&out.join("camera"), first);
    assert_eq!(of_camera["verdict"], "good");
    let number =
        |result: &Value, at: &str| result.pointer(at).and_then(Value::as_f64).expect("a number");
    let places = ["/result/pp_px/0", "/result/pp_px/1", "/result/f_px/0"];
    let [x_px, y_px, f_px] = places.map(|at| number(&of_camera, at));
    for (axis, (px, truth)) in [x_px, y_px].into_iter().zip(TRUE_PP_PX).enumerate() {
        let sigma_px = number(&of_camera, &format!("/result/sigma/pp_px/{axis}"));
        assert!((px - truth).abs() < 5.0 * sigma_px, "{px} ± {sigma_px}, true {truth}");
    }
    println!(
        "{count} pictures through the kernel's driver and from disk: {count} equal pictures and corners; {} views, \
         PP ({x_px}, {y_px}) px, f {f_px} px",
        of_camera["views"].as_array().map_or(0, Vec::len),
        count = live.len(),
    );
}
