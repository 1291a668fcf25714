//! Controls of the simulated USB camera, as seen by UVC requests.

/// A control: unit and selector, number of bytes, and its numbers.
#[derive(Clone, Debug)]
pub(crate) struct Control {
    pub(crate) name: &'static str,
    unit: u8,
    selector: u8,
    length: usize,
    min: i32,
    max: i32,
    /// Step, or the set of values for a choice.
    step: i32,
    default: i32,
    pub(crate) value: i32,
}

/// All controls at defaults; focus and exposure are automatic.
pub(crate) fn all() -> Vec<Control> {
    let control = |name, (unit, selector, length), (min, max, step), default| Control {
        name,
        unit,
        selector,
        length,
        min,
        max,
        step,
        default,
        value: default,
    };
    vec![
        // 1: manual, 8: the camera chooses the time.
        control("exposure_auto", (1, 0x02, 1), (0, 0, 0x09), 8),
        control("exposure", (1, 0x04, 4), (1, 5000, 1), 156),
        control("focus", (1, 0x06, 2), (0, 255, 1), 30),
        control("focus_auto", (1, 0x08, 1), (0, 1, 1), 1),
        control("zoom", (1, 0x0b, 2), (100, 400, 1), 100),
        control("brightness", (2, 0x02, 2), (0, 255, 1), 128),
    ]
}

/// Control of a request.
pub(crate) fn find(controls: &mut [Control], unit: u8, selector: u8) -> Option<&mut Control> {
    controls.iter_mut().find(|control| (control.unit, control.selector) == (unit, selector))
}

impl Control {
    /// Answers a read request; `None` for an unknown number.
    pub(crate) fn read(&self, request: u8) -> Option<Vec<u8>> {
        let number = |value: i32| Some(value.to_le_bytes()[..self.length].to_vec());
        match request {
            0x81 => number(self.value),
            0x82 => number(self.min),
            0x83 => number(self.max),
            0x84 => number(self.step),
            0x85 => Some((self.length as u16).to_le_bytes().to_vec()),
            // Readable, settable, and autonomous in its changes.
            0x86 => Some(vec![0x0b]),
            0x87 => number(self.default),
            _ => None,
        }
    }

    /// Sets the control; false for invalid bytes.
    pub(crate) fn set(&mut self, bytes: &[u8]) -> bool {
        if bytes.len() < self.length {
            return false;
        }
        let mut four = [0; 4];
        four[..self.length].copy_from_slice(&bytes[..self.length]);
        self.value = i32::from_le_bytes(four);
        true
    }
}
