//! Stream of a simulated USB camera: frames, cut into the packets requested by the kernel.

use std::{
    sync::PoisonError,
    time::{Duration, Instant},
};

use crate::{
    device::{Request, Shared, TIMES, Times, locked},
    modes::{CLOCK_HZ, Format, Mode, PACKET},
    pictures::{Pictures, without_tables},
};

const STALLED: i32 = -32;

/// Frame-sending thread.
pub(crate) struct Stream<'a> {
    shared: &'a Shared,
    pictures: &'a Pictures,
    number: u64,
    /// Toggles with each frame.
    frame_bit: u8,
    due: Instant,
    began: Instant,
}

impl<'a> Stream<'a> {
    pub(crate) fn new(shared: &'a Shared, pictures: &'a Pictures) -> Self {
        Self {
            shared,
            pictures,
            number: 0,
            frame_bit: 0,
            due: Instant::now(),
            began: Instant::now(),
        }
    }

    pub(crate) fn run(&mut self) {
        while let Some(request) = self.take() {
            let mode = *locked(&self.shared.mode);
            let run = self.shared.run();
            let mut frame = self.pictures.frame(mode, self.number);
            self.wait_until_due(mode);
            self.number += 1;
            let mut faults = locked(&self.shared.faults);
            if std::mem::take(&mut faults.stall_stream) {
                drop(faults);
                self.give(
                    &request,
                    STALLED,
                    &[],
                    &request.packets.iter().map(|l| (*l, 0)).collect::<Vec<_>>(),
                );
                continue;
            }
            if once(&mut faults.dropped) {
                drop(faults);
                self.put_back(request);
                continue;
            }
            let is_jpeg = mode.format == Format::Mjpeg;
            if faults.no_tables && is_jpeg {
                frame = without_tables(&frame);
            }
            if once(&mut faults.torn) {
                // An overtaken reader: the lower half is from six frames before.
                let before = self.pictures.frame(mode, (self.number - 1).saturating_sub(6));
                if before.len() == frame.len() {
                    let half = frame.len() / 2;
                    frame[half..].copy_from_slice(&before[half..]);
                }
            }
            let error_bit = if once(&mut faults.error_bits) { 0x40 } else { 0 };
            if once(&mut faults.short) {
                frame.truncate(frame.len() / 3);
            }
            if once(&mut faults.bad_jpeg) {
                let length = frame.len();
                frame[length / 4..length / 2].iter_mut().step_by(7).for_each(|byte| *byte ^= 0x5a);
            }
            let slow = Duration::from_millis(faults.slow_millis);
            drop(faults);
            std::thread::sleep(slow);
            self.send(request, &frame, error_bit, run);
        }
    }

    /// Time of the frame, a copy as the clock's time, and the number of the USB frame, by the
    /// camera's clock.
    fn clock(&self) -> Option<[u8; 10]> {
        let times = *locked(&TIMES);
        if times == Times::None {
            return None;
        }
        let mut millis = self.began.elapsed().as_millis() as u64 + 60_000;
        if times == Times::Jump {
            millis = match millis / 1000 % 4 {
                1 => millis + 2_500,
                3 => millis - 4_000,
                _ => millis,
            };
        }
        let ticks = (millis * u64::from(CLOCK_HZ / 1000)) as u32;
        let mut clock = [0; 10];
        clock[0..4].copy_from_slice(&ticks.to_le_bytes());
        clock[4..8].copy_from_slice(&ticks.to_le_bytes());
        clock[8..10].copy_from_slice(&((millis % 2048) as u16).to_le_bytes());
        Some(clock)
    }

    fn wait_until_due(&mut self, mode: Mode) {
        let interval = Duration::from_nanos(u64::from(mode.interval) * 100);
        let now = Instant::now();
        self.due += interval;
        if self.due + interval < now || self.due > now + interval * 2 {
            self.due = now;
        }
        std::thread::sleep(self.due.saturating_duration_since(now));
    }

    /// Sends a frame in as many requests as needed; gives up when the stream restarts.
    fn send(&mut self, mut request: Request, frame: &[u8], error_bit: u8, run: u64) {
        self.frame_bit ^= 1;
        let mut sent = 0;
        let clock = self.clock();
        loop {
            let (mut data, mut packets, mut ended) = (Vec::new(), Vec::new(), false);
            for length in &request.packets {
                let room = (*length).min(PACKET) as usize;
                let head = 2 + clock.map_or(0, |clock| clock.len());
                if ended || room <= head {
                    packets.push((*length, 0));
                    continue;
                }
                let part = (room - head).min(frame.len() - sent);
                ended = sent + part == frame.len();
                let end_bit = if ended { 2 } else { 0 };
                let clock_bits = if clock.is_some() { 0x0c } else { 0 };
                data.extend([head as u8, 0x80 | self.frame_bit | error_bit | end_bit | clock_bits]);
                data.extend(clock.iter().flatten());
                data.extend_from_slice(&frame[sent..sent + part]);
                sent += part;
                packets.push((*length, (head + part) as u32));
            }
            self.give(&request, 0, &data, &packets);
            if ended {
                return;
            }
            match self.take() {
                Some(next) => request = next,
                None => return,
            }
            if self.shared.run() != run {
                self.put_back(request);
                return;
            }
        }
    }

    /// Next waiting request; `None` when the device is gone.
    fn take(&self) -> Option<Request> {
        let mut requests = locked(&self.shared.requests);
        loop {
            if !self.shared.alive() {
                return None;
            }
            let frozen = locked(&self.shared.faults).freeze;
            if !frozen && let Some(request) = requests.waiting.pop_front() {
                requests.held = Some(request.number);
                return Some(request);
            }
            let wait = self.shared.more.wait_timeout(requests, Duration::from_millis(50));
            requests = wait.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Answers a request, unless taken back meanwhile.
    fn give(&self, request: &Request, status: i32, data: &[u8], packets: &[(u32, u32)]) {
        let mut requests = locked(&self.shared.requests);
        if requests.held.take_if(|held| *held == request.number).is_some() {
            self.shared.reply(3, request.number, status, data, packets);
        }
    }

    fn put_back(&self, request: Request) {
        let mut requests = locked(&self.shared.requests);
        if requests.held.take_if(|held| *held == request.number).is_some() {
            requests.waiting.push_front(request);
        }
    }
}

/// Counts down; true if something was left.
fn once(left: &mut u32) -> bool {
    let any = *left > 0;
    *left -= u32::from(any);
    any
}
