//! Conclusions of the comparison, in words: the best strategy at each task, and our rank.

use super::{
    limit::Limit,
    summary::{Arrival, COMPARED_AFTER, Row, Spread},
};
use crate::{
    outcome::{Claim, Verdict},
    params::Hand,
};

/// Maximum number of views and seconds of the median session.
const SESSION_VIEWS: f64 = 4.0;
const SESSION_SECS: f64 = 12.0;
/// Maximum ratio of our stated deviation to the limit's.
const NEAR_LIMIT: f64 = 1.3;
/// Ratio to the best above which a claim fails completely.
const NEARLY: f64 = 1.25;

/// Note for most of our runs ending before the comparison.
const TOO_FEW: &str = "Fewer than half of our runs come so far.";

/// Quantity for ranking strategies; less is better.
struct Quantity {
    what: String,
    value: ValueOf,
}

/// Function from a row to a value; `None` if a strategy has no value.
type ValueOf = Box<dyn Fn(&Row) -> Option<Value>>;

/// Value with half the width of its 95 % interval, for a median or rms with relevant scatter.
#[derive(Clone, Copy)]
struct Value {
    value: f64,
    interval: f64,
}

/// Claims of `rows`, all with the same hand.
pub(super) fn claims(rows: &[Row], limits: &[Limit]) -> Vec<Claim> {
    let Some(hand) = rows.first().map(|row| row.hand) else { return Vec::new() };
    let mut claims: Vec<Claim> =
        quantities().iter().filter_map(|quantity| least(quantity, rows, hand)).collect();
    claims.push(near_the_limit(rows, limits, hand));
    claims.extend(session(rows, limits, hand));
    claims
}

fn quantities() -> Vec<Quantity> {
    let mut all: Vec<Quantity> = Vec::new();
    let mut arrivals = |what: &str, value: fn(&Row) -> &Arrival| {
        all.push(Quantity {
            what: what.into(),
            value: Box::new(move |row| Some(Value { value: value(row).median, interval: 0.0 })),
        });
    };
    arrivals("views to PP sd 1 px", |row| &row.to_pp[0]);
    arrivals("seconds to PP sd 1 px", |row| &row.to_pp[1]);
    arrivals("views to mean projection sd 0.3 px", |row| &row.to_projection[0]);
    arrivals("seconds to mean projection sd 0.3 px", |row| &row.to_projection[1]);
    let lenses = [(1, "k3 lens fitted with k1"), (2, "field-of-view lens fitted with k1, k2")];
    for (after, views) in COMPARED_AFTER.into_iter().enumerate() {
        for (course, lens) in lenses {
            let of = move |row: &Row| spread(row.after[after].fitted[course]);
            let what = format!("PP error (px) after {views} views, {lens}");
            all.push(Quantity { what, value: Box::new(of) });
        }
        for (course, lens) in [(0, "right lens"), (1, "k3 lens"), (2, "field-of-view lens")] {
            let of = move |row: &Row| spread(row.after[after].calibrated[course]);
            let what = format!("PP error (px) after {views} views, {lens}, model by BIC");
            all.push(Quantity { what, value: Box::new(of) });
        }
    }
    all
}

fn spread(spread: Option<Spread>) -> Option<Value> {
    spread.map(|spread| Value { value: spread.rms, interval: spread.interval })
}

/// Claim "Ours is best", or the best strategy with ratio and reason.
fn least(quantity: &Quantity, rows: &[Row], hand: Hand) -> Option<Claim> {
    let ranked = |ours: bool| {
        rows.iter()
            .filter(|row| row.strategy.is_ours() == ours)
            .filter_map(|row| Some((row, (quantity.value)(row)?)))
            .min_by(|a, b| a.1.value.total_cmp(&b.1.value))
    };
    let (other, theirs) = ranked(false)?;
    let claim = format!("Least {} ({} hand).", quantity.what, hand.code());
    let Some((own, mine)) = ranked(true) else {
        let measured = TOO_FEW.into();
        return Some(Claim { claim, measured, verdict: Verdict::Fails });
    };
    let said = |value: f64| {
        if value.is_finite() { format!("{value:.2}") } else { "never".into() }
    };
    let (measured, verdict) = if mine.value.is_infinite() && theirs.value.is_infinite() {
        ("Half of the runs never get there, whatever the strategy.".to_string(), Verdict::Fails)
    } else if mine.value <= theirs.value {
        let level = if mine.value == theirs.value { ", level with" } else { "; next is" };
        let measured = format!(
            "Ours is best: {}, {}{level} {}, {}.",
            own.strategy.code,
            said(mine.value),
            other.strategy.code,
            said(theirs.value)
        );
        (measured, Verdict::Holds)
    } else {
        let within = (mine.value - theirs.value) <= mine.interval.hypot(theirs.interval);
        let scatter = if within { " The difference lies within its 95 % interval." } else { "" };
        let measured = format!(
            "{} is best with {}; ours, {}, has {}.{scatter} {}",
            other.strategy.code,
            said(theirs.value),
            own.strategy.code,
            said(mine.value),
            why(other, own)
        );
        let nearly = within || mine.value <= NEARLY * theirs.value;
        (measured, if nearly { Verdict::Partly } else { Verdict::Fails })
    };
    Some(Claim { claim, measured, verdict })
}

