//! Numbers of a lens that explain its difference from another.

use nalgebra::Point2;

use super::closest::{Closest, LensDirection, Rays};
use crate::{Calibration, LensModel};
use boresight_geometry::{Camera, LensParameter, frame::ImageSize};

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
    /// The axes of the picture or of the file.
    Axes(Axes),
    /// The distortion.
    Distortion {
        /// True if the lens states none.
        none_stated: bool,
    },
    /// The number of terms of the distortion: with as few, the views give nearly the same lens.
    TooFewTerms,
}

/// Mistake in the axes of the pictures, or of the file's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// The pictures are turned by 180°.
    HalfTurned,
    /// The pictures are mirrored.
    Mirrored,
    /// Rows are counted from below.
    FromBelow,
    /// cx and cy are exchanged.
    Exchanged,
}

impl Axes {
    const ALL: [Self; 4] = [Self::HalfTurned, Self::Mirrored, Self::FromBelow, Self::Exchanged];

    /// Principal point without this mistake, for pictures with the last pixel `last_px`.
    fn mended(self, pp_px: &Point2<f64>, last_px: &Point2<f64>) -> Point2<f64> {
        let [x, y] = (last_px - pp_px).into();
        match self {
            Self::HalfTurned => Point2::new(x, y),
            Self::Mirrored => Point2::new(x, pp_px.y),
            Self::FromBelow => Point2::new(pp_px.x, y),
            Self::Exchanged => pp_px.yx(),
        }
    }

    /// The mistake that leaves less than a ninth of the distance from `pp_px` to the true `to_px`.
    fn of(pp_px: &Point2<f64>, to_px: &Point2<f64>, size: ImageSize) -> Option<Self> {
        let last_px = 2.0 * size.centre_px();
        let left_px = |axes: &Self| (axes.mended(pp_px, &last_px) - to_px).norm();
        let nearest = Self::ALL.into_iter().min_by(|a, b| left_px(a).total_cmp(&left_px(b)))?;
        (left_px(&nearest) < LEFT * LEFT * (pp_px - to_px).norm()).then_some(nearest)
    }
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
    /// Part of `camera` that explains `off_px` of its difference from the `rays` of `fresh`, whose
    /// own bound is `bound_px`: mended, it leaves no more than that, or a third, and every ray has
    /// an image. The one of the fewest numbers; of several, the one that leaves least. `None` if no
    /// part alone explains it.
    pub(super) fn of(
        camera: &Camera,
        fresh: &Calibration,
        rays: &Rays,
        bound_px: f64,
        off_px: f64,
    ) -> Option<Self> {
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
        let part = mended.min_by(least).map(|(.., part)| part);
        let axes = match part {
            Some(Self::PrincipalPoint { .. }) => {
                Axes::of(&camera.pp_px, &fresh.camera.pp_px, fresh.image_size)
            }
            _ => None,
        };
        axes.map(Self::Axes).or(part)
    }

    /// True if `simple`, a lens of the same views with the terms of `camera`, is as wrong as that:
    /// within a third of `off_px` at the pixels `px`.
    pub(super) fn is_of_few_terms(
        camera: &Camera,
        simple: &Camera,
        px: impl Iterator<Item = Point2<f64>>,
        off_px: f64,
    ) -> bool {
        let closest = Rays::of(simple, px).closest_to(camera, &[]);
        closest.is_some_and(|closest| closest.off_px < LEFT * off_px)
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
            Self::Axes(_) => "AXES",
            Self::TooFewTerms => "TOO-FEW-TERMS",
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
