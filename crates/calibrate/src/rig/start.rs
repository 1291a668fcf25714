//! Start of a rig's bundle: poses seen by each camera alone, and the motions between the cameras on
//! which most instants agree.
//!
//! A board's pose has a reversed tilt that looks nearly the same, and a board that looks the same
//! upside down may be numbered from either end. Each camera proposes all of them; the largest group
//! of instants with one motion between two cameras decides, and then each instant is turned to
//! agree (`docs/method.md`, 9).

use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector3};

use super::{NotARig, View};
use boresight_geometry::{Camera, Corner, boards::Board};

/// Largest angle between two equal motions of a pair, in radians: seen poses err by a few degrees.
const SAME_RAD: f64 = 0.15;
/// Most instants of a pair that are compared with each other.
const COMPARED: usize = 60;
/// Least share of a pair's instants with one motion: below, the pictures aren't pairs.
const AGREEING: f64 = 0.5;
/// Instants below which a share says nothing.
const FEW: usize = 4;

/// Places of the cameras and of the board; boards numbered from one end.
pub(super) struct Start {
    pub(super) origin: usize,
    pub(super) cam_from_rig: Vec<Isometry3<f64>>,
    pub(super) rig_from_board: Vec<Isometry3<f64>>,
    pub(super) views: Vec<View>,
}

/// Motion between two cameras, and its instants.
struct Link {
    of: [usize; 2],
    second_from_first: Isometry3<f64>,
    agreeing: usize,
}

/// Start from views of `instants` instants, each with its `poses` by the lenses `cameras`.
pub(super) fn start(
    mut views: Vec<View>,
    poses: &[Vec<Isometry3<f64>>],
    instants: usize,
    cameras: &[Camera],
    board: &Board,
) -> Result<Start, NotARig> {
    let mut links = Vec::new();
    for a in 0..cameras.len() {
        for b in a + 1..cameras.len() {
            links.extend(link([a, b], &views, poses, board)?);
        }
    }
    let (origin, cam_from_rig) = spanned(&links, cameras.len())?;
    let mut rig_from_board = Vec::with_capacity(instants);
    for instant in 0..instants {
        let seen: Vec<usize> =
            (0..views.len()).filter(|view| views[*view].instant == instant).collect();
        let (place, turned) = placed(&seen, &views, poses, (cameras, &cam_from_rig), board)
            .unwrap_or((Isometry3::identity(), Vec::new()));
        for view in turned {
            let corners = half_turned(&views[view].corners, board);
            views[view].corners = corners;
        }
        rig_from_board.push(place);
    }
    Ok(Start { origin, cam_from_rig, rig_from_board, views })
}

/// Half turn of a board about its middle.
fn half_turn() -> Isometry3<f64> {
    Isometry3::rotation(Vector3::z() * core::f64::consts::PI)
}

/// Corners of a board numbered from the other end.
fn half_turned(corners: &[Corner], board: &Board) -> Vec<Corner> {
    let target = board.target();
    let at = |i: usize| target.half_turn(i).map_or(corners[i], |turned| corners[turned]);
    (0..corners.len()).map(at).collect()
}

/// Motion from one camera to another on which most of their instants agree; `None` without a
/// common instant.
fn link(
    [a, b]: [usize; 2],
    views: &[View],
    poses: &[Vec<Isometry3<f64>>],
    board: &Board,
) -> Result<Option<Link>, NotARig> {
    let of = |camera| views.iter().enumerate().filter(move |(_, view)| view.camera == camera);
    let mut pairs: Vec<[usize; 2]> = of(a)
        .flat_map(|(i, one)| {
            of(b).filter(|(_, two)| two.instant == one.instant).map(move |(j, _)| [i, j])
        })
        .collect();
    let step = pairs.len().div_ceil(COMPARED).max(1);
    pairs = pairs.into_iter().step_by(step).collect();
    let turns: &[Isometry3<f64>] = match board.looks_the_same_upside_down() {
        true => &[Isometry3::identity(), half_turn()],
        false => &[Isometry3::identity()],
    };
    let motions: Vec<Vec<Isometry3<f64>>> = pairs
        .iter()
        .map(|[i, j]| {
            let both = poses[*i].iter().flat_map(|one| poses[*j].iter().map(move |two| (one, two)));
            both.flat_map(|(one, two)| turns.iter().map(move |turn| two * turn * one.inverse()))
                .collect()
        })
        .collect();
    // The nearest motion of each instant.
    let nearest = |to: &Isometry3<f64>| -> Vec<(f64, Isometry3<f64>)> {
        let angle = |motion: &Isometry3<f64>| motion.rotation.angle_to(&to.rotation);
        let of_instant = |all: &Vec<Isometry3<f64>>| {
            all.iter().map(|motion| (angle(motion), *motion)).min_by(|a, b| a.0.total_cmp(&b.0))
        };
        motions.iter().filter_map(of_instant).filter(|(angle, _)| *angle < SAME_RAD).collect()
    };
    let score = |group: &[(f64, Isometry3<f64>)]| {
        group.len() as f64 - group.iter().map(|(angle, _)| angle).sum::<f64>()
    };
    // Of equal groups the first: its tilts fit best.
    let groups = motions.iter().flatten().rev().map(nearest);
    let Some(best) = groups.max_by(|a, b| score(a).total_cmp(&score(b))) else { return Ok(None) };
    let agreeing = best.len();
    if pairs.len() >= FEW && (agreeing as f64) < AGREEING * pairs.len() as f64 {
        return Err(NotARig::NotPairs { of: [a, b], agreeing, instants: pairs.len() });
    }
    Ok(Some(Link { of: [a, b], second_from_first: middle(&best), agreeing }))
}