/// Differences between the best strategy and ours, in words.
fn why(best: &Row, own: &Row) -> String {
    format!(
        "Views of {} span {:.0} % of the picture and take {:.1} s in {:.1} tries; ours, {:.0} %, {:.1} s, {:.1} tries.",
        best.strategy.code,
        100.0 * best.span_fraction,
        best.secs_per_view,
        best.tries_per_view,
        100.0 * own.span_fraction,
        own.secs_per_view,
        own.tries_per_view
    )
}

/// Standard deviation of the row's principal point over the limit after as many views. `None`
/// without a limit or a value.
pub(super) fn times_the_limit(row: &Row, after: usize, limits: &[Limit]) -> Option<f64> {
    let limit = limits.iter().find(|limit| limit.views == COMPARED_AFTER[after])?;
    Some(row.after[after].pp_sd_px? / limit.pp_sd_px)
}

fn near_the_limit(rows: &[Row], limits: &[Limit], hand: Hand) -> Claim {
    let mut said = Vec::new();
    let mut worst: f64 = 0.0;
    for (after, views) in COMPARED_AFTER.into_iter().enumerate() {
        let nearest = rows
            .iter()
            .filter(|row| row.strategy.is_ours())
            .filter_map(|row| Some((row.strategy.code, times_the_limit(row, after, limits)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        worst = worst.max(nearest.map_or(f64::INFINITY, |(_, times)| times));
        if let Some((code, times)) = nearest {
            said.push(format!("{times:.2} × after {views} views ({code})"));
        }
    }
    let measured = if said.is_empty() { TOO_FEW.into() } else { format!("{}.", said.join(", ")) };
    Claim {
        claim: format!(
            "Ours states at most {NEAR_LIMIT} × the limit's PP sd ({} hand).",
            hand.code()
        ),
        measured,
        verdict: graded(worst, NEAR_LIMIT),
    }
}

fn session(rows: &[Row], limits: &[Limit], hand: Hand) -> Option<Claim> {
    let row = rows.iter().find(|row| row.strategy.code == "ours-adaptive")?;
    let [views, secs] = row.complete.as_ref()?;
    let measured = if views.median.is_finite() {
        let shortest = limits.iter().find(|limit| limit.views as f64 == views.median);
        let shortest = shortest.map_or_else(String::new, |limit| {
            format!(
                " The limit's {} poses take {:.1} s if none is missed.",
                limit.views, limit.secs
            )
        });
        format!(
            "Median {:.0} views and {:.1} s; {} runs complete.{shortest}",
            views.median, secs.median, views.arrived
        )
    } else {
        format!("Fewer than half of the runs complete: {}.", views.arrived)
    };
    let worst = (views.median / SESSION_VIEWS).max(secs.median / SESSION_SECS);
    Some(Claim {
        claim: format!(
            "A session that stops automatically takes at most {SESSION_VIEWS} views and {SESSION_SECS} s ({} hand).",
            hand.code()
        ),
        measured,
        verdict: graded(worst, 1.0),
    })
}

/// Verdict on a `value` expected below `wanted`; [`Verdict::Partly`] up to `NEARLY` times `wanted`.
fn graded(value: f64, wanted: f64) -> Verdict {
    if value <= wanted {
        Verdict::Holds
    } else if value <= NEARLY * wanted {
        Verdict::Partly
    } else {
        Verdict::Fails
    }
}
