//! Numbers of a lens that explain its difference from another.

use super::closest::{Closest, LensDirection, Rays};
use crate::LensModel;
use boresight_geometry::{Camera, LensParameter};

/// Share of the difference that may remain where a part is called wrong: a ninth of its square.
const LEFT: f64 = 1.0 / 3.0;
/// Ratios of a picture's sides, and so of its pixels, that a stretched picture has.
const STRETCHES: [(u32, u32); 3] = [(4, 3), (16, 9), (3, 2)];
/// Relative distance within which a ratio is one of [`STRETCHES`].
const SAME_RATIO: f64 = 0.003;

/// Sizes of pictures, relative to each other, that no two modes of a camera have.
const ONE_SIZE: std::ops::Range<f64> = 0.8..1.25;

/// Part of a lens that is wrong: with it mended, the lens is true, or nearly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WrongPart {
    /// The focal length.
    FocalLength {
        /// Stated focal length, relative to the true one.
        ratio: f64,
    },
    /// The focal length along one axis against the other: the pictures were stretched.
    Stretched {
        /// Stated `fy/fx`, relative to the true one.
        ratio: f64,
        /// The ratio as whole numbers, if it's that of common shapes of pictures.
        exactly: Option<(u32, u32)>,
    },
    /// Focal length and principal point alike: the lens is that of pictures of another size.
    Scaled {
        /// Size of the lens's pictures, relative to these.
        ratio: f64,
    },
    /// The principal point.
    PrincipalPoint {
        /// Stated less true position, in pixels.
        off_px: [f64; 2],
    },
    /// The distortion.
    Distortion {
        /// True if the lens states none.
        none_stated: bool,
    },
}

/// A kind of wrong part: its directions at a lens, and the part by the lens and its mended form.
struct Kind {
    free: fn(&Camera) -> Vec<LensDirection>,
    part: fn(&Camera, &Camera) -> Option<WrongPart>,
}

/// Every kind, the fewest numbers first.
const KINDS: [Kind; 5] = [
    Kind {
        free: |camera| vec![along(&[LensParameter::Fx, LensParameter::Fy], camera)],
        part: |given, mended| Some(WrongPart::FocalLength { ratio: given.f_px.x / mended.f_px.x }),
    },
    Kind {
        free: |camera| {
            vec![along(&[LensParameter::Fy], camera), along(&[LensParameter::Fx], camera)]
        },
        part: |given, mended| {
            let ratio = given.f_px.y / given.f_px.x * mended.f_px.x / mended.f_px.y;
            Some(WrongPart::Stretched { ratio, exactly: WrongPart::whole_ratio(ratio) })
        },
    },
    Kind {
        free: |camera| vec![along(&LensParameter::F_THEN_PP, camera)],
        part: |given, mended| {
            let ratio = given.f_px.x / mended.f_px.x;
            (!ONE_SIZE.contains(&ratio)).then_some(WrongPart::Scaled { ratio })
        },
    },
    Kind {
        free: |_| LensParameter::PP.map(unit).into(),
        part: |given, mended| {
            let off_px = (given.pp_px - mended.pp_px).into();
            Some(WrongPart::PrincipalPoint { off_px })
        },
    },
    Kind {
        free: |camera| {
            let richest = if camera.distortion.kind.keeps_lines() {
                LensModel::K1K2P1P2K3
            } else {
                LensModel::FisheyeK1K2K3K4
            };
            richest.distortion().iter().copied().map(unit).collect()
        },
        part: |given, _| {
            let lens = given.lens_parameters();
            let is_zero = |parameter: LensParameter| lens[parameter.index()] == 0.0;
            let none_stated = LensParameter::DISTORTION.into_iter().all(is_zero);
            Some(WrongPart::Distortion { none_stated })
        },
    },
];

impl WrongPart {
    /// Part of `camera` that explains `off_px` of its difference from `rays`, whose own bound is
    /// `bound_px`: mended, it leaves no more than that, or a third, and every ray has an image. The
    /// one of the fewest numbers; of several, the one that leaves least. `None` if no part alone
    /// explains it.
    pub(super) fn of(camera: &Camera, rays: &Rays, bound_px: f64, off_px: f64) -> Option<Self> {
        let left_px = if off_px.is_finite() { bound_px.max(LEFT * off_px) } else { bound_px };
        let explains = |closest: &Closest| closest.off_px <= left_px;
        let mended = KINDS.iter().filter_map(|kind| {
            let free = (kind.free)(camera);
            let closest = rays.closest_to(camera, &free).filter(explains)?;
            let part = (kind.part)(camera, &closest.camera)?;
            Some((free.len(), closest.off_px, part))
        });
        let least = |a: &(usize, f64, Self), b: &(usize, f64, Self)| {
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        };
        Some(mended.min_by(least)?.2)
    }

    /// `ratio` as whole numbers, if it's that of common shapes of pictures.
    pub fn whole_ratio(ratio: f64) -> Option<(u32, u32)> {
        let both = STRETCHES.into_iter().flat_map(|(long, short)| [(long, short), (short, long)]);
        let same = |a: u32, b: u32| ratio * f64::from(b) / f64::from(a) - 1.0;
        both.into_iter().find(|(a, b)| same(*a, *b).abs() < SAME_RATIO)
    }

    /// Stable name, for files and programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::FocalLength { .. } => "FOCAL-LENGTH",
            Self::Stretched { .. } => "STRETCHED",
            Self::Scaled { .. } => "OTHER-SIZE",
            Self::PrincipalPoint { .. } => "PRINCIPAL-POINT",
            Self::Distortion { none_stated: true } => "NO-DISTORTION",
            Self::Distortion { none_stated: false } => "DISTORTION",
        }
    }
}

/// Direction that scales `parameters` of `camera` alike. Pixels are counted from half a pixel
/// inside the picture.
fn along(parameters: &[LensParameter], camera: &Camera) -> LensDirection {
    let lens = camera.lens_parameters();
    let mut direction = LensDirection::zeros();
    for parameter in parameters {
        let from_edge_px = if LensParameter::PP.contains(parameter) { 0.5 } else { 0.0 };
        direction[parameter.index()] = lens[parameter.index()] + from_edge_px;
    }
    direction
}

fn unit(parameter: LensParameter) -> LensDirection {
    LensDirection::ith(parameter.index(), 1.0)
}