/// Median motion of a group about its first.
fn middle(group: &[(f64, Isometry3<f64>)]) -> Isometry3<f64> {
    let first = group[0].1.rotation;
    let median = |of: &dyn Fn(&Isometry3<f64>) -> f64| {
        let mut values: Vec<f64> = group.iter().map(|(_, motion)| of(motion)).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let turn = |i: usize| median(&|motion| (motion.rotation * first.inverse()).scaled_axis()[i]);
    let shift = |i: usize| median(&|motion| motion.translation.vector[i]);
    let turn = Vector3::new(turn(0), turn(1), turn(2));
    Isometry3::from_parts(
        Translation3::new(shift(0), shift(1), shift(2)),
        UnitQuaternion::from_scaled_axis(turn) * first,
    )
}

/// Places of all cameras from the links with the most instants, and the camera of the frame: the
/// first of the first link.
fn spanned(links: &[Link], cameras: usize) -> Result<(usize, Vec<Isometry3<f64>>), NotARig> {
    let mut places: Vec<Option<Isometry3<f64>>> = vec![None; cameras];
    let seen = |camera: usize| -> usize {
        links.iter().filter(|link| link.of.contains(&camera)).map(|link| link.agreeing).sum()
    };
    // Of cameras with as many instants, the first.
    let origin = (0..cameras).rev().max_by_key(|camera| seen(*camera)).unwrap_or_default();
    places[origin] = Some(Isometry3::identity());
    loop {
        let open = |link: &&Link| {
            let [a, b] = link.of.map(|camera| places[camera].is_some());
            a != b
        };
        let Some(link) = links.iter().filter(open).max_by_key(|link| link.agreeing) else { break };
        let [a, b] = link.of;
        match (places[a], places[b]) {
            (Some(a), None) => places[b] = Some(link.second_from_first * a),
            (None, Some(b)) => places[a] = Some(link.second_from_first.inverse() * b),
            _ => break,
        }
    }
    let unlinked = (0..cameras).filter(|camera| places[*camera].is_none()).collect::<Vec<_>>();
    if unlinked.is_empty() {
        Ok((origin, places.into_iter().flatten().collect()))
    } else {
        Err(NotARig::Unlinked { cameras: unlinked })
    }
}

/// Place of the board at an instant that all its cameras see best, and the views to turn.
fn placed(
    seen: &[usize],
    views: &[View],
    poses: &[Vec<Isometry3<f64>>],
    (cameras, cam_from_rig): (&[Camera], &[Isometry3<f64>]),
    board: &Board,
) -> Option<(Isometry3<f64>, Vec<usize>)> {
    let board_m = board.corners_in_board_m();
    let may_turn = board.looks_the_same_upside_down();
    let off_px = |view: usize, place: &Isometry3<f64>| {
        let (camera, cam_from_board) =
            (&cameras[views[view].camera], cam_from_rig[views[view].camera] * place);
        let corners = views[view].corners.iter().zip(&board_m);
        let mut off: Vec<f64> = corners
            .filter(|(corner, _)| corner.is_seen())
            .map(|(corner, point): (&Corner, &Point2<f64>)| {
                let px = camera.px_from_board(&cam_from_board, point);
                px.map_or(1e4, |px| (px - corner.px).norm())
            })
            .collect();
        off.sort_by(f64::total_cmp);
        off.get(off.len() / 2).copied().unwrap_or_default()
    };
    let proposed = seen.iter().flat_map(|view| {
        let rig_from_cam = cam_from_rig[views[*view].camera].inverse();
        poses[*view].iter().map(move |pose| rig_from_cam * pose)
    });
    let weighed = proposed.map(|place| {
        let (mut total_px, mut turned) = (0.0, Vec::new());
        for view in seen {
            let plain_px = off_px(*view, &place);
            let turned_px =
                if may_turn { off_px(*view, &(place * half_turn())) } else { f64::INFINITY };
            if turned_px < plain_px {
                turned.push(*view);
            }
            total_px += plain_px.min(turned_px);
        }
        (total_px, place, turned)
    });
    let (_, place, turned) = weighed.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((place, turned))
}
