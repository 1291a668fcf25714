use std::f64::consts::FRAC_PI_4;

use super::snapshot::Snapshot;
use crate::guidance::direction_difference_rad;

/// A slot of the plan's eight directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSlot {
    /// Direction of the slot in the picture, clockwise from the right.
    pub slot_rad: f64,
    /// Index of the newest view in the slot.
    pub view: Option<usize>,
    /// True if the session asks for the direction now.
    pub wanted: bool,
}

impl Snapshot {
    /// The eight slots of the plan, clockwise from the first below the right.
    pub fn wheel(&self) -> [WheelSlot; 8] {
        std::array::from_fn(|i| {
            let slot_rad = FRAC_PI_4 * (i as f64 + 0.5);
            let here = |direction_rad: f64| {
                direction_difference_rad(direction_rad, slot_rad).abs() <= FRAC_PI_4 / 2.0
            };
            WheelSlot {
                slot_rad,
                view: self.views.iter().rposition(|view| here(view.tilt_azimuth_rad)),
                wanted: self.target.as_ref().is_some_and(|target| here(target.tilt_azimuth_rad)),
            }
        })
    }
}
