//! Every system call of a run fails once, in eight ways: no panic, no endless wait, no access to
//! foreign buffers, no wrong picture, nothing left open.
//!
//! The usual run takes every tenth call. All of them: `BORESIGHT_FAIL_EVERY=1 cargo test --test
//! live failing_calls`.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    time::Duration,
};

use boresight::{
    capture::{Arrival, FrameSource},
    device::CameraEvent,
    simulation::kernel::{SimCamera, SimControl, SimKernel},
};

use crate::cameras::{FOCUS, FOCUS_AUTOMATIC, open};

const FRAMES: u64 = 300;
const SIZE: (u32, u32) = (32, 16);
const ERRNOS: [i32; 8] = [
    libc::ENODEV,
    libc::EIO,
    libc::EINVAL,
    libc::EBUSY,
    libc::ENOSPC,
    libc::EAGAIN,
    libc::EINTR,
    libc::ENOMEM,
];
const PATIENCE: Duration = Duration::from_millis(100);
/// Longest excess of a single call over the patience.
const SINGLE_NANOS: u64 = 2_100_000_000;
/// Longest delay of a run by a failure: the start-up time-out, and two seconds.
const DELAY_NANOS: u64 = 7_000_000_000;

/// Bytes with the frame's number everywhere.
fn bytes(number: u64) -> Vec<u8> {
    let mut bytes = vec![100 + (number % 7) as u8; (SIZE.0 * SIZE.1) as usize];
    for chunk in bytes.chunks_exact_mut(8) {
        chunk[..4].copy_from_slice(&(number as u32).to_le_bytes());
    }
    bytes
}

fn is_right(bytes_seen: &[u8]) -> bool {
    let number = u32::from_le_bytes([bytes_seen[0], bytes_seen[1], bytes_seen[2], bytes_seen[3]]);
    bytes_seen == bytes(number.into())
}

fn kernel() -> SimKernel {
    let mut camera = SimCamera::new(0, "A1", (*b"GREY", SIZE.0, SIZE.1), bytes);
    camera.controls.insert(FOCUS, SimControl::at(30));
    camera.controls.insert(FOCUS_AUTOMATIC, SimControl::at(1));
    SimKernel::new(vec![camera])
}

#[derive(Default)]
struct Outcome {
    refused: bool,
    wrong: usize,
    returned: bool,
    nanos: u64,
    longest_nanos: u64,
}

/// Opens the camera and takes pictures; gives up after far too long a time.
fn session(kernel: &SimKernel) -> Outcome {
    let mut outcome = Outcome::default();
    let now = || kernel.world().now_nanos;
    let Ok(mut source) = open(kernel, "/dev/video0") else {
        outcome.refused = true;
        outcome.nanos = now();
        return outcome;
    };
    let mut frames = 0;
    while frames < FRAMES && now() < 60_000_000_000 {
        let before = now();
        match source.next_frame(PATIENCE) {
            Ok(Arrival::Frame(frame)) => {
                frames += 1;
                outcome.wrong += usize::from(!is_right(frame.image.as_raw()));
            }
            Ok(Arrival::Event(CameraEvent::Returned { .. })) => outcome.returned = true,
            Ok(Arrival::Event(_) | Arrival::NothingYet) => {}
            other => unreachable!("{other:?}"),
        }
        outcome.longest_nanos = outcome.longest_nanos.max(now() - before);
    }
    drop(source);
    outcome.nanos = now();
    outcome
}

#[test]
fn every_call_may_fail_once() {
    let every =
        std::env::var("BORESIGHT_FAIL_EVERY").ok().and_then(|n| n.parse().ok()).unwrap_or(10);
    let good = kernel();
    let usual = session(&good);
    let calls = good.world().calls;
    assert!(!usual.refused && calls > 1000, "{calls} calls");
    let (mut runs, mut refused, mut returned, mut longest) = (0, 0, 0, 0);
    let mut failed = Vec::new();
    for (at, errno) in ERRNOS.iter().enumerate() {
        for number in (1..=calls).skip(at).step_by(every) {
            let kernel = kernel();
            kernel.world().fails = Some((number, *errno));
            let outcome = catch_unwind(AssertUnwindSafe(|| session(&kernel)));
            runs += 1;
            let violations = kernel.world().violations.clone();
            let problem = match &outcome {
                Err(_) => Some("panic".into()),
                Ok(o) if o.wrong > 0 => Some(format!("{} wrong pictures", o.wrong)),
                Ok(o) if o.longest_nanos > SINGLE_NANOS => {
                    Some(format!("a call took {} ns", o.longest_nanos))
                }
                Ok(o) if o.nanos > usual.nanos + DELAY_NANOS => {
                    Some(format!("{} ns in all", o.nanos))
                }
                Ok(_) if !violations.is_empty() => Some(format!("{violations:?}")),
                Ok(_) if kernel.open_devices() > 0 => Some("left open".into()),
                Ok(_) => None,
            };
            if let Some(problem) = problem {
                failed.push(format!("call {number}, errno {errno}: {problem}"));
            }
            if let Ok(outcome) = outcome {
                refused += usize::from(outcome.refused);
                returned += usize::from(outcome.returned);
                longest = longest.max(outcome.longest_nanos);
            }
        }
    }
    println!(
        "{runs} runs ({calls} calls, 8 errors, every {every}th): {} problems, {refused} refused at the start, {returned} lost and returned, longest call {} ms",
        failed.len(),
        longest / 1_000_000
    );
    failed.truncate(20);
    assert!(failed.is_empty(), "\n{}\n", failed.join("\n"));
}
