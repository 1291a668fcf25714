//! Focus, zoom, exposure, gain and white balance: locked after settling, read back, restored at the
//! end.
//!
//! Controls are known by number: names change with kernels and makers. A camera may accept a value
//! and not apply it, or switch an automatic back on; only readings count.

use std::collections::BTreeMap;

use super::{
    kernel::{ControlRange, Errno, Handle, Kernel},
    queue::{again, gone},
};
use boresight_geometry::device::{Adjustable, Control, ControlBefore, Lock, Locks};
use ids::{
    EXPOSURE, EXPOSURE_AUTOMATIC, EXPOSURE_SLOWS, FOCUS, FOCUS_AUTOMATIC, GAIN, GAIN_AUTOMATIC,
    WHITE_BALANCE, WHITE_BALANCE_AUTOMATIC, ZOOM,
};

/// An automatic behind a control, and the value to switch it off.
type Automatic = (u32, i64);

/// Numbers of the controls in V4L2.
pub mod ids {
    /// V4L2 number of focus.
    pub const FOCUS: u32 = 0x009a_090a;
    /// V4L2 number of the automatic of focus.
    pub const FOCUS_AUTOMATIC: u32 = 0x009a_090c;
    /// V4L2 number of zoom.
    pub const ZOOM: u32 = 0x009a_090d;
    /// V4L2 number of exposure.
    pub const EXPOSURE: u32 = 0x009a_0902;
    /// V4L2 number of the automatic of exposure.
    pub const EXPOSURE_AUTOMATIC: u32 = 0x009a_0901;
    /// Lets the exposure lengthen the time from picture to picture.
    pub const EXPOSURE_SLOWS: u32 = 0x009a_0903;
    /// V4L2 number of gain.
    pub const GAIN: u32 = 0x0098_0913;
    /// V4L2 number of the automatic of gain.
    pub const GAIN_AUTOMATIC: u32 = 0x0098_0912;
    /// V4L2 number of white balance.
    pub const WHITE_BALANCE: u32 = 0x0098_091a;
    /// V4L2 number of the automatic of white balance.
    pub const WHITE_BALANCE_AUTOMATIC: u32 = 0x0098_090c;
}

/// Number of a control, and the automatics behind it.
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

/// State of a control, for a person to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControlState {
    /// The control shown.
    pub control: Control,
    /// Range of the values.
    pub range: ControlRange,
    /// Value; `None` if unreadable.
    pub value: Option<i64>,
    /// True if an automatic moves the control; `None` without an automatic.
    pub automatic: Option<bool>,
}

/// States of a camera's relevant controls.
pub fn control_states(kernel: &mut dyn Kernel, device: Handle) -> Vec<ControlState> {
    Survey::of(kernel, device).states()
}

/// Survey of every control of a camera, read once: each transfer may take seconds.
#[derive(Clone, Debug, Default)]
pub(super) struct Survey {
    /// Number of a control or an automatic, in the order of [`Control::ALL`].
    found: Vec<Found>,
}

#[derive(Clone, Copy, Debug)]
struct Found {
    control: Control,
    id: u32,
    range: ControlRange,
    value: Option<i64>,
}

impl Survey {
    /// Reads the controls of an open camera.
    pub(super) fn of(kernel: &mut dyn Kernel, device: Handle) -> Self {
        let mut found = Vec::new();
        for control in Control::ALL {
            for id in all_numbers(control) {
                let Ok(range) = again(|| kernel.control_range(device, id)) else { continue };
                let value = again(|| kernel.control(device, id)).ok();
                found.push(Found { control, id, range, value });
            }
        }
        Self { found }
    }

    pub(super) fn states(&self) -> Vec<ControlState> {
        let of = |id: u32| self.found.iter().find(|found| found.id == id);
        let state = |control: Control| {
            let (number, automatics) = numbers(control);
            let Found { range, value, .. } = *of(number)?;
            let automatic = automatics.first().and_then(|(id, off)| Some(of(*id)?.value? != *off));
            Some(ControlState { control, range, value, automatic })
        };
        Control::ALL.into_iter().filter_map(state).collect()
    }

    /// State of each control before the session, for a recording.
    pub(super) fn before(&self) -> Vec<ControlBefore> {
        self.states()
            .into_iter()
            .map(|ControlState { control, value, automatic, .. }| ControlBefore {
                control,
                value,
                automatic,
                exact: self.restorable().filter(|(of, ..)| *of == control).map(exact).collect(),
            })
            .collect()
    }

