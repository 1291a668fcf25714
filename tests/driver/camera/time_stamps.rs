//! A camera with a jumping clock, under a driver using the clock.

use std::time::{Duration, Instant};

use boresight::capture::{Arrival, FrameSource};

use super::{LONG, PATIENCE, frames, open, row, small, tell};

/// Duration of the look.
const LOOK: Duration = Duration::from_secs(8);

#[test]
#[ignore = "needs the camera of tests/vm with hwtimestamps=1"]
fn jumping_time_stamps_are_not_believed() {
    for times in ["steady", "jump"] {
        tell(&format!("times {times}"));
        let mut source = open(&small());
        frames(&mut source, 3);
        let began = Instant::now();
        // Between two frames, by their stamps and by this computer's clock.
        let (mut first, mut last): (Option<u64>, Option<u64>) = (None, None);
        let (mut count, mut longest_secs) = (0, 0.0_f64);
        while began.elapsed() < LOOK {
            assert!(began.elapsed() < LONG);
            match source.next_frame(PATIENCE).expect("a camera never breaks") {
                Arrival::Frame(frame) => {
                    let nanos = frame.captured_at.nanos;
                    if let Some(last) = last {
                        assert!(nanos > last, "{times}: time goes back by {} ns", last - nanos);
                        longest_secs = longest_secs.max((nanos - last) as f64 / 1e9);
                    }
                    first = first.or(Some(nanos));
                    last = Some(nanos);
                    count += 1;
                }
                Arrival::Event(event) => println!("{times}: {event:?}"),
                Arrival::NothingYet => {}
                Arrival::End => panic!("a camera never ends"),
            }
        }
        let by_stamps = (last.expect("frames") - first.expect("frames")) as f64 / 1e9;
        let by_clock = began.elapsed().as_secs_f64();
        println!(
            "times {times}: {count} frames, {by_stamps:.2} s by their stamps, {by_clock:.2} s by the clock, at most \
             {longest_secs:.2} s apart"
        );
        assert!((by_stamps - by_clock).abs() < 0.5, "{times}: {by_stamps} s in {by_clock} s");
        assert!(longest_secs < 0.5, "{times}: {longest_secs} s from one frame to the next");
    }
    row("the camera's clock jumps", "nothing: the times of arrival are used", Duration::ZERO);
}
