//! A simulated USB camera: the USB/IP protocol towards the kernel's vhci-hcd, and the stream.
//!
//! vhci-hcd gets one end of a socket pair; on the other end this program answers the kernel's
//! requests (URBs). A request taken back must not be answered any more: vhci drops the device then.

use std::{
    collections::{BTreeSet, VecDeque},
    fs::File,
    io::{Read, Write},
    os::{fd::AsRawFd, unix::net::UnixStream},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread::JoinHandle,
    time::Duration,
};

use crate::{
    controls::{self, Control},
    modes::{Mode, configuration},
    pictures::Pictures,
    stream::Stream,
};

const VHCI: &str = "/sys/devices/platform/vhci_hcd.0";
/// A device of high speed.
const HIGH_SPEED: u32 = 3;
const STALLED: i32 = -32;
const TAKEN_BACK: i32 = -104;

/// The only granted size, for any request; also of cameras plugged in later.
pub(crate) static ONLY: Mutex<Option<(u16, u16)>> = Mutex::new(None);

/// Kind of sent times; also of cameras plugged in later.
pub(crate) static TIMES: Mutex<Times> = Mutex::new(Times::None);

/// Behaviour of a camera's own clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Times {
    None,
    Steady,
    /// Leaps every second, forward and back.
    Jump,
}

impl Times {
    pub(crate) fn called(name: &str) -> Self {
        match name {
            "steady" => Self::Steady,
            "jump" => Self::Jump,
            _ => Self::None,
        }
    }
}

/// Faults of the stream; numbers count down frames.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Faults {
    pub(crate) freeze: bool,
    pub(crate) error_bits: u32,
    pub(crate) short: u32,
    pub(crate) bad_jpeg: u32,
    pub(crate) dropped: u32,
    pub(crate) no_tables: bool,
    pub(crate) stall_commit: bool,
    pub(crate) stall_stream: bool,
    pub(crate) slow_millis: u64,
    /// Frames with a lower half from an earlier frame.
    pub(crate) torn: u32,
    /// Duration of a control's answer.
    pub(crate) control_millis: u64,
}

/// A request for data of the stream: its number and the lengths of its packets.
pub(crate) struct Request {
    pub(crate) number: u32,
    pub(crate) packets: Vec<u32>,
}

#[derive(Default)]
pub(crate) struct Requests {
    pub(crate) waiting: VecDeque<Request>,
    /// Number of the request being filled.
    pub(crate) held: Option<u32>,
}

/// State shared by the threads of a device.
pub(crate) struct Shared {
    pub(crate) requests: Mutex<Requests>,
    pub(crate) more: Condvar,
    pub(crate) mode: Mutex<Mode>,
    pub(crate) faults: Mutex<Faults>,
    pub(crate) controls: Mutex<Vec<Control>>,
    /// Numbers of control requests waiting for answers.
    slow_requests: Mutex<BTreeSet<u32>>,
    out: Mutex<UnixStream>,
    state: Mutex<State>,
}

struct State {
    alive: bool,
    /// Counts starts and stops of the stream.
    run: u64,
}

/// A plugged-in device.
pub(crate) struct Device {
    pub(crate) shared: Arc<Shared>,
    protocol: JoinHandle<()>,
}

pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Device {
    /// Plugs a camera into `port`.
    pub(crate) fn plug(
        name: &str,
        serial: &str,
        pictures: Arc<Pictures>,
        port: u32,
    ) -> std::io::Result<Self> {
        let (ours, kernels) = UnixStream::pair()?;
        let attach = format!("{port} {} {} {HIGH_SPEED}", kernels.as_raw_fd(), 0x10002 + port);
        File::options().write(true).open(format!("{VHCI}/attach"))?.write_all(attach.as_bytes())?;
        drop(kernels);
        let shared = Arc::new(Shared {
            requests: Mutex::default(),
            more: Condvar::new(),
            mode: Mutex::new(Mode::START),
            faults: Mutex::default(),
            controls: Mutex::new(controls::all()),
            slow_requests: Mutex::default(),
            out: Mutex::new(ours.try_clone()?),
            state: Mutex::new(State { alive: true, run: 0 }),
        });
        let names = [name.to_owned(), serial.to_owned()];
        let of_protocol = Arc::clone(&shared);
        let protocol = std::thread::Builder::new().name("usb".into()).spawn(move || {
            let of_stream = Arc::clone(&of_protocol);
            let stream = std::thread::Builder::new()
                .name("stream".into())
                .spawn(move || Stream::new(&of_stream, &pictures).run());
            of_protocol.answer(ours, &names);
            locked(&of_protocol.state).alive = false;
            of_protocol.more.notify_all();
            if let Ok(stream) = stream {
                stream.join().ok();
            }
        })?;
        Ok(Self { shared, protocol })
    }

    /// Unplugs the device.
    pub(crate) fn unplug(self) {
        locked(&self.shared.out).shutdown(std::net::Shutdown::Both).ok();
        self.protocol.join().ok();
    }
}

