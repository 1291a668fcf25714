//! Per-view data for browser pages is not resent with every frame.

use std::sync::Arc;

use boresight_present::browser::{Plan, PlanSource, Teller};
use boresight_sim::technician::Person;

use crate::one_instruction::sitting;

#[test]
fn the_plan_is_made_again_only_when_it_has_changed() {
    let (mut teller, mut last) = (Teller::default(), None::<(PlanSource, String)>);
    let (mut made, mut frames) = (0, 0);
    let who = (1, Person::Usual.params());
    sitting(who, (33_000_000, 0.1), |_, snapshot, _| {
        frames += 1;
        teller.tell(snapshot);
        let snapshot = Arc::new(snapshot.clone());
        let source = PlanSource { snapshot, refused: teller.refused() };
        let plan = serde_json::to_string(&Plan::of(&source)).expect("numbers and words");
        match &last {
            Some((before, same)) if *before == source => assert_eq!(plan, *same),
            _ => made += 1,
        }
        last = Some((source, plan));
    });
    println!("{made} plans in {frames} frames");
    assert!(4 * made < frames, "{made} plans in {frames} frames");
}