    /// Adjustable controls.
    pub(super) fn adjustables(&self) -> Vec<Adjustable> {
        self.states()
            .into_iter()
            .filter(|standing| standing.range.max > standing.range.min)
            .filter(|standing| standing.range.writable || standing.automatic == Some(true))
            .map(|ControlState { control, range, .. }| Adjustable {
                control,
                min: range.min,
                max: range.max,
                step: range.step.max(1),
            })
            .collect()
    }

    /// Readable and writable controls, as control, number and value. Values come first: a camera
    /// takes them only while the automatic is off.
    fn restorable(&self) -> impl Iterator<Item = (Control, u32, i64)> + '_ {
        // Only a readable control can be restored.
        let restorable = |found: &Found| {
            found
                .value
                .filter(|_| found.range.writable)
                .map(|value| (found.control, found.id, value))
        };
        self.found.iter().filter_map(restorable)
    }
}

fn exact((_, id, value): (Control, u32, i64)) -> (u32, i64) {
    (id, value)
}

/// Number of a control, then the numbers of the automatics.
fn all_numbers(control: Control) -> impl Iterator<Item = u32> {
    let (number, automatics) = numbers(control);
    std::iter::once(number).chain(automatics.iter().map(|(id, _)| *id))
}

/// Value of each readable control, and true if an automatic moves it.
pub(super) type Readings = BTreeMap<Control, (i64, bool)>;

/// The controls of an open camera.
#[derive(Clone, Debug, Default)]
pub(super) struct ControlLock {
    /// Earlier values by control number, in the order of restoring.
    before: Vec<(u32, i64)>,
    /// Value to keep, per control.
    kept: BTreeMap<Control, i64>,
    /// Last reading of each control.
    last: Readings,
    /// Previous reading of each control, for [`Self::moved_freely`].
    free: BTreeMap<Control, i64>,
}

/// A control no longer at the locked value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Deviation {
    pub(super) control: Control,
    pub(super) from: i64,
    pub(super) to: i64,
}

impl ControlLock {
    /// Remembers the present state of the controls.
    pub(super) fn remember(survey: &Survey) -> Self {
        Self { before: survey.restorable().map(exact).collect(), ..Self::default() }
    }

    /// Schedules the values found by an earlier run of the session for restoring at the end: the
    /// earlier run may have ended without doing so.
    pub(super) fn put_back(&mut self, before: &[ControlBefore]) {
        for earlier in before {
            let entries = match earlier.exact.as_slice() {
                [] => guessed(earlier),
                exact => exact.to_vec(),
            };
            let own: Vec<u32> = all_numbers(earlier.control).collect();
            let entries = entries.into_iter().filter(|(id, _)| own.contains(id));
            let entries: Vec<(u32, i64)> = entries.collect();
            self.before.retain(|(id, _)| entries.iter().all(|(other, _)| other != id));
            self.before.extend(entries);
        }
        // Values first, as always.
        let is_automatic = |id: u32| {
            Control::ALL.into_iter().any(|control| numbers(control).1.iter().any(|(a, _)| *a == id))
        };
        self.before.sort_by_key(|(id, _)| is_automatic(*id));
    }

    /// Switches the automatics of `control` off and holds `control` at the kept value, or else at
    /// the present value.
    ///
    /// # Errors
    ///
    /// If the device is gone.
    pub(super) fn lock(
        &mut self,
        kernel: &mut dyn Kernel,
        device: Handle,
        control: Control,
    ) -> Result<(), Errno> {
        let (number, automatics) = numbers(control);
        let range = match again(|| kernel.control_range(device, number)) {
            Ok(range) => range,
            Err(errno) if gone(errno) => return Err(errno),
            Err(_) => return Ok(()),
        };
        for (id, off) in automatics {
            if writable(kernel, device, *id).is_some() {
                again(|| kernel.set_control(device, *id, *off)).or_else(unless_gone)?;
            }
        }
        let now = match self.kept.get(&control) {
            Some(kept) => Ok(*kept),
            None => again(|| kernel.control(device, number)),
        };
        let value = match now {
            Ok(value) => value.clamp(range.min, range.max.max(range.min)),
            Err(errno) => return unless_gone(errno),
        };
        self.kept.insert(control, value);
        if range.writable {
            again(|| kernel.set_control(device, number, value)).or_else(unless_gone)?;
        }
        Ok(())
    }

    /// Holds `control` from now on at `value`, or at the camera's nearest value.
    pub(super) fn want(&mut self, control: Control, value: i64) {
        self.kept.insert(control, value);
    }

