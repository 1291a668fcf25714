//! Focus, zoom, exposure, gain and white balance: locked after settling, read back, put back at the end.
//!
//! Controls are known by number: names change with kernels and makers. A camera may accept a value
//! and not apply it, or switch an automatic on again by itself; so what counts is what is read.

use std::collections::BTreeMap;

use super::{
    kernel::{ControlRange, Errno, Handle, Kernel},
    queue::{again, gone},
};
use crate::device::{Control, Lock, Locks};

/// An automatic that moves a control, and the value that switches it off.
type Automatic = (u32, i64);

const FOCUS: u32 = 0x009a_090a;
const FOCUS_AUTOMATIC: u32 = 0x009a_090c;
const ZOOM: u32 = 0x009a_090d;
const EXPOSURE: u32 = 0x009a_0902;
const EXPOSURE_AUTOMATIC: u32 = 0x009a_0901;
/// Lets the exposure lengthen the time from picture to picture.
const EXPOSURE_SLOWS: u32 = 0x009a_0903;
const GAIN: u32 = 0x0098_0913;
const GAIN_AUTOMATIC: u32 = 0x0098_0912;
const WHITE_BALANCE: u32 = 0x0098_091a;
const WHITE_BALANCE_AUTOMATIC: u32 = 0x0098_090c;

/// Number of a control, and the automatics that move it.
pub(super) fn numbers(control: Control) -> (u32, &'static [Automatic]) {
    match control {
        Control::Focus => (FOCUS, &[(FOCUS_AUTOMATIC, 0)]),
        Control::Zoom => (ZOOM, &[]),
        // 1 is "manual" in the menu.
        Control::Exposure => (EXPOSURE, &[(EXPOSURE_AUTOMATIC, 1), (EXPOSURE_SLOWS, 0)]),
        Control::Gain => (GAIN, &[(GAIN_AUTOMATIC, 0)]),
        Control::WhiteBalance => (WHITE_BALANCE, &[(WHITE_BALANCE_AUTOMATIC, 0)]),
    }
}

/// How a control stands, for a person to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControlState {
    /// Which.
    pub control: Control,
    /// What it can be.
    pub range: ControlRange,
    /// What it is; `None` if it cannot be read.
    pub value: Option<i64>,
    /// Whether the camera moves it by itself; `None` if it has no such automatic.
    pub automatic: Option<bool>,
}

/// The controls of a camera that matter here.
pub fn control_states(kernel: &mut dyn Kernel, device: Handle) -> Vec<ControlState> {
    let mut found = Vec::new();
    for control in Control::ALL {
        let (number, automatics) = numbers(control);
        let Ok(range) = again(|| kernel.control_range(device, number)) else { continue };
        let value = again(|| kernel.control(device, number)).ok();
        let automatic = automatics.first().and_then(|(id, off)| {
            again(|| kernel.control(device, *id)).ok().map(|value| value != *off)
        });
        found.push(ControlState { control, range, value, automatic });
    }
    found
}

/// The controls of one open camera.
#[derive(Clone, Debug, Default)]
pub(super) struct ControlLock {
    /// What was set before, in the order in which it is put back.
    before: Vec<(u32, i64)>,
    /// What is to stay.
    kept: BTreeMap<Control, i64>,
}

/// A control that no longer has its locked value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Deviation {
    pub(super) control: Control,
    pub(super) from: i64,
    pub(super) to: i64,
}

impl ControlLock {
    /// Remembers how the controls stand. Only what can be read can be put back.
    pub(super) fn remember(kernel: &mut dyn Kernel, device: Handle) -> Self {
        let mut before = Vec::new();
        for control in Control::ALL {
            let (number, automatics) = numbers(control);
            // Values first: a camera takes them only while its automatic is off.
            for id in std::iter::once(number).chain(automatics.iter().map(|(id, _)| *id)) {
                if writable(kernel, device, id).is_some()
                    && let Ok(value) = again(|| kernel.control(device, id))
                {
                    before.push((id, value));
                }
            }
        }
        Self { before, kept: BTreeMap::new() }
    }

    /// The same intentions for a camera that came back, which may have lost them.
    pub(super) fn again_for(&self, kernel: &mut dyn Kernel, device: Handle) -> Self {
        let mut keeper = Self::remember(kernel, device);
        if !self.before.is_empty() {
            keeper.before.clone_from(&self.before);
        }
        keeper.kept.clone_from(&self.kept);
        keeper
    }