impl Shared {
    pub(crate) fn alive(&self) -> bool {
        locked(&self.state).alive
    }

    pub(crate) fn run(&self) -> u64 {
        locked(&self.state).run
    }

    /// Sends an answer: `command` 3 to a request, 4 to one taken back.
    pub(crate) fn reply(
        &self,
        command: u32,
        number: u32,
        status: i32,
        data: &[u8],
        packets: &[(u32, u32)],
    ) {
        let mut message = vec![0; 48];
        message[0..4].copy_from_slice(&command.to_be_bytes());
        message[4..8].copy_from_slice(&number.to_be_bytes());
        message[20..24].copy_from_slice(&status.to_be_bytes());
        message[24..28].copy_from_slice(&(data.len() as u32).to_be_bytes());
        message[32..36].copy_from_slice(&(packets.len() as u32).to_be_bytes());
        message.extend_from_slice(data);
        let mut offset = 0_u32;
        for (length, used) in packets {
            for value in [offset, *length, *used, 0] {
                message.extend(value.to_be_bytes());
            }
            offset += length;
        }
        locked(&self.out).write_all(&message).ok();
    }

    /// Answers the kernel until the connection ends.
    fn answer(self: &Arc<Self>, mut from: UnixStream, names: &[String; 2]) {
        let mut probe = Mode::START;
        let mut header = [0; 48];
        while from.read_exact(&mut header).is_ok() {
            let word = |at: usize| {
                u32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]])
            };
            let (command, number, is_in, endpoint, length) =
                (word(0), word(4), word(12) == 1, word(16), word(24));
            if command == 2 {
                self.take_back(number, word(20));
                continue;
            }
            let mut data = vec![0; if is_in { 0 } else { length as usize }];
            if from.read_exact(&mut data).is_err() {
                return;
            }
            if endpoint == 1 && is_in {
                let mut table = vec![0; word(32) as usize * 16];
                if from.read_exact(&mut table).is_err() {
                    return;
                }
                let packets = table
                    .chunks_exact(16)
                    .map(|row| u32::from_be_bytes([row[4], row[5], row[6], row[7]]))
                    .collect();
                locked(&self.requests).waiting.push_back(Request { number, packets });
                self.more.notify_all();
                continue;
            }
            let mut setup = [0; 8];
            setup.copy_from_slice(&header[40..48]);
            let is_of_unit = matches!(setup[0], 0x21 | 0xa1) && setup[4] == 0 && setup[5] > 0;
            let millis = if is_of_unit { locked(&self.faults).control_millis } else { 0 };
            if millis == 0 {
                let answer = self.control(setup, &data, names, &mut probe);
                self.reply_to_control(number, setup, data.len(), is_in, answer);
                continue;
            }
            // The motor runs while pictures go on.
            locked(&self.slow_requests).insert(number);
            let (device, names) = (Arc::clone(self), names.clone());
            let late = move || {
                std::thread::sleep(Duration::from_millis(millis));
                let answer = device.control(setup, &data, &names, &mut { Mode::START });
                let mut waiting = locked(&device.slow_requests);
                // Unless taken back meanwhile.
                if waiting.remove(&number) {
                    device.reply_to_control(number, setup, data.len(), is_in, answer);
                }
            };
            if let Err(err) = std::thread::Builder::new().name("motor".into()).spawn(late) {
                eprintln!("uvcsim: {err}");
            }
        }
    }

    fn reply_to_control(
        &self,
        number: u32,
        setup: [u8; 8],
        taken: usize,
        is_in: bool,
        answer: Option<Vec<u8>>,
    ) {
        match answer {
            Some(mut answer) if is_in => {
                answer.truncate(usize::from(u16::from_le_bytes([setup[6], setup[7]])));
                self.reply(3, number, 0, &answer, &[]);
            }
            Some(_) => self.reply_out(number, taken),
            None => self.reply(3, number, STALLED, &[], &[]),
        }
    }

    /// Confirms all bytes of a write request.
    fn reply_out(&self, number: u32, taken: usize) {
        let mut message = vec![0; 48];
        message[0..4].copy_from_slice(&3_u32.to_be_bytes());
        message[4..8].copy_from_slice(&number.to_be_bytes());
        message[24..28].copy_from_slice(&(taken as u32).to_be_bytes());
        locked(&self.out).write_all(&message).ok();
    }

    fn take_back(&self, number: u32, which: u32) {
        let mut slow = locked(&self.slow_requests);
        if slow.remove(&which) {
            // Under the lock: it must not be answered after this.
            self.reply(4, number, TAKEN_BACK, &[], &[]);
            return;
        }
        drop(slow);
        locked(&self.state).run += 1;
        let mut requests = locked(&self.requests);
        let before = requests.waiting.len();
        requests.waiting.retain(|request| request.number != which);
        let was_waiting = requests.waiting.len() < before;
        let was_held = requests.held.take_if(|held| *held == which).is_some();
        // Under the lock: the stream must not answer it after this.
        self.reply(4, number, if was_waiting || was_held { TAKEN_BACK } else { 0 }, &[], &[]);
        drop(requests);
    }

    /// Answers a control request; `None` refuses it.
    fn control(
        &self,
        setup: [u8; 8],
        data: &[u8],
        [name, serial]: &[String; 2],
        probe: &mut Mode,
    ) -> Option<Vec<u8>> {
        let [kind, request, low, high, interface, unit, ..] = setup;
        let of_stream = interface == 1 && (high == 1 || high == 2);
        match (kind, request) {
            (0x80, 6) => match high {
                1 => Some(vec![
                    18, 1, 0, 2, 0xef, 2, 1, 64, 0x6b, 0x1d, 0x02, 0x01, 0, 1, 1, 2, 3, 1,
                ]),
                2 => Some(configuration()),
                3 => match low {
                    0 => Some(vec![4, 3, 9, 4]),
                    1 => Some(text("uvcsim")),
                    2 => Some(text(name)),
                    3 => Some(text(serial)),
                    _ => None,
                },
                6 => Some(vec![10, 6, 0, 2, 0xef, 2, 1, 64, 1, 0]),
                _ => None,
            },
            (0x80, 8) => Some(vec![1]),
            (0x81, 10) => Some(vec![0]),
            (0x80..=0x82, 0) => Some(vec![0, 0]),
            (0x00, 1 | 3 | 9) | (0x01, 11) | (0x02, 1 | 3) => Some(vec![]),
            (0xa1, _) if of_stream => match request {
                0x81 if high == 2 => Some(locked(&self.mode).to_block()),
                0x81..=0x83 => Some(probe.to_block()),
                0x85 => Some(vec![34, 0]),
                0x86 => Some(vec![3]),
                0x87 => Some(Mode::START.to_block()),
                _ => None,
            },
            (0x21, 1) if of_stream && data.len() >= 26 => {
                let mut mode = Mode::from_block(data);
                mode.size = locked(&ONLY).unwrap_or(mode.size);
                if high == 1 {
                    *probe = mode;
                } else if locked(&self.faults).stall_commit {
                    return None;
                } else {
                    eprintln!("uvcsim: {mode:?}");
                    *locked(&self.mode) = mode;
                    locked(&self.state).run += 1;
                }
                Some(vec![])
            }
            (0xa1, _) if unit > 0 => {
                controls::find(&mut locked(&self.controls), unit, high)?.read(request)
            }
            (0x21, 1) if unit > 0 => {
                let mut all = locked(&self.controls);
                let control = controls::find(&mut all, unit, high)?;
                control.set(data).then(|| {
                    eprintln!("uvcsim: {} is set to {}", control.name, control.value);
                    vec![]
                })
            }
            // Power mode and error code.
            (0xa1, 0x81) => Some(vec![0]),
            _ => None,
        }
    }
}

fn text(text: &str) -> Vec<u8> {
    let units: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).take(252).collect();
    let mut descriptor = vec![2 + units.len() as u8, 3];
    descriptor.extend(units);
    descriptor
}