    /// State of a control after a request to set it. The camera's actual value is kept.
    pub(super) fn granted(&mut self, readings: &Readings, control: Control) -> Lock {
        match readings.get(&control) {
            Some((value, false)) => {
                self.kept.insert(control, *value);
                Lock::Locked { value: *value }
            }
            Some((_, true)) | None => Lock::Free,
        }
    }

    pub(super) fn locks(&self, readings: &Readings) -> Locks {
        let mut locks = Locks::default();
        for control in Control::ALL {
            let lock = match self.kept.get(&control) {
                None => Lock::Absent,
                Some(&set) => match readings.get(&control) {
                    Some((read, _)) if *read != set => Lock::Ignored { set, read: *read },
                    Some((_, true)) | None => Lock::Free,
                    Some((_, false)) => Lock::Locked { value: set },
                },
            };
            locks.note(control, lock);
        }
        locks
    }

    /// Controls away from the locked state.
    pub(super) fn deviations(&self, readings: &Readings, locks: &Locks) -> Vec<Deviation> {
        let mut found = Vec::new();
        for control in Control::ALL {
            // A control that never obeyed is compared with its last reading, not with the value
            // set.
            let (from, was_free) = match locks.of(control) {
                Lock::Locked { value } => (value, false),
                Lock::Ignored { read, .. } => (read, true),
                Lock::Unknown | Lock::Absent | Lock::Free => continue,
            };
            if let Some(&(to, automatic)) = readings.get(&control)
                && (to != from || (automatic && !was_free))
            {
                found.push(Deviation { control, from, to });
            }
        }
        found
    }

    /// Changes of focus or zoom that can't be locked: control, value at the last call, value now.
    pub(super) fn moved_freely(
        &mut self,
        readings: &Readings,
        locks: &Locks,
    ) -> Vec<(Control, i64, i64)> {
        let mut moved = Vec::new();
        for (control, (now, _)) in readings {
            let is_free = matches!(locks.of(*control), Lock::Free) && control.moves_geometry();
            let before = self.free.insert(*control, *now);
            moved.extend(before.filter(|b| is_free && b != now).map(|b| (*control, b, *now)));
        }
        moved
    }

    /// Value of a control, and true if an automatic moves it; `None` if unreadable.
    ///
    /// # Errors
    ///
    /// If the device is gone.
    pub(super) fn read(
        &mut self,
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
            Ok(value) => {
                self.last.insert(control, (value, automatic));
                Ok(Some((value, automatic)))
            }
            Err(errno) if gone(errno) => Err(errno),
            Err(_) => Ok(None),
        }
    }

    /// Restores every control to the value before the session. Skips controls already at that
    /// value: each transfer may take seconds.
    pub(super) fn restore(&self, kernel: &mut dyn Kernel, device: Handle) {
        for (id, value) in &self.before {
            if self.stands_at(*id, *value) {
                continue;
            }
            if let Err(errno) = again(|| kernel.set_control(device, *id, *value))
                && gone(errno)
            {
                return;
            }
        }
    }

    /// True if a control was last read at `value`, or the automatic as off as before.
    fn stands_at(&self, id: u32, value: i64) -> bool {
        Control::ALL.into_iter().any(|control| {
            let (number, automatics) = numbers(control);
            let Some((read, automatic)) = self.last.get(&control) else { return false };
            let first = automatics.first().is_some_and(|(a, off)| *a == id && value == *off);
            (number == id && *read == value) || (first && !automatic)
        })
    }
}

/// Likely earlier values, for a recording without exact ones: an automatic was on.
fn guessed(before: &ControlBefore) -> Vec<(u32, i64)> {
    let (number, automatics) = numbers(before.control);
    let mut entries: Vec<(u32, i64)> =
        before.value.map(|value| (number, value)).into_iter().collect();
    if before.automatic == Some(true) {
        // 3 is "aperture priority" in the menu, with the time left to the camera.
        let on = if before.control == Control::Exposure { 3 } else { 1 };
        entries.extend(automatics.first().map(|(id, _)| (*id, on)));
    }
    entries
}

fn unless_gone(errno: Errno) -> Result<(), Errno> {
    if gone(errno) { Err(errno) } else { Ok(()) }
}

fn writable(kernel: &mut dyn Kernel, device: Handle, id: u32) -> Option<ControlRange> {
    again(|| kernel.control_range(device, id)).ok().filter(|range| range.writable)
}
