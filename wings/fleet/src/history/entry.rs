//! Calibration in a row.

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use crate::batch::{Row, StatedRow};
use boresight_calibrate::StatedLens;

/// A calibration of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The session's folder, an absolute path.
    pub session: String,
    /// Camera name: the session's source, which identifies a live camera by vendor, product and
    /// serial number.
    pub camera: String,
    /// Model name; empty if the source has none.
    pub model: String,
    /// Start of the session, UTC.
    pub created: String,
    /// Width and height of the picture.
    pub image_size: [u32; 2],
    /// `good`, `care` or `untrustworthy`.
    pub verdict: String,
    /// Lens with covariance, if common to all views.
    pub lens: Option<StatedLens>,
}

/// The used part of a [`Row`]; a line has more.
#[derive(Deserialize)]
pub(super) struct Counted {
    /// Name and version of the format.
    pub(super) schema: String,
    session: String,
    source: Option<String>,
    model: Option<String>,
    created: Option<String>,
    image_size: Option<[u32; 2]>,
    verdict: Option<String>,
    stated: Option<StatedRow>,
}

impl From<&Row> for Counted {
    fn from(row: &Row) -> Self {
        Self {
            schema: row.schema.clone(),
            session: row.session.clone(),
            source: row.source.clone(),
            model: row.model.clone(),
            created: row.created.clone(),
            image_size: row.image_size,
            verdict: row.verdict.clone(),
            stated: row.stated,
        }
    }
}

impl Entry {
    /// Calibration in a row; `None` without one.
    pub(super) fn of(row: Counted) -> Option<Self> {
        Some(Self {
            session: row.session,
            camera: row.source?,
            model: row.model.unwrap_or_default(),
            created: row.created?,
            image_size: row.image_size?,
            verdict: row.verdict?,
            lens: row.stated.map(|stated| {
                let (f_px, [x_px, y_px]) = (stated.f_px, stated.pp_px);
                let rows = stated.covariance_px2;
                StatedLens {
                    f_pp_px: Vector3::new(f_px, x_px, y_px),
                    covariance_px2: Matrix3::from_fn(|i, j| rows[i][j]),
                }
            }),
        })
    }

    /// Sort key of entries.
    pub(super) fn order(&self) -> (&str, [u32; 2], &str, &str) {
        (&self.camera, self.image_size, &self.created, &self.session)
    }

    /// True if the calibration counts in a trend.
    pub fn is_usable(&self) -> bool {
        self.lens.is_some() && self.verdict != "untrustworthy"
    }
}
