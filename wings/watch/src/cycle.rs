//! Daily cycle of a camera that stays, and the non-repeating remainder.

use nalgebra::{SMatrix, SVector, Vector4};

use crate::{
    sequential::quiet_scatter,
    slot::{DAY_SECS, SLOT_SECS, median4},
};
use boresight_scene::SIGMA_OF_MEDIAN;

/// Minimum scatter, as a share of the picture's width: estimates of a stationary camera scatter
/// less.
const LEAST_SCATTER: f64 = 0.15 / 1024.0;
/// Weight of the minimum scatter, in slots: a day.
const PRIOR_SLOTS: f64 = 4.0;
/// Ridge on the harmonics, as a share of the number of estimates: a night without answers mustn't
/// produce a wave.
const RIDGE: f64 = 0.02;
/// Constant, cosine and sine of a day and of half a day.
const TERMS: usize = 5;

/// Estimate with a time: pan, tilt, roll and focal length in px of the picture
/// ([`crate::Turn::in_px`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Seconds since 1970 (UTC).
    pub at_secs: f64,
    /// Estimate, px.
    pub value_px: Vector4<f64>,
}

/// Daily cycle of a camera, and scatter about the cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Cycle {
    terms: SMatrix<f64, TERMS, 4>,
    /// Scatter of six-hour medians about the cycle, px: the part that doesn't repeat from day to
    /// day. Larger if these days alone would come near an alarm.
    pub scatter_px: Vector4<f64>,
    /// Number of six-hour slots learned from.
    pub slots: usize,
}

fn harmonics(at_secs: f64) -> SVector<f64, TERMS> {
    let day = std::f64::consts::TAU * at_secs / DAY_SECS;
    SVector::from([1.0, libm::cos(day), libm::sin(day), libm::cos(2.0 * day), libm::sin(2.0 * day)])
}

impl Cycle {
    /// Learns the cycle, robustly. With `constant`, only the waves are learned and the mean of the
    /// older cycle is kept: otherwise a slow creep would be learned away. `None` without samples.
    pub fn learn(samples: &[Sample], width_px: f64, constant: Option<&Self>) -> Option<Self> {
        let count = samples.len();
        if count == 0 {
            return None;
        }
        let mut terms = SMatrix::<f64, TERMS, 4>::zeros();
        let held = constant.map(|older| older.terms.row(0).into_owned());
        let value = |sample: &Sample| {
            sample.value_px - held.map_or(Vector4::zeros(), |held| held.transpose())
        };
        let hours: Vec<SVector<f64, TERMS>> =
            samples.iter().map(|s| harmonics(s.at_secs)).collect();
        let mut weights = vec![1.0; count];
        for _ in 0..8 {
            let mut normal = SMatrix::<f64, TERMS, TERMS>::zeros();
            let mut right = SMatrix::<f64, TERMS, 4>::zeros();
            for ((sample, h), weight) in samples.iter().zip(&hours).zip(&weights) {
                normal += h * h.transpose() * *weight;
                right += h * value(sample).transpose() * *weight;
            }
            for i in 1..TERMS {
                normal[(i, i)] += RIDGE * count as f64;
            }
            if held.is_some() {
                // The constant of these days is a free nuisance parameter, fitted and then dropped.
                normal[(0, 0)] += 1e-9;
            }
            terms = normal.cholesky()?.solve(&right);
            let off: Vec<Vector4<f64>> =
                samples.iter().zip(&hours).map(|(s, h)| value(s) - terms.transpose() * h).collect();
            let scale = Vector4::from_fn(|i, _| {
                let mut all: Vec<f64> = off.iter().map(|o| o[i].abs()).collect();
                SIGMA_OF_MEDIAN * boresight_scene::median(&mut all).unwrap_or(0.0) + 1e-9
            });
            for (weight, off) in weights.iter_mut().zip(&off) {
                *weight = 1.0 / (1.0 + off.component_div(&scale).amax().powi(2) / 9.0);
            }
        }
        let own_constant = terms.row(0).into_owned();
        if let Some(held) = held {
            terms.set_row(0, &held);
        }
        let mut cycle = Self { terms, scatter_px: Vector4::zeros(), slots: 0 };
        // About the mean of these days: the sequential test handles the camera's position
        // meanwhile.
        let drifted = held.map_or(Vector4::zeros(), |_| own_constant.transpose());
        let off = |s: &Sample| cycle.residual(s) - drifted;
        let medians = slot_medians(samples, SLOT_SECS, off);
        let free = (medians.len() as f64 - TERMS as f64).max(1.0);
        let least = Vector4::repeat(LEAST_SCATTER * width_px);
        let of_slots = scatter(&medians, free, &least, PRIOR_SLOTS);
        let known: Vec<(f64, Vector4<f64>)> = samples.iter().map(|s| (s.at_secs, off(s))).collect();
        cycle.scatter_px = of_slots.sup(&quiet_scatter(&known));
        cycle.slots = medians.len();
        Some(cycle)
    }