    /// Switches automatics off and holds each control at the value that it has now, or had when it was
    /// locked first.
    ///
    /// # Errors
    ///
    /// If the device is gone.
    pub(super) fn lock(&mut self, kernel: &mut dyn Kernel, device: Handle) -> Result<(), Errno> {
        for control in Control::ALL {
            let (number, automatics) = numbers(control);
            let range = match again(|| kernel.control_range(device, number)) {
                Ok(range) => range,
                Err(errno) if gone(errno) => return Err(errno),
                Err(_) => continue,
            };
            for (id, off) in automatics {
                if writable(kernel, device, *id).is_some() {
                    again(|| kernel.set_control(device, *id, *off)).or_else(unless_gone)?;
                }
            }
            let now = again(|| kernel.control(device, number));
            if let Err(errno) = now
                && gone(errno)
            {
                return Err(errno);
            }
            let Some(value) = self.kept.get(&control).copied().or(now.ok()) else { continue };
            let value = value.clamp(range.min, range.max.max(range.min));
            self.kept.insert(control, value);
            if range.writable {
                again(|| kernel.set_control(device, number, value)).or_else(unless_gone)?;
            }
        }
        Ok(())
    }

    /// From now on holds `control` at `value`, or at what the camera makes of it.
    pub(super) fn want(&mut self, control: Control, value: i64) {
        self.kept.insert(control, value);
    }

    /// How a control stands that was set on request: what the camera made of the request is kept.
    ///
    /// # Errors
    ///
    /// If the device is gone.
    pub(super) fn granted(
        &mut self,
        kernel: &mut dyn Kernel,
        device: Handle,
        control: Control,
    ) -> Result<Lock, Errno> {
        Ok(match self.read(kernel, device, control)? {
            Some((value, false)) => {
                self.kept.insert(control, value);
                Lock::Locked { value }
            }
            Some((_, true)) | None => Lock::Free,
        })
    }

    /// How each control stands, read from the camera.
    ///
    /// # Errors
    ///
    /// If the device is gone.
    pub(super) fn locks(&self, kernel: &mut dyn Kernel, device: Handle) -> Result<Locks, Errno> {
        let mut locks = Locks::default();
        for control in Control::ALL {
            let lock = match self.kept.get(&control) {
                None => Lock::Absent,
                Some(&set) => match self.read(kernel, device, control)? {
                    Some((read, _)) if read != set => Lock::Ignored { set, read },
                    Some((_, true)) | None => Lock::Free,
                    Some((_, false)) => Lock::Locked { value: set },
                },
            };
            locks.note(control, lock);
        }
        Ok(locks)
    }

    /// Controls that are not as they were locked.
    ///
    /// # Errors
    ///
    /// If the device is gone.
    pub(super) fn deviations(
        &self,
        kernel: &mut dyn Kernel,
        device: Handle,
        locks: &Locks,
    ) -> Result<Vec<Deviation>, Errno> {
        let mut found = Vec::new();
        for control in Control::ALL {
            // What never obeyed cannot break its word; what it reads is its word.
            let (from, was_free) = match locks.of(control) {
                Lock::Locked { value } => (value, false),
                Lock::Ignored { read, .. } => (read, true),
                Lock::Unknown | Lock::Absent | Lock::Free => continue,
            };
            if let Some((to, automatic)) = self.read(kernel, device, control)?
                && (to != from || (automatic && !was_free))
            {
                found.push(Deviation { control, from, to });
            }
        }
        Ok(found)
    }

    /// Value of a control and whether an automatic moves it; `None` if it cannot be read.
    fn read(
        &self,
        kernel: &mut dyn Kernel,
        device: Handle,
        control: Control,
    ) -> Result<Option<(i64, bool)>, Errno> {
        let (number, automatics) = numbers(control);
        let mut automatic = false;
        for (id, off) in automatics.iter().take(1) {
            match again(|| kernel.control(device, *id)) {
                Ok(value) => automatic |= value != *off,
                Err(errno) if gone(errno) => return Err(errno),
                Err(_) => {}
            }
        }
        match again(|| kernel.control(device, number)) {
            Ok(value) => Ok(Some((value, automatic))),
            Err(errno) if gone(errno) => Err(errno),
            Err(_) => Ok(None),
        }
    }

    /// Restores every control to its value before the session.
    pub(super) fn restore(&self, kernel: &mut dyn Kernel, device: Handle) {
        for (id, value) in &self.before {
            if let Err(errno) = again(|| kernel.set_control(device, *id, *value))
                && gone(errno)
            {
                return;
            }
        }
    }
}

fn unless_gone(errno: Errno) -> Result<(), Errno> {
    if gone(errno) { Err(errno) } else { Ok(()) }
}

fn writable(kernel: &mut dyn Kernel, device: Handle, id: u32) -> Option<ControlRange> {
    again(|| kernel.control_range(device, id)).ok().filter(|range| range.writable)
}