    /// Pin: a constant of a few answers, without a wave. `scatter_px` as [`Self::scatter_px`].
    pub(crate) fn pinned(values_px: &[Vector4<f64>], scatter_px: Vector4<f64>) -> Self {
        let mut terms = SMatrix::<f64, TERMS, 4>::zeros();
        terms.set_row(0, &median4(values_px).transpose());
        Self { terms, scatter_px, slots: 0 }
    }

    /// Value at the hour for a camera that stays, px.
    pub fn at(&self, at_secs: f64) -> Vector4<f64> {
        self.terms.transpose() * harmonics(at_secs)
    }

    /// Distance of a sample from the cycle, px.
    pub fn residual(&self, sample: &Sample) -> Vector4<f64> {
        sample.value_px - self.at(sample.at_secs)
    }
}

/// Root mean square about zero, with the minimum scatter as `prior` additional values.
fn scatter(values: &[Vector4<f64>], free: f64, least: &Vector4<f64>, prior: f64) -> Vector4<f64> {
    let sum: Vector4<f64> = values.iter().map(|v| v.component_mul(v)).sum();
    ((least.component_mul(least) * prior + sum) / (prior + free)).map(f64::sqrt)
}

/// Medians of the values in each slot.
fn slot_medians(
    samples: &[Sample],
    slot_secs: f64,
    of: impl Fn(&Sample) -> Vector4<f64>,
) -> Vec<Vector4<f64>> {
    let mut slots: std::collections::BTreeMap<i64, Vec<Vector4<f64>>> =
        std::collections::BTreeMap::new();
    for sample in samples {
        slots.entry((sample.at_secs / slot_secs).floor() as i64).or_default().push(of(sample));
    }
    let mut counts: Vec<f64> = slots.values().map(|values| values.len() as f64).collect();
    let usual = boresight_scene::median(&mut counts).unwrap_or(0.0);
    // A slot just begun, or mostly at night, has no reliable median.
    let full = slots.into_values().filter(|values| 2.0 * values.len() as f64 >= usual);
    full.map(|values| median4(&values)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn days(count: u32, creep_px: f64) -> Vec<Sample> {
        (0..count * 96)
            .map(|i| {
                let at_secs = f64::from(i) * 900.0;
                let wave = (std::f64::consts::TAU * at_secs / DAY_SECS).sin();
                let creep = creep_px * at_secs / DAY_SECS;
                Sample { at_secs, value_px: Vector4::new(0.5 * wave + creep, -wave, 0.1, 0.0) }
            })
            .collect()
    }

    #[test]
    fn the_sway_of_a_day_is_learned() {
        let cycle = Cycle::learn(&days(3, 0.0), 1024.0, None).expect("samples");
        let next = Sample { at_secs: 5.25 * DAY_SECS, value_px: Vector4::new(0.5, -1.0, 0.1, 0.0) };
        // The ridge costs 4 % of the wave.
        assert!(cycle.residual(&next).amax() < 0.05, "{}", cycle.residual(&next));
        assert!(cycle.scatter_px.amax() < 0.2);
    }

    #[test]
    fn a_creep_is_never_learned_away() {
        let first = Cycle::learn(&days(3, 0.0), 1024.0, None).expect("samples");
        let later: Vec<Sample> = days(30, 0.1).into_iter().skip(16 * 96).collect();
        let second = Cycle::learn(&later, 1024.0, Some(&first)).expect("samples");
        let residual = second.residual(later.last().expect("samples"));
        assert!(residual[0] > 2.5, "{residual}");
        assert!((second.at(0.0) - first.at(0.0)).amax() < 0.1);
    }

    #[test]
    fn nothing_is_learned_from_nothing() {
        assert_eq!(Cycle::learn(&[], 1024.0, None), None);
    }
}
